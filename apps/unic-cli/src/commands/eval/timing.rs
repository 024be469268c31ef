//! How long a frame takes.

use anyhow::{Result, bail};
use serde::Serialize;
use std::time::Instant;
use unic_core::animator::{Animator, Start, StepInput};
use unic_io::Capture;

/// Time of a frame of the model on its own.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Timing {
    /// Median over steps of free running, milliseconds.
    pub(crate) frame_ms: f64,
    /// Threads that a step could use.
    pub(crate) threads: usize,
}

/// Steps that the median is over, if the clip has as many.
const TIMED_STEPS: usize = 300;

impl Timing {
    /// After the evaluation, in which rows compete for the cores.
    pub(crate) fn measure(mut animator: Animator, capture: &Capture, clips: &[String]) -> Result<Self> {
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

/// Median of the time that steps to the frames 1, 2, ... take, milliseconds.
pub(crate) fn median_of_frames(frames: usize, mut step: impl FnMut(usize) -> Result<()>) -> Result<f64> {
    let mut times = Vec::new();
    for t in 1..frames.min(TIMED_STEPS + 1) {
        let started = Instant::now();
        step(t)?;
        times.push(started.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    Ok(1e3 * times.get(times.len() / 2).copied().unwrap_or(f64::NAN))
}
