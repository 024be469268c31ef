//! Running predictors over clips and measuring every frame.

use crate::{
    bench::{Bench, ModeSums, tell},
    error::{Error, Result},
    kinematics::PreparedClip,
    metrics::PooledMetrics,
    predictor::{Mode, Predictor, PredictorError},
    report::{ByMode, Evaluation, Scores},
    training::TrainingSet,
};
use glam::Vec3;
use std::num::NonZeroUsize;
use unic_core::motion::{MotionLayout, MotionSpec, VelocityScheme};
use unic_io::{Capture, Split};

/// Name of the row that stands beside the baselines.
pub const MODEL: &str = "model";

/// Name of the row of a displacement model's prior on its own, first of the baselines.
pub const PRIOR: &str = "prior";

/// A predictor with its name in the table.
pub struct Row {
    /// As in JSON; [`MODEL`] or a baseline's.
    pub name: String,
    /// What is measured.
    pub predictor: Box<dyn Predictor>,
}

impl Row {
    /// The model under evaluation.
    pub fn model(predictor: impl Predictor + 'static) -> Self {
        Self::baseline(MODEL, predictor)
    }

    /// Something to compare it with.
    pub fn baseline(name: &str, predictor: impl Predictor + 'static) -> Self {
        Self {
            name: name.to_owned(),
            predictor: Box::new(predictor),
        }
    }
}

/// What an evaluation tells while it runs; see [`evaluate`].
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A clip has been read.
    ClipStarted {
        /// The clip.
        clip: &'a PreparedClip,
        /// Its place among the clips, from 0.
        index: usize,
        /// Number of clips.
        count: usize,
    },
    /// A row has predicted a frame.
    Predicted {
        /// The row's name.
        row: &'a str,
        /// How it ran.
        mode: Mode,
        /// The frame, from 1.
        frame: usize,
        /// World positions, metres.
        positions: &'a [Vec3],
    },
    /// Frames of the clip are done, in one of the modes.
    Progress {
        /// How the rows ran.
        mode: Mode,
        /// Frames done, frame 0 included.
        done: usize,
        /// Frames of the clip.
        total: usize,
    },
    /// All rows have run over the clip.
    ClipFinished,
}

/// How much of each clip is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Protocol {
    /// How rows run.
    pub modes: &'static [Mode],
    /// Frames that are predicted at most, from frame 1 on; none for all of a clip.
    pub frames: Option<NonZeroUsize>,
}

impl Default for Protocol {
    /// Whole clips, both ways.
    fn default() -> Self {
        Self {
            modes: &[Mode::OneStep, Mode::FreeRunning],
            frames: None,
        }
    }
}

/// Listens to an evaluation: a progress bar, a [`Dump`](crate::Dump). An error ends it.
pub type Observer<'a> = dyn FnMut(&Event) -> std::result::Result<(), PredictorError> + 'a;

/// Measures all rows on the named clips of a capture.
///
/// Clips are read one at a time and frames in chunks, so that memory does not grow with them. The
/// posed body and its trees are made once a frame and mode and shared by the rows. The result has
/// the same bits for any number of threads.
///
/// # Errors
/// No clips, files that cannot be used, predictors or observers that give up.
pub fn evaluate(
    capture: &Capture,
    rows: &mut [Row],
    clips: &[String],
    observe: &mut Observer,
) -> Result<Evaluation> {
    evaluate_sampled(capture, rows, clips, NonZeroUsize::MIN, observe)
}

/// As [`evaluate`], with nearest points looked for in every `nearest_every`th frame alone: errors, jitter
/// and edges are those of all frames, the Hausdorff distance and everything about the body those of a
/// sample, and most of the time is saved.
///
/// # Errors
/// As [`evaluate`].
pub fn evaluate_sampled(
    capture: &Capture,
    rows: &mut [Row],
    clips: &[String],
    nearest_every: NonZeroUsize,
    observe: &mut Observer,
) -> Result<Evaluation> {
    evaluate_by(&Protocol::default(), capture, rows, clips, nearest_every, observe)
}

