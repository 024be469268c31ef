//! `unic eval`.

mod gallery;

use crate::{
    args::{EvalArgs, IntersectionName},
    interrupt, model_file,
    output::{print, print_json, say},
    progress::Progress,
};
use anyhow::{Result, anyhow, bail};
use gallery::Gallery;
use serde::Serialize;
use std::{collections::HashSet, path::Path, sync::Arc, time::Instant};
use unic_core::{
    animator::{Animator, Start, StepInput},
    config::IntersectionMode,
    model::Model,
};
use unic_eval::{
    Dump, Evaluation, Event, Mode, ModelPredictor, PRIOR, PredictorError, PriorPredictor, Row, baselines,
    evaluate, training_set,
};
use unic_io::{Capture, Split};

/// Evaluates and prints.
pub(crate) fn run(args: &EvalArgs) -> Result<()> {
    let capture = Capture::open(&args.capture)?;
    let clips = clip_names(args, &capture)?;
    let animator = match &args.model {
        Some(path) => Some(animator(args, path, &capture)?),
        None => None,
    };
    let mut listener = Listener::new(args, &capture, &clips)?;
    let mut rows = rows(&capture, animator.as_ref())?;
    let evaluation = evaluate(&capture, &mut rows, &clips, &mut |event| listener.listen(event))?;
    drop(listener);
    let timing = match &animator {
        Some(animator) => Some(Timing::measure(animator.clone(), &capture, &clips)?),
        None => None,
    };
    show(args, &evaluation, timing)
}

fn clip_names(args: &EvalArgs, capture: &Capture) -> Result<Vec<String>> {
    let split = Split::from(args.split);
    let names = match args.clips.as_slice() {
        [] => capture.clip_names(split).to_vec(),
        named => {
            let mut seen = HashSet::new();
            named.iter().filter(|name| seen.insert(*name)).cloned().collect()
        }
    };
    if names.is_empty() {
        let path = args.capture.join("capture.toml");
        bail!(
            "{}: expected clips in [splits] {}, found none",
            path.display(),
            split.name()
        );
    }
    Ok(names)
}

fn animator(args: &EvalArgs, path: &Path, capture: &Capture) -> Result<Animator> {
    let model = Arc::new(model_file::read(path)?);
    check_fit(&model, path, capture)?;
    let mode = args.intersection.map(|name| match name {
        IntersectionName::Off => IntersectionMode::Off,
        IntersectionName::Paper => model_file::paper_intersection(&model),
    });
    let mut animator = Animator::new(model);
    if let Some(mode) = mode {
        animator.set_intersection(mode);
    }
    Ok(animator)
}

/// The same garment, character and frame rate, by their counts.
fn check_fit(model: &Model, path: &Path, capture: &Capture) -> Result<()> {
    let (garment, skeleton) = (&capture.garment.rest, &capture.character.skeleton);
    let counts = [
        ("garment vertices", garment.vertices.len(), model.vertex_count()),
        ("joints", skeleton.len(), model.character().skeleton.len()),
    ];
    let capture_path = capture.root.display();
    if let Some((what, expected, found)) = counts.into_iter().find(|(_, expected, found)| expected != found) {
        bail!(
            "{}: expected a model of {expected} {what} as in {capture_path}, found {found}",
            path.display()
        );
    }
    let (expected, found) = (capture.manifest.fps, model.config().fps);
    if (expected - found).abs() > 1e-3 * expected {
        bail!(
            "{}: expected a model for {expected} fps as in {capture_path}, found {found}",
            path.display()
        );
    }
    Ok(())
}

fn rows(capture: &Capture, animator: Option<&Animator>) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    if let Some(animator) = animator {
        rows.push(Row::model(ModelPredictor::from_animator(animator.clone())));
        let prior = PriorPredictor::new(animator)?;
        rows.extend(prior.map(|prior| Row::baseline(PRIOR, prior)));
    }
    let set = training_set(capture)?;
    say("fitting the baselines on the training clips");
    rows.extend(baselines::fit(&set));
    Ok(rows)
}

