//! `unic demo`: the other commands, one after another.

use crate::{
    args::{Args, Command, DemoArgs, DemoGarment},
    failure::{Interrupted, Usage},
    folder_lock::FolderLock,
    interrupt,
    output::{self, print, say},
    outputs::{Existing, Outputs},
};
use anyhow::{Context, Result};
use clap::{Parser, ValueEnum};
use serde::Serialize;
use std::{
    borrow::Cow,
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

/// What the folder was made with: a demo of another kind does not go on with it.
const RECORD: &str = "demo.toml";
/// Frames of the animation: what one .glb holds.
const ANIMATED_FRAMES: usize = 300;

/// What [`RECORD`] holds.
#[derive(Serialize)]
struct Record {
    garment: String,
    quick: bool,
    #[serde(flatten)]
    scale: Scale,
}

/// How much of everything.
#[derive(Serialize)]
struct Scale {
    motions: &'static [&'static str],
    /// Held out.
    test: &'static [&'static str],
    /// Of each motion.
    seconds: u32,
    preset: &'static str,
    /// Of each fit, and of what its prior remembers.
    steps: [u32; 2],
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
    steps: [100, 300],
};

/// Windows of a step of what the prior remembers, and their frames: on little motion more steps do better than large
/// ones.
const PRIOR_WINDOW: [u32; 2] = [16, 64];

const QUICK: Scale = Scale {
    motions: &["walk_circles", "mixed"],
    test: &["dance"],
    seconds: 5,
    preset: "tiny",
    steps: [60, 40],
};

/// One command with the file that it leaves when it has finished.
struct Stage {
    title: &'static str,
    leaves: PathBuf,
    words: Vec<String>,
}

/// Runs whatever the folder still lacks.
pub(crate) fn run(args: &DemoArgs) -> Result<()> {
    let started = Instant::now();
    Outputs::default()
        .folder(&args.out, [])
        .check(Existing::Resumed)?;
    // Each stage locks its own folder below this one.
    let _lock = FolderLock::hold(&args.out)?;
    open(args)?;
    let stages = stages(args);
    let mut done = Vec::new();
    for (i, stage) in stages.iter().enumerate() {
        let title = format!("[{}/{}] {}", i + 1, stages.len(), stage.title);
        let was_there = stage.leaves.exists();
        let begun = Instant::now();
        match was_there {
            true => say(&format!("{title}: {} is there", stage.leaves.display())),
            false => {
                say(&format!("\n{title}\n  unic {}", stage.line()));
                let _stage = args.json.then(output::stage);
                stage.run().map_err(|error| told_how_to_go_on(error, args))?;
            }
        }
        done.push(Done {
            title: stage.title,
            command: format!("unic {}", stage.line()),
            leaves: &stage.leaves,
            was_there,
            seconds: begun.elapsed().as_secs_f64(),
        });
    }
    close(args, &done, started)
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary<'a> {
    folder: &'a Path,
    /// Time of the whole command.
    seconds: f64,
    stages: &'a [Done<'a>],
}

/// One stage in [`Summary`].
#[derive(Serialize)]
struct Done<'a> {
    title: &'static str,
    command: String,
    leaves: &'a Path,
    /// Made by an earlier run.
    was_there: bool,
    seconds: f64,
}

fn open(args: &DemoArgs) -> Result<()> {
    let out = &args.out;
    let path = out.join(RECORD);
    let record = record(args)?;
    if args.overwrite && path.exists() {
        clear(args)?;
        unic_io::atomic::write(&path, record.as_bytes())?;
    }
    match fs::read_to_string(&path) {
        Ok(before) if before != record => {
            let text = format!(
                "{}: expected a demo of the same garment, motions and training, found another; --overwrite \
                 replaces it",
                path.display()
            );
            Err(Usage(text).into())
        }
        Ok(_) => Ok(()),
        Err(_) => {
            refuse_foreign(args)?;
            fs::create_dir_all(out)
                .with_context(|| format!("{}: the folder cannot be made", out.display()))?;
            Ok(unic_io::atomic::write(&path, record.as_bytes())?)
        }
    }
}

/// Files of other work, which stages would take for their own or replace.
fn refuse_foreign(args: &DemoArgs) -> Result<()> {
    let leaves = stages(args).into_iter().map(|stage| stage.leaves);
    let folders = ["capture", "demo.run"].map(|name| args.out.join(name));
    match leaves.chain(folders).find(|path| path.exists()) {
        None => Ok(()),
        Some(found) => {
            let found = found.display();
            let text = format!("--out: expected an empty folder or a demo's, found {found}");
            Err(Usage(text).into())
        }
    }
}