/// As [`evaluate_sampled`], of as much as a protocol asks for.
///
/// # Errors
/// As [`evaluate`].
pub fn evaluate_by(
    protocol: &Protocol,
    capture: &Capture,
    rows: &mut [Row],
    clips: &[String],
    nearest_every: NonZeroUsize,
    observe: &mut Observer,
) -> Result<Evaluation> {
    if clips.is_empty() {
        let capture = capture.manifest.name.clone();
        return Err(Error::NoClips { capture });
    }
    let spec = motion_spec(capture)?;
    let mut bench = Bench::new(&capture.character, &capture.garment, nearest_every);
    bench.modes = protocol.modes;
    let mut pooled = vec![ModeSums::default(); rows.len()];
    let mut evaluation = Evaluation::default();
    for (index, name) in clips.iter().enumerate() {
        let mut captured = capture.load_clip(name)?;
        if let Some(frames) = protocol.frames {
            // Frame 0 is given.
            captured.clip.poses.truncate(frames.get() + 1);
        }
        let clip = PreparedClip::new(&spec, &capture.character.skeleton, captured);
        let count = clips.len();
        let started = Event::ClipStarted {
            clip: &clip,
            index,
            count,
        };
        tell(&clip, observe, &started)?;
        let sums = bench.run(&clip, rows, observe)?;
        tell(&clip, observe, &Event::ClipFinished)?;
        evaluation.clips.insert(name.clone(), scores(rows, &sums));
        for (all, clip) in pooled.iter_mut().flatten().zip(sums.iter().flatten()) {
            all.pool(clip);
        }
    }
    evaluation.pooled = scores(rows, &pooled);
    Ok(evaluation)
}

/// Reads the clips that baselines are fitted on.
///
/// Clips whose garment is a `.npy` file are mapped and take no memory of their own; garments in
/// npz files are read whole.
///
/// # Errors
/// No training clips, files that cannot be used.
pub fn training_set(capture: &Capture) -> Result<TrainingSet> {
    training_set_of(capture, &motion_spec(capture)?)
}

/// Reads the clips that baselines are fitted on, with motion vectors of a given specification.
///
/// # Errors
/// No training clips, files that cannot be used.
pub fn training_set_of(capture: &Capture, spec: &MotionSpec) -> Result<TrainingSet> {
    let load = |split| -> Result<Vec<PreparedClip>> {
        let names = capture.clip_names(split).iter();
        let prepare = |name: &String| {
            let captured = capture.load_clip(name)?;
            Ok(PreparedClip::new(spec, &capture.character.skeleton, captured))
        };
        names.map(prepare).collect()
    };
    let train = load(Split::Train)?;
    if train.iter().all(|clip| clip.len() < 2) {
        let capture = capture.manifest.name.clone();
        return Err(Error::NoTraining { capture });
    }
    Ok(TrainingSet {
        garment: capture.garment.clone(),
        train,
        validation: load(Split::Validation)?,
    })
}

/// The motion vector that baselines read: heading layout, backward velocities.
fn motion_spec(capture: &Capture) -> Result<MotionSpec> {
    let (layout, velocity) = (MotionLayout::Heading, VelocityScheme::Backward);
    Ok(MotionSpec::new(
        layout,
        velocity,
        capture.contact_joints,
        &capture.character,
    )?)
}

fn scores(rows: &[Row], sums: &[ModeSums]) -> Scores {
    let mut scores = Scores::default();
    for (row, [one_step, free_running]) in rows.iter().zip(sums) {
        let metrics = |s: &PooledMetrics| (s.frames() > 0).then(|| s.metrics());
        let by_mode = ByMode {
            one_step: metrics(one_step),
            free_running: metrics(free_running),
        };
        if row.name == MODEL {
            scores.model = Some(by_mode);
        } else {
            scores.baselines.insert(row.name.clone(), by_mode);
        }
    }
    scores
}
