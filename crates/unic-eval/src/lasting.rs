//! Long runs of a model: drift, random motion, standing still, liveliness, sudden stops,
//! disturbances.
//!
//! An evaluation measures the distance of predictions from the truth on whole clips. This module
//! measures what an hour of play shows:
//!
//! - [`Drift`]: the error does not grow with time.
//! - [`RandomMotion`]: no motion breaks the garment.
//! - [`Standing`], [`Recovery`]: the garment forgets past events.
//! - [`Aliveness`], [`Stop`]: the garment moves as much as the true one.
//!
//! Each number has a target ([`Verdict`]). Every measure runs an [`Animator`] as an engine does,
//! and reads the positions that it shows.
//!
//! The **displacement** of vertex i is u_i = R_iᵀ (x_i − LBS_i(rest)), in the coordinate frame in
//! which the skeleton carries the vertex ([`PointFrame`](unic_core::features::PointFrame)).

mod aliveness;
mod clip_run;
mod drift;
mod hem;
mod progress;
mod random_motion;
mod recovery;
mod report;
mod runner;
mod skinned_garment;
mod standing;
mod stops;
#[cfg(test)]
mod tests;

pub use aliveness::Aliveness;
pub use drift::Drift;
pub use progress::{Progress, ProgressObserver};
pub use random_motion::RandomMotion;
pub use recovery::{Disturbance, Recovery};
pub use report::{Target, Verdict};
pub use standing::Standing;
pub use stops::{Comparison, Stop};

use crate::error::Result;
use clip_run::ClipRun;
use runner::Runner;
use serde::Serialize;
use unic_core::Animator;
use unic_io::{Capture, Split};

/// Settings of the random motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Seed of the random motion.
    pub seed: u64,
    /// Number of frames of the random motion.
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

/// Results of all measures. The JSON form is a public contract. [`Display`](std::fmt::Display)
/// writes Markdown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LastingReport {
    /// Main numbers beside their targets.
    pub verdicts: Vec<Verdict>,
    /// Drift in each clip that is long enough.
    pub drift: Vec<Drift>,
    /// Largest displacement in random motion.
    pub random_motion: RandomMotion,
    /// Difference that random motion leaves after the character stands.
    pub standing: Standing,
    /// Liveliness in each test clip.
    pub aliveness: Vec<Aliveness>,
    /// Sudden stops in all clips.
    pub stops: Vec<Stop>,
    /// Recovery from each kind of disturbance, over the test clips.
    pub recovery: Vec<Recovery>,
}

/// Measures a model on a capture of the same garment and character at the same frame rate.
///
/// The result is the same for any number of threads.
///
/// # Errors
/// Files that cannot be used, a capture of another skeleton or garment, and an observer that stops
/// the measures.
pub fn measure(
    capture: &Capture,
    animator: Animator,
    settings: &Settings,
    observe: &mut ProgressObserver,
) -> Result<LastingReport> {
    let mut runner = Runner::new(capture, animator, observe);
    let drift = drift::measure(&mut runner, &drift::WINDOW)?;
    let (random_motion, stopping_points) = random_motion::measure(&mut runner, settings)?;
    let standing = standing::measure(&mut runner, &stopping_points)?;
    let stops = stops::measure(&mut runner)?;
    let (aliveness, recovery) = test_clips(&mut runner)?;
    let mut lasting = LastingReport {
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

/// Measures liveliness and recovery on the test clips. Both use one free run over each clip, which
/// is the undisturbed run for recovery.
fn test_clips(runner: &mut Runner) -> Result<(Vec<Aliveness>, Vec<Recovery>)> {
    let names = runner.capture.clip_names(Split::Test);
    let frames = names
        .iter()
        .map(|name| runner.frames(name))
        .sum::<Result<usize>>()?;
    runner.begin_measure("test clips", frames);
    let mut runs = Vec::new();
    for name in names {
        let captured = runner.capture.load_clip(name)?;
        runs.push(ClipRun::record(runner, captured)?);
    }
    let aliveness = runs.iter().filter_map(aliveness::measure).collect();
    let recovery = recovery::measure(runner, &runs)?;
    Ok((aliveness, recovery))
}
