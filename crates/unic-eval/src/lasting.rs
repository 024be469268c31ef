//! Does a garment last? Drift, random motion, standing still, liveliness, sudden stops, disturbances.
//!
//! An evaluation says how far a prediction is from the truth on whole clips; this says what an hour of
//! play would show: that the error does not grow with time ([`Drift`]), that no motion breaks the garment
//! ([`RandomMotion`]), that what has happened is forgotten ([`Standing`], [`Recovery`]), and that it is alive
//! as the truth is ([`Aliveness`], [`Stop`]). Each number has a target ([`Verdict`]). Everything runs an
//! [`Animator`] as an engine does, on the positions that it shows.
//!
//! With u_i = R_iᵀ (x_i − LBS_i(rest)), the **displacement** of vertex i, in the frame that the skeleton
//! carries it in ([`PointFrame`](unic_core::features::PointFrame)).

mod aliveness;
mod clip_run;
mod drift;
mod hem;
mod random_motion;
mod recovery;
mod report;
mod standing;
mod stops;
mod subject;
#[cfg(test)]
mod tests;

pub use aliveness::Aliveness;
pub use drift::Drift;
pub use random_motion::RandomMotion;
pub use recovery::{Disturbance, Recovery};
pub use report::{Target, Verdict};
pub use standing::Standing;
pub use stops::{Pair, Stop};

use crate::{error::Result, predictor::PredictorError};
use clip_run::ClipRun;
use serde::Serialize;
use subject::Subject;
use unic_core::animator::Animator;
use unic_io::{Capture, Split};

/// What is chosen freely.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Of the random motion.
    pub seed: u64,
    /// Frames of the random motion.
    pub random_frames: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            seed: 1,
            random_frames: 10_000,
        }
    }
}

/// How far a measure has come; see [`measure`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// Which measure.
    pub measure: &'static str,
    /// Frames run.
    pub done: usize,
    /// Frames to run, where clips need no more.
    pub total: usize,
}

/// Listens, once a frame; an error ends everything.
pub type Watcher<'a> = dyn FnMut(&Tick) -> std::result::Result<(), PredictorError> + 'a;

/// All numbers; its JSON form is a public contract. [`Display`](std::fmt::Display) gives Markdown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Lasting {
    /// What is aimed at, beside what is reached.
    pub verdicts: Vec<Verdict>,
    /// One a clip that is long enough.
    pub drift: Vec<Drift>,
    /// Largest displacement in motion that nobody has recorded.
    pub random_motion: RandomMotion,
    /// What is left of it when the character stands.
    pub standing: Standing,
    /// Of each test clip.
    pub aliveness: Vec<Aliveness>,
    /// Of all clips.
    pub stops: Vec<Stop>,
    /// One a kind of disturbance, over the test clips.
    pub recovery: Vec<Recovery>,
}

/// Measures a model on a capture of the same garment and character at the same frame rate.
///
/// The result is the same for any number of threads.
///
/// # Errors
/// Files that cannot be used, a capture of another skeleton or garment, a watcher that gives up.
pub fn measure(
    capture: &Capture,
    animator: Animator,
    settings: &Settings,
    watch: &mut Watcher,
) -> Result<Lasting> {
    let mut subject = Subject::new(capture, animator, watch);
    let drift = drift::measure(&mut subject, &drift::WINDOW)?;
    let (random_motion, ends) = random_motion::measure(&mut subject, settings)?;
    let standing = standing::measure(&mut subject, &ends)?;
    let stops = stops::measure(&mut subject)?;
    let (aliveness, recovery) = test_clips(&mut subject)?;
    let mut lasting = Lasting {
        verdicts: Vec::new(),
        drift,
        random_motion,
        standing,
        aliveness,
        stops,
        recovery,
    };
    lasting.verdicts = report::verdicts(&lasting);
    Ok(lasting)
}

/// One free run of each test clip serves liveliness, and recovery as what is undisturbed.
fn test_clips(subject: &mut Subject) -> Result<(Vec<Aliveness>, Vec<Recovery>)> {
    let names = subject.capture.clip_names(Split::Test);
    let frames = names
        .iter()
        .map(|name| subject.frames(name))
        .sum::<Result<usize>>()?;
    subject.begin("test clips", frames);
    let mut runs = Vec::new();
    for name in names {
        let captured = subject.capture.load_clip(name)?;
        runs.push(ClipRun::record(subject, captured)?);
    }
    let aliveness = runs.iter().filter_map(aliveness::measure).collect();
    let recovery = recovery::measure(subject, &runs)?;
    Ok((aliveness, recovery))
}