/// What the folder is a demo of: stages that have finished stay only for the same.
fn record(args: &DemoArgs) -> Result<String> {
    let (garment, quick) = (garment(args), args.quick);
    let scale = scale(args);
    Ok(toml::to_string(&Record {
        garment,
        quick,
        scale,
    })?)
}

/// Removes what the stages leave and what they would resume, so that they run again.
fn clear(args: &DemoArgs) -> Result<()> {
    let leaves = stages(args).into_iter().map(|stage| stage.leaves);
    let begun = ["capture/simulation.toml", "demo.run/config.toml"].map(|name| args.out.join(name));
    for path in leaves.chain(begun).filter(|path| path.exists()) {
        fs::remove_file(&path).with_context(|| format!("{} cannot be removed", path.display()))?;
    }
    Ok(())
}

fn garment(args: &DemoArgs) -> String {
    let value = DemoGarment::to_possible_value(&args.garment);
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

fn scale(args: &DemoArgs) -> Scale {
    if args.quick { QUICK } else { FULL }
}

fn stages(args: &DemoArgs) -> Vec<Stage> {
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
            words: words(&["eval", &show(&model), &show(&capture), "--report", &show(&report)]),
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
    // What else is there is a demo's, of which nothing is finished.
    let is_begun = capture.join("simulation.toml").exists();
    line.push(if is_begun { "--resume" } else { "--overwrite" }.into());
    line
}

fn train(scale: &Scale, capture: &Path, model: &Path) -> Vec<String> {
    let [steps, prior_steps] = scale.steps;
    let recurrence = |key: &str, value: u32| format!("model.state.displacement.recurrence.{key}={value}");
    let mut line = words(&["train", &show(capture), "--out", &show(model)]);
    if model.with_extension("run").join("config.toml").exists() {
        line.push("--resume".into());
    } else {
        line.extend(words(&[
            "--preset",
            scale.preset,
            "--steps",
            &steps.to_string(),
            "--set",
            &recurrence("steps", prior_steps),
            "--set",
            &recurrence("windows", PRIOR_WINDOW[0]),
            "--set",
            &recurrence("frames", PRIOR_WINDOW[1]),
            "--overwrite",
        ]));
    }
    line
}

fn words(line: &[&str]) -> Vec<String> {
    line.iter().map(|word| (*word).to_owned()).collect()
}

/// For a shell; as it is what no shell can take.
fn quoted(word: &str) -> Cow<'_, str> {
    shlex::try_quote(word).unwrap_or(Cow::Borrowed(word))
}

fn show(path: &Path) -> String {
    path.display().to_string()
}

impl Stage {
    /// As a shell takes it.
    fn line(&self) -> String {
        let words: Vec<_> = self.words.iter().map(|word| quoted(word)).collect();
        words.join(" ")
    }

    fn run(&self) -> Result<()> {
        interrupt::check()?;
        let line = std::iter::once("unic").chain(self.words.iter().map(String::as_str));
        match Args::try_parse_from(line)?.command {
            Command::Simulate(args) => super::simulate::run(&args),
            Command::Train(args) => super::train::run(&args),
            Command::Eval(args) => super::eval::run(&args),
            Command::Animate(args) => super::animate::run(&args),
            other => anyhow::bail!("{other:?} is no stage of a demo"),
        }
    }
}

/// What the stage says of itself is right, but the demo's own command is shorter.
fn told_how_to_go_on(error: anyhow::Error, args: &DemoArgs) -> anyhow::Error {
    match error.chain().any(|e| e.is::<Interrupted>()) {
        false => error,
        true => {
            let quick = if args.quick { " --quick" } else { "" };
            let (garment, out) = (garment(args), show(&args.out));
            let out = quoted(&out);
            let text = format!("stopped; `unic demo --garment {garment}{quick} --out {out}` goes on");
            Interrupted(text).into()
        }
    }
}

fn close(args: &DemoArgs, stages: &[Done], started: Instant) -> Result<()> {
    let seconds = started.elapsed().as_secs_f64();
    if args.json {
        return output::print_json(&Summary {
            folder: &args.out,
            seconds,
            stages,
        });
    }
    let out = args.out.display();
    print(&format!(
        "\nDone in {seconds:.0} s.\n  {out}/report.html    open it in a browser\n  {out}/animation.glb  open it in \
         Blender\n  {out}/demo.unic      the model: unic animate {out}/demo.unic --motion YOURS.npz --out walk.glb\n"
    ))
}