/// What happens while frames are measured.
struct Listener<'a> {
    progress: Progress,
    dump: Option<Dump>,
    gallery: Option<Gallery<'a>>,
    clip: String,
    /// Frames of the clips and modes before.
    before: u64,
}

impl<'a> Listener<'a> {
    fn new(args: &EvalArgs, capture: &'a Capture, clips: &[String]) -> Result<Self> {
        let dump = args.dump.as_ref().map(|folder| {
            Dump::create(folder).map_err(|e| anyhow!("{}: cannot create the folder: {e}", folder.display()))
        });
        let gallery = args
            .pictures
            .as_ref()
            .map(|folder| Gallery::create(capture, folder));
        let frames = |name: &String| Ok(capture.summarise_clip(name)?.pose_frames as u64);
        let total: u64 = clips.iter().map(frames).sum::<Result<u64>>()?;
        Ok(Self {
            dump: dump.transpose()?,
            gallery: gallery.transpose()?,
            progress: Progress::new("measuring", 0, 2 * total),
            clip: String::new(),
            before: 0,
        })
    }

    fn listen(&mut self, event: &Event) -> Result<(), PredictorError> {
        interrupt::check()?;
        match *event {
            Event::ClipStarted { clip, .. } => self.clip = clip.name().to_owned(),
            Event::Progress { mode, done, total } => self.advance(mode, done as u64, total as u64),
            Event::Predicted { .. } | Event::ClipFinished => {}
        }
        if let Some(gallery) = &mut self.gallery {
            gallery.observe(event)?;
        }
        self.dump.as_mut().map_or(Ok(()), |dump| dump.observe(event))
    }

    fn advance(&mut self, mode: Mode, done: u64, total: u64) {
        let clip = &self.clip;
        self.progress.set(self.before + done, || {
            format!("{clip} {}", mode.name().replace('_', " "))
        });
        if done == total {
            self.before += total;
        }
    }
}

/// Time of a frame of the model on its own.
#[derive(Clone, Copy, Debug, Serialize)]
struct Timing {
    /// Median over steps of free running, milliseconds.
    frame_ms: f64,
    /// Threads that a step could use.
    threads: usize,
}

/// Steps that the median is over, if the clip has as many.
const TIMED_STEPS: usize = 300;

impl Timing {
    /// After the evaluation, in which rows compete for the cores.
    fn measure(mut animator: Animator, capture: &Capture, clips: &[String]) -> Result<Self> {
        let Some(name) = clips.first() else {
            bail!("expected clips to time the model on, found none")
        };
        let clip = capture.load_clip(name)?;
        let input = |t: usize| StepInput {
            pose: &clip.clip.poses[t],
            next_pose: clip.clip.poses.get(t + 1),
            ground_height: clip.clip.ground_height,
        };
        animator.reset(&input(0), Start::Positions(clip.garment.frame(0)))?;
        let mut times = Vec::new();
        for t in 1..clip.clip.len().min(TIMED_STEPS + 1) {
            let started = Instant::now();
            animator.step(&input(t))?;
            times.push(started.elapsed().as_secs_f64());
        }
        times.sort_by(f64::total_cmp);
        let median = times.get(times.len() / 2).copied().unwrap_or(f64::NAN);
        Ok(Self {
            frame_ms: 1e3 * median,
            threads: rayon::current_num_threads(),
        })
    }
}

/// The JSON contract: the evaluation's own keys, and `timing` where there is a model.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    evaluation: &'a Evaluation,
    #[serde(skip_serializing_if = "Option::is_none")]
    timing: Option<Timing>,
}

fn show(args: &EvalArgs, evaluation: &Evaluation, timing: Option<Timing>) -> Result<()> {
    if args.json {
        return print_json(&Output { evaluation, timing });
    }
    let timing = timing.map_or_else(String::new, |Timing { frame_ms, threads }| {
        format!("a frame of the model takes {frame_ms:.2} ms (median, threads: {threads})\n")
    });
    print(&format!("{evaluation}{timing}"))
}
