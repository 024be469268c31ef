//! Drift: growth of the error with the time since the last known garment.

use super::runner::Runner;
use crate::{
    error::Result,
    metrics::{SquaredErrors, ratio},
};
use serde::Serialize;
use std::ops::Range;
use unic_core::{Start, clip::Clip};
use unic_io::{CapturedClip, Split};

/// Times in a clip at which two runs start and are compared, seconds.
pub(super) struct Window {
    /// Least length of a clip that is measured.
    pub(super) least: f32,
    /// Start of the second run.
    pub(super) restart: f32,
    /// Time over which errors are compared.
    pub(super) compared: Range<f32>,
}

/// Times of the published measure. Garments forget within seconds, so that the second run needs no
/// more than the five seconds before the comparison.
pub(super) const WINDOW: Window = Window {
    least: 65.0,
    restart: 45.0,
    compared: 50.0..60.0,
};

/// Errors of a free run of a minute and of one that starts later, over the same frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drift {
    /// Name of the clip.
    pub clip: String,
    /// Name of the clip's split. A model may have been trained on the clip.
    pub split: &'static str,
    /// RMSE over seconds 50 to 60 of free running from the true garment of frame 0, mm.
    pub from_start_mm: f64,
    /// RMSE over the same frames of a run from the true garment at 45 s, mm.
    pub restarted_mm: f64,
    /// `from_start_mm` / `restarted_mm`. 1 means no drift.
    pub ratio: f64,
}

/// Measures all clips of every split that are long enough.
pub(super) fn measure(runner: &mut Runner, window: &Window) -> Result<Vec<Drift>> {
    let splits = &runner.capture.manifest.splits;
    let mut long = Vec::new();
    for (name, split) in splits.iter() {
        if runner.frames(name)? as f32 >= window.least * runner.fps() {
            long.push((name, split));
        }
    }
    let at = |seconds: f32| (seconds * runner.fps()).round() as usize;
    let frames_per_clip = 2 * at(window.compared.end) - at(window.restart);
    runner.begin_measure("drift", long.len() * frames_per_clip);
    long.into_iter()
        .map(|(name, split)| {
            let captured = runner.capture.load_clip(name)?;
            measure_clip(runner, &captured, split, window)
        })
        .collect()
}

/// Measures one clip.
fn measure_clip(
    runner: &mut Runner,
    captured: &CapturedClip,
    split: Split,
    window: &Window,
) -> Result<Drift> {
    let at = |seconds: f32| (seconds * captured.clip.fps).round() as usize;
    // Second k of free running holds the times in (k, k + 1], as in the drift curve.
    let compared = at(window.compared.start) + 1..at(window.compared.end) + 1;
    let mut error_from = |first: usize| -> Result<SquaredErrors> {
        let mut sums = SquaredErrors::default();
        let start = Start::Positions(captured.garment.frame(first));
        let clip: &Clip = &captured.clip;
        runner.run(clip, first..compared.end, start, &mut |frame, animator| {
            if compared.contains(&frame) {
                let truth = captured.garment.frame(frame);
                sums.pool(&SquaredErrors::between(animator.garment().positions, truth));
            }
        })?;
        Ok(sums)
    };
    let (from_start, restarted) = (error_from(0)?, error_from(at(window.restart))?);
    let mm = |sums: &SquaredErrors| sums.rmse_mm().unwrap_or(f64::NAN);
    Ok(Drift {
        clip: captured.clip.name.clone(),
        split: split.name(),
        from_start_mm: mm(&from_start),
        restarted_mm: mm(&restarted),
        // Both sums have the same number of samples, so that their ratio is that of the mean
        // squares.
        ratio: ratio([from_start.sum, restarted.sum]),
    })
}
