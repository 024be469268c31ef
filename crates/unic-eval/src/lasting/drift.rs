//! Does the error grow with the time since the last known garment?

use super::subject::Subject;
use crate::{
    error::Result,
    metrics::{Squared, ratio},
};
use serde::Serialize;
use std::ops::Range;
use unic_core::{animator::Start, clip::Clip};
use unic_io::{CapturedClip, Split};

/// Seconds of a clip: which are compared, and where the second run starts.
pub(super) struct Window {
    /// Shorter clips are left out.
    pub(super) least: f32,
    pub(super) restart: f32,
    pub(super) compared: Range<f32>,
}

/// The memory of a garment is seconds long: five of them make the second run as good as it gets.
pub(super) const WINDOW: Window = Window {
    least: 65.0,
    restart: 45.0,
    compared: 50.0..60.0,
};

/// A free run of a minute against one that has just started, over the same frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drift {
    /// The clip.
    pub clip: String,
    /// Its split's name: the model may have seen it.
    pub split: &'static str,
    /// RMSE over seconds 50 to 60 of free running from the true garment of frame 0, mm.
    pub from_start_mm: f64,
    /// The same frames, from the true garment at 45 s, mm.
    pub restarted_mm: f64,
    /// The first by the second: 1 is no drift.
    pub ratio: f64,
}

/// All clips that are long enough, of every split.
pub(super) fn measure(subject: &mut Subject, window: &Window) -> Result<Vec<Drift>> {
    let splits = &subject.capture.manifest.splits;
    let mut long = Vec::new();
    for (name, split) in splits.iter() {
        if subject.frames(name)? as f32 >= window.least * subject.fps() {
            long.push((name, split));
        }
    }
    let at = |seconds: f32| (seconds * subject.fps()).round() as usize;
    let a_clip = 2 * at(window.compared.end) - at(window.restart);
    subject.begin("drift", long.len() * a_clip);
    long.into_iter()
        .map(|(name, split)| {
            let captured = subject.capture.load_clip(name)?;
            of_clip(subject, &captured, split, window)
        })
        .collect()
}

fn of_clip(subject: &mut Subject, captured: &CapturedClip, split: Split, window: &Window) -> Result<Drift> {
    let at = |seconds: f32| (seconds * captured.clip.fps).round() as usize;
    let compared = at(window.compared.start) + 1..at(window.compared.end) + 1;
    let mut from = |first: usize| -> Result<Squared> {
        let mut sums = Squared::default();
        let start = Start::Positions(captured.garment.frame(first));
        let clip: &Clip = &captured.clip;
        subject.run(clip, first..compared.end, start, &mut |frame, animator| {
            if compared.contains(&frame) {
                let truth = captured.garment.frame(frame);
                sums.pool(&Squared::between(animator.garment().positions, truth));
            }
        })?;
        Ok(sums)
    };
    let (from_start, restarted) = (from(0)?, from(at(window.restart))?);
    let mm = |sums: &Squared| sums.rmse_mm().unwrap_or(f64::NAN);
    Ok(Drift {
        clip: captured.clip.name.clone(),
        split: split.name(),
        from_start_mm: mm(&from_start),
        restarted_mm: mm(&restarted),
        ratio: ratio([from_start.sum, restarted.sum]),
    })
}
