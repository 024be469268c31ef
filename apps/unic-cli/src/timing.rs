//! Measurement of the time that a model takes for a frame.

use anyhow::{Result, bail};
use serde::Serialize;
use std::time::Instant;
use unic_core::{Animator, Start, StepInput};
use unic_io::Capture;

/// Time of a frame of a model.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Timing {
    /// Median over steps of free running, milliseconds.
    pub frame_ms: f64,
    /// Number of threads that a step can use.
    pub threads: usize,
}

/// Number of steps over which the median is taken, if the clip has as many.
const TIMED_STEPS: usize = 300;

impl Timing {
    /// Measures steps on the first of `clips`, from its true first frame on.
    ///
    /// # Errors
    /// No clip, a clip that cannot be read or that the model cannot run on.
    pub fn measure(mut animator: Animator, capture: &Capture, clips: &[String]) -> Result<Self> {
        let Some(name) = clips.first() else {
            bail!("expected clips to time the model on, found none")
        };
        let clip = capture.load_clip(name)?;
        let input = |t: usize| StepInput::of_clip(&clip.clip, t);
        animator.reset(&input(0), Start::Positions(clip.garment.frame(0)))?;
        let frame_ms = median_of_frames(clip.clip.len(), |t| {
            animator.step(&input(t))?;
            Ok(())
        })?;
        Ok(Self {
            frame_ms,
            threads: rayon::current_num_threads(),
        })
    }
}

/// Returns the median time in milliseconds of `step`, called with the frames from 1 on.
///
/// NaN if there are no such frames.
///
/// # Errors
/// The first error of `step`.
pub fn median_of_frames(frames: usize, mut step: impl FnMut(usize) -> Result<()>) -> Result<f64> {
    let mut times = Vec::new();
    for t in 1..frames.min(TIMED_STEPS + 1) {
        let started = Instant::now();
        step(t)?;
        times.push(started.elapsed().as_secs_f64());
    }
    // The median is not moved by the few frames that other work on the machine delays.
    times.sort_by(f64::total_cmp);
    Ok(1e3 * times.get(times.len() / 2).copied().unwrap_or(f64::NAN))
}
