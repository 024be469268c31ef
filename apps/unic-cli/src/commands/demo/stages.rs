//! The stages of a demo: each is a command that anyone can run.

use crate::{
    args::{Args, Command, DemoArgs, DemoGarment},
    commands, interrupt,
};
use anyhow::Result;
use clap::{Parser, ValueEnum};
use serde::Serialize;
use std::{
    borrow::Cow,
    path::{Path, PathBuf},
};

/// Largest number of animated frames: one .glb holds no more.
const ANIMATED_FRAMES: usize = 300;

/// Amount of motion and training.
#[derive(Serialize)]
pub(super) struct Scale {
    motions: &'static [&'static str],
    /// Motions that are held out of training, for the evaluation.
    test: &'static [&'static str],
    /// Duration of each motion, in seconds.
    seconds: u32,
    preset: &'static str,
    /// Optimiser steps of each fit.
    steps: u32,
    /// Optimiser steps of the prior's recurrence.
    prior_steps: u32,
    /// Widths and layers of the fields that are tried, as a setting.
    field_sizes: &'static str,
}

const FULL: Scale = Scale {
    motions: &[
        "walk_speeds",
        "walk_circles",
        "walk_starts_stops",
        "walk_slalom",
        "run_circles",
        "arms_trunk",
        "mixed",
    ],
    test: &["turn_on_spot", "dance"],
    seconds: 16,
    preset: "standard",
    steps: 100,
    prior_steps: 300,
    // A field gains nothing on two minutes of motion, and larger ones take a minute to say so.
    field_sizes: "[[64,4]]",
};

/// Windows in a step of the prior's recurrence. On little motion many small steps do better than
/// few large ones.
const PRIOR_WINDOWS: u32 = 16;

/// Frames of such a window.
const PRIOR_FRAMES: u32 = 64;

/// Interval of the frames in which the evaluation measures intersections and the Hausdorff distance,
/// which take half of its time in every frame. Their means change in the third digit.
const NEAREST_EVERY: &str = "5";

const QUICK: Scale = Scale {
    motions: &["walk_circles", "mixed"],
    test: &["dance"],
    seconds: 5,
    preset: "tiny",
    steps: 60,
    prior_steps: 40,
    field_sizes: "[]",
};

/// One command, with the file that exists once it has finished.
pub(super) struct Stage {
    pub(super) title: &'static str,
    pub(super) leaves: PathBuf,
    words: Vec<String>,
}

pub(super) fn garment(args: &DemoArgs) -> String {
    let value = DemoGarment::to_possible_value(&args.garment);
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

pub(super) fn scale(args: &DemoArgs) -> Scale {
    if args.quick { QUICK } else { FULL }
}

pub(super) fn stages(args: &DemoArgs) -> Vec<Stage> {
    let out = args.out.as_path();
    let scale = scale(args);
    let [capture, model, report, animation] =
        ["capture", "demo.unic", "report.html", "animation.glb"].map(|name| out.join(name));
    let motion = capture.join("clips").join("dance.npz");
    vec![
        Stage {
            title: "simulate the garment",
            leaves: capture.join("capture.toml"),
            words: simulate(args, &scale, &capture),
        },
        Stage {
            title: "train a model",
            leaves: model.clone(),
            words: train(&scale, &capture, &model),
        },
        Stage {
            title: "measure it on motions that it has not seen",
            leaves: report.clone(),
            words: words(&[
                "eval",
                &show(&model),
                &show(&capture),
                "--nearest-every",
                NEAREST_EVERY,
                "--report",
                &show(&report),
            ]),
        },
        Stage {
            title: "animate it",
            leaves: animation.clone(),
            words: {
                let frames = format!("0..{}", ANIMATED_FRAMES.min(30 * scale.seconds as usize));
                let [model, motion, animation] = [&model, &motion, &animation].map(|path| show(path));
                words(&[
                    "animate",
                    &model,
                    "--motion",
                    &motion,
                    "--frames",
                    &frames,
                    "--out",
                    &animation,
                    "--overwrite",
                ])
            },
        },
    ]
}

fn simulate(args: &DemoArgs, scale: &Scale, capture: &Path) -> Vec<String> {
    let mut line = words(&["simulate", "--garment", &garment(args), "--motion"]);
    line.extend(
        scale
            .motions
            .iter()
            .chain(scale.test)
            .map(|name| (*name).to_owned()),
    );
    line.extend(words(&["--test", &scale.test.join(",")]));
    line.extend(words(&[
        "--seconds",
        &scale.seconds.to_string(),
        "--out",
        &show(capture),
    ]));
    // Everything else in the folder belongs to an unfinished demo and may be overwritten.
    let has_begun = capture.join("simulation.toml").exists();
    line.push(if has_begun { "--resume" } else { "--overwrite" }.into());
    line
}

fn train(scale: &Scale, capture: &Path, model: &Path) -> Vec<String> {
    let recurrence = |key: &str, value: u32| format!("model.state.displacement.recurrence.{key}={value}");
    let mut line = words(&["train", &show(capture), "--out", &show(model)]);
    if model.with_extension("run").join("config.toml").exists() {
        line.push("--resume".into());
    } else {
        line.extend(words(&[
            "--preset",
            scale.preset,
            "--steps",
            &scale.steps.to_string(),
            "--set",
            &recurrence("steps", scale.prior_steps),
            "--set",
            &recurrence("windows", PRIOR_WINDOWS),
            "--set",
            &recurrence("frames", PRIOR_FRAMES),
            "--set",
            &format!("sizing.sizes={}", scale.field_sizes),
            "--overwrite",
        ]));
    }
    line
}

fn words(line: &[&str]) -> Vec<String> {
    line.iter().map(|word| (*word).to_owned()).collect()
}

/// Quotes a word for a shell. A word that no shell can take stays as it is.
pub(super) fn quoted(word: &str) -> Cow<'_, str> {
    shlex::try_quote(word).unwrap_or(Cow::Borrowed(word))
}

pub(super) fn show(path: &Path) -> String {
    path.display().to_string()
}

impl Stage {
    /// The command's arguments, quoted for a shell.
    pub(super) fn line(&self) -> String {
        let words: Vec<_> = self.words.iter().map(|word| quoted(word)).collect();
        words.join(" ")
    }

    pub(super) fn run(&self) -> Result<()> {
        interrupt::check()?;
        let line = std::iter::once("unic").chain(self.words.iter().map(String::as_str));
        match Args::try_parse_from(line)?.command {
            Command::Simulate(args) => commands::simulate::run(&args),
            Command::Train(args) => commands::train::run(&args),
            Command::Eval(args) => commands::eval::run(&args),
            Command::Animate(args) => commands::animate::run(&args),
            other => anyhow::bail!("{other:?} is no stage of a demo"),
        }
    }
}
