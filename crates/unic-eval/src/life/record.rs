//! Sums over the frames of one garment on one clip, and windows of a second for the judge.

use super::{
    band_filter::BANDS,
    cloth::strain_histogram,
    frame::LifeFrame,
    histogram::{Histogram, LengthHistogram},
    sums::{BandSums, CrossingSums, LifeSums},
    window::{Window, features},
};
use glam::Vec3;
use std::collections::VecDeque;

/// Record of one garment on one clip, prediction or truth. Its memory does not grow with the clip:
/// it holds sums for each vertex and the frames of the last second.
pub(super) struct Record {
    /// Number of measured frames in a second.
    lag: usize,
    /// Number of measured frames so far.
    frames: usize,
    /// Sums of the signal of each band at each vertex, band after band.
    signals: Vec<SignalSums>,
    /// Last frames, at most `lag`, the oldest first.
    recent: VecDeque<LifeFrame>,
    strains: Histogram,
    /// Sum over frames of the mean squared bending, rad².
    squared_bending: f64,
    /// Sums over the frames in which self-crossings were counted.
    self_crossings: CrossingSums,
    /// Second differences over time of all vertices in all frames.
    second_differences: LengthHistogram,
    /// Statistics of windows of `lag` frames.
    windows: Vec<Window>,
}

/// Sums over time of one signal x at one vertex.
#[derive(Clone, Copy, Debug, Default)]
struct SignalSums {
    /// Σ x_t.
    sum: f64,
    /// Σ x_t².
    squared: f64,
    /// Σ x_t x_{t−lag} from t = lag on.
    lagged: f64,
    /// Σ x_t before t = lag.
    first: f64,
    /// Σ x_t g_t with the signal g of the truth. Zero in the truth's own record.
    with_truth: f64,
}

impl Record {
    /// Starts with no frames. `signals` is the number of signals of a frame, `lag` the number of
    /// measured frames in a second.
    pub(super) fn new(signals: usize, lag: usize) -> Self {
        Self {
            lag,
            frames: 0,
            signals: vec![SignalSums::default(); signals],
            recent: VecDeque::with_capacity(lag + 1),
            strains: strain_histogram(),
            squared_bending: 0.0,
            self_crossings: CrossingSums::default(),
            second_differences: LengthHistogram::new(),
            windows: Vec::new(),
        }
    }

    /// Adds the next measured frame. `truth` is the true frame, for predictions.
    pub(super) fn add(&mut self, frame: LifeFrame, truth: Option<&LifeFrame>, weights: &[f64]) {
        let oldest = self.recent.front().filter(|_| self.recent.len() == self.lag);
        for (i, (sums, &x)) in self.signals.iter_mut().zip(&frame.signals).enumerate() {
            let x = f64::from(x);
            sums.sum += x;
            sums.squared += x * x;
            match oldest {
                Some(oldest) => sums.lagged += x * f64::from(oldest.signals[i]),
                None => sums.first += x,
            }
            if let Some(truth) = truth {
                sums.with_truth += x * f64::from(truth.signals[i]);
            }
        }
        self.strains.pool(&frame.cloth.strains);
        self.squared_bending += frame.cloth.squared_bending;
        if let Some(share) = frame.self_crossings {
            self.self_crossings.add(share);
        }
        self.frames += 1;
        if self.recent.len() == self.lag {
            self.recent.pop_front();
        }
        self.recent.push_back(frame);
        // Windows overlap by half.
        let hop = (self.lag / 2).max(1);
        if self.recent.len() == self.lag && (self.frames - self.lag).is_multiple_of(hop) {
            self.windows.push(Window {
                end: self.frames,
                features: features(&self.recent, weights),
            });
        }
    }

    /// Adds the second differences of all vertices, given the positions of a frame and of the two
    /// frames before it.
    pub(super) fn add_second_differences(&mut self, now: &[Vec3], [before, earlier]: [&[Vec3]; 2]) {
        for ((x, y), z) in now.iter().zip(before).zip(earlier) {
            // In f64, because far from the origin f32 rounds the difference of large numbers.
            let difference = x.as_dvec3() - 2.0 * y.as_dvec3() + z.as_dvec3();
            self.second_differences.add_squared(difference.length_squared());
        }
    }

    /// Returns the windows of a second, in their order.
    pub(super) fn into_windows(self) -> Vec<Window> {
        self.windows
    }

    /// Returns the sums of this prediction beside those of the truth.
    pub(super) fn sums(&self, truth: &Self, weights: &[f64]) -> LifeSums {
        let mut bands = [BandSums::default(); BANDS];
        let pairs = self.signals.chunks(weights.len().max(1));
        let pairs = pairs.zip(truth.signals.chunks(weights.len().max(1)));
        for (band, (sums, (predicted, true_))) in bands.iter_mut().zip(pairs).enumerate() {
            let first = band * weights.len();
            for (v, &weight) in weights.iter().enumerate() {
                let moments = [(self, &predicted[v]), (truth, &true_[v])]
                    .map(|(record, signal)| record.moments(signal, first + v));
                let covariance =
                    predicted[v].with_truth - predicted[v].sum * true_[v].sum / self.frames as f64;
                sums.add(weight, self.frames, moments, covariance);
            }
        }
        LifeSums {
            frames: self.frames,
            bands,
            strains: [self, truth].map(|record| record.strains.clone()),
            squared_bending: [self, truth].map(|record| record.squared_bending),
            self_crossings: [self, truth].map(|record| record.self_crossings),
            second_differences: [self, truth].map(|record| record.second_differences.clone()),
        }
    }

    /// Returns the moments of signal `index` about its own mean over time.
    fn moments(&self, signal: &SignalSums, index: usize) -> Moments {
        let count = self.frames as f64;
        let mean = signal.sum / count;
        let squared_deviations = signal.squared - signal.sum * mean;
        let pairs = self.frames.saturating_sub(self.lag) as f64;
        // A mean over less than two seconds says little about the second before.
        let has_lag = self.frames >= 2 * self.lag;
        let last: f64 = self
            .recent
            .iter()
            .map(|frame| f64::from(frame.signals[index]))
            .sum();
        let ends = 2.0 * signal.sum - signal.first - last;
        Moments {
            squared: signal.squared,
            // Rounding may leave a sum below zero. `max` would replace NaN by 0.
            deviations: if squared_deviations < 0.0 {
                0.0
            } else {
                squared_deviations
            },
            lagged: has_lag.then_some(signal.lagged - mean * ends + pairs * mean * mean),
            lagged_share: pairs / count,
        }
    }
}

/// Moments over time of one signal x with the mean m at one vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    /// Σ x².
    pub(super) squared: f64,
    /// Σ (x − m)².
    pub(super) deviations: f64,
    /// Σ (x_t − m) (x_{t−lag} − m). `None` in clips shorter than two seconds.
    pub(super) lagged: Option<f64>,
    /// Number of terms of `lagged` by the number of frames.
    pub(super) lagged_share: f64,
}
