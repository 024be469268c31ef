//! Life of the cloth in free running: wrinkles by wavelength, strain, bending, popping, cloth that
//! passes through itself, and a judge that tries to tell predictions from the truth.
//!
//! RMSE rewards predictions that are too smooth. These measures compare how much a garment wrinkles
//! and moves with how much the truth does.
//!
//! A measured frame is every k-th one, about ten in a second. Wrinkles, strain and bending are read
//! there, self-crossings in every third of them, popping in every frame.

mod band_filter;
mod band_metrics;
mod bending;
mod cloth;
mod control;
mod frame;
mod histogram;
mod judge;
mod living;
mod logistic;
mod record;
mod self_crossings;
mod smoothing;
mod sums;
#[cfg(test)]
mod tests;
mod welded;
mod window;
mod wrinkle_filter;

pub use band_metrics::BandMetrics;
pub use bending::BendingRatio;
pub use control::{ControlError, ControlPredictor};
pub use judge::JudgeReport;
pub(crate) use judge::{ClipWindows, judge};
pub use living::{Liveliness, LivingMeasure};
pub use self_crossings::SelfCrossingShares;
pub(crate) use sums::LifeSums;
pub use wrinkle_filter::WrinkleFilter;

use crate::{error::Result, kinematics::PreparedClip};
use frame::{FrameMeasure, LifeFrame};
use glam::Vec3;
use rayon::prelude::*;
use record::Record;
use self_crossings::SelfCrossings;
use std::ops::Range;
use unic_core::character::Garment;
pub(crate) use window::Window;

/// Rate of the measured frames, Hz. Wrinkles of cloth are slower than half of it.
const RATE_HZ: f32 = 10.0;

/// Interval of the measured frames whose self-crossings are counted. The search is as slow as all
/// other measures of a frame, and folds stay across each other for longer than this.
const SELF_CROSSINGS_EVERY: usize = 3;

/// Measures of life for one garment. It is made once for all clips.
pub(crate) struct LifeMeasure<'a> {
    frames: FrameMeasure<'a>,
}

/// Measures of life of several predictors on one clip.
pub(crate) struct ClipLife {
    /// Interval of the measured frames.
    every: usize,
    truth: Record,
    /// Record of each predictor.
    predicted: Vec<Record>,
}

/// Measures of life of one predictor on one clip.
pub(crate) struct PredictorLife {
    /// Sums behind the metrics.
    pub(crate) sums: LifeSums,
    /// Windows for the judge.
    pub(crate) windows: Vec<Window>,
}

/// Predictions of one predictor: those of the two frames before a chunk, then of the chunk.
pub(crate) type PredictionWindow<'a> = &'a [Vec<Vec3>];

impl<'a> LifeMeasure<'a> {
    /// Prepares the measures for a garment.
    ///
    /// # Errors
    /// A rest mesh whose smoothings cannot be factorised.
    pub(crate) fn new(garment: &'a Garment) -> Result<Self> {
        let frames = FrameMeasure::new(garment)?;
        Ok(Self { frames })
    }

    /// Starts a clip with `predictors` predictors at a frame rate.
    pub(crate) fn start(&self, fps: f32, predictors: usize) -> ClipLife {
        let every = (fps / RATE_HZ).round().max(1.0);
        let lag = (fps / every).round().max(1.0) as usize;
        let signals = band_filter::BANDS * self.frames.weights().len();
        ClipLife {
            every: every as usize,
            truth: Record::new(signals, lag),
            predicted: (0..predictors).map(|_| Record::new(signals, lag)).collect(),
        }
    }

    /// Measures a chunk of frames, which must follow those before. `windows` are the predictions of
    /// each predictor.
    pub(crate) fn add(
        &self,
        life: &mut ClipLife,
        clip: &PreparedClip,
        windows: &[PredictionWindow],
        frames: &Range<usize>,
    ) {
        life.add_second_differences(clip, windows, frames);
        let measured: Vec<usize> = frames.clone().filter(|t| t.is_multiple_of(life.every)).collect();
        if measured.is_empty() {
            return;
        }
        let skinned = |&t: &usize| self.frames.skinned(clip, t);
        let skinned: Vec<_> = measured.par_iter().map(skinned).collect();
        // Shapes are measured in parallel, the truth's first, then those of each predictor, but
        // added in the order of the frames: floating-point sums depend on it.
        let shapes = (windows.len() + 1) * measured.len();
        let measure = |crossings: &mut SelfCrossings, i: usize| {
            let (row, k) = (i / measured.len(), i % measured.len());
            let positions = match row.checked_sub(1) {
                None => clip.captured.garment.frame(measured[k]),
                Some(row) => &windows[row][measured[k] - frames.start + 2],
            };
            let mut frame = self.frames.measure(positions, &skinned[k]);
            if (measured[k] / life.every).is_multiple_of(SELF_CROSSINGS_EVERY) {
                frame.self_crossings = Some(crossings.share(positions));
            }
            frame
        };
        let mut all: Vec<LifeFrame> = (0..shapes)
            .into_par_iter()
            .map_init(|| self.frames.self_crossings().clone(), measure)
            .collect();
        let predicted = all.split_off(measured.len());
        life.add_frames(all, predicted, self.frames.weights());
    }

    /// Ends a clip. Returns the results of each predictor, and the windows of the truth in
    /// `truth_windows`.
    pub(crate) fn finish(&self, life: ClipLife, truth_windows: &mut Vec<Window>) -> Vec<PredictorLife> {
        let ClipLife { truth, predicted, .. } = life;
        let of_predictor = |record: Record| PredictorLife {
            sums: record.sums(&truth, self.frames.weights()),
            windows: record.into_windows(),
        };
        let lives = predicted.into_par_iter().map(of_predictor).collect();
        *truth_windows = truth.into_windows();
        lives
    }
}

impl ClipLife {
    /// Adds the second differences of a chunk: from frame 3 on, because frame 0 is given.
    fn add_second_differences(
        &mut self,
        clip: &PreparedClip,
        windows: &[PredictionWindow],
        frames: &Range<usize>,
    ) {
        for t in frames.clone().filter(|&t| t >= 3) {
            let [now, before, earlier] = [0, 1, 2].map(|back| clip.captured.garment.frame(t - back));
            self.truth.add_second_differences(now, [before, earlier]);
        }
        let records = self.predicted.par_iter_mut().zip(windows);
        records.for_each(|(record, window)| {
            for t in frames.clone().filter(|&t| t >= 3) {
                let slot = t - frames.start + 2;
                record.add_second_differences(&window[slot], [&window[slot - 1], &window[slot - 2]]);
            }
        });
    }

    /// Adds measured frames of the truth and of the predictors, one predictor after another.
    fn add_frames(&mut self, truth: Vec<LifeFrame>, predicted: Vec<LifeFrame>, weights: &[f64]) {
        let mut of_rows = Vec::with_capacity(self.predicted.len());
        let mut predicted = predicted.into_iter();
        for _ in &self.predicted {
            of_rows.push(predicted.by_ref().take(truth.len()).collect::<Vec<_>>());
        }
        let records = self.predicted.par_iter_mut().zip(of_rows);
        records.for_each(|(record, frames)| {
            for (frame, truth) in frames.into_iter().zip(&truth) {
                record.add(frame, Some(truth), weights);
            }
        });
        for frame in truth {
            self.truth.add(frame, None, weights);
        }
    }
}
