//! Sums behind the measures of life, and the measures.

use super::{
    band_filter::{BANDS, WAVELENGTHS_CM},
    band_metrics::BandMetrics,
    histogram::{Histogram, LengthHistogram},
    record::Moments,
};
use crate::metrics::{Metrics, ratio};

/// Standard deviation or amplitude of a signal that counts as none, metres: rounding of f32
/// positions a few metres from the origin.
pub(super) const LEAST_AMPLITUDE: f64 = 1e-6;

/// RMS bending that counts as none, radians: rounding of f32 positions at edges of millimetres.
pub(super) const LEAST_BENDING: f64 = 1e-4;

/// Sums over any number of clips. Pairs hold the prediction's and the truth's.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LifeSums {
    /// Number of measured frames.
    pub(super) frames: usize,
    /// Sums of each band, the finest first.
    pub(super) bands: [BandSums; BANDS],
    /// Strains of all edges in all frames.
    pub(super) strains: [Histogram; 2],
    /// Sums over frames of the mean squared bending, rad².
    pub(super) squared_bending: [f64; 2],
    /// Self-crossings of the garment.
    pub(super) self_crossings: [CrossingSums; 2],
    /// Second differences over time of all vertices in all frames.
    pub(super) second_differences: [LengthHistogram; 2],
}

/// Self-crossings of one garment over frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct CrossingSums {
    /// Sum of the share of edges that pass through the garment.
    share: f64,
    /// Number of frames.
    frames: usize,
}

impl CrossingSums {
    /// Adds a frame, given the share of edges that pass through the garment.
    pub(super) fn add(&mut self, share: f64) {
        self.share += share;
        self.frames += 1;
    }

    fn pool(&mut self, other: &Self) {
        self.share += other.share;
        self.frames += other.frames;
    }

    /// Returns the mean share, %; none without frames.
    fn percent(self) -> Option<f64> {
        (self.frames > 0).then(|| 100.0 * self.share / self.frames as f64)
    }
}

/// Sums of one band over vertices and frames, weighted by the rest areas of the vertices. Pairs
/// hold the prediction's and the truth's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct BandSums {
    /// Sum of the weights over vertices and frames, m².
    weight: f64,
    /// Squared signals, m⁴.
    squared: [f64; 2],
    /// Squared deviations from the temporal mean of each vertex, m⁴.
    deviations: [f64; 2],
    /// Products of the deviations of prediction and truth, m⁴.
    covariance: f64,
    /// Products of deviations that are a second apart, m⁴.
    lagged: [f64; 2],
    /// Squared deviations with the weight that `lagged` has: as many terms for each vertex, m⁴.
    lagged_deviations: [f64; 2],
}

impl BandSums {
    /// Adds the moments of one vertex over the frames of one clip: of the prediction and the truth,
    /// and the sum of the products of their deviations.
    pub(super) fn add(&mut self, weight: f64, frames: usize, moments: [Moments; 2], covariance: f64) {
        self.weight += weight * frames as f64;
        self.covariance += weight * covariance;
        for (k, moments) in moments.into_iter().enumerate() {
            self.squared[k] += weight * moments.squared;
            self.deviations[k] += weight * moments.deviations;
            if let Some(lagged) = moments.lagged {
                self.lagged[k] += weight * lagged;
                self.lagged_deviations[k] += weight * moments.lagged_share * moments.deviations;
            }
        }
    }

    fn pool(&mut self, other: &Self) {
        self.weight += other.weight;
        self.covariance += other.covariance;
        for k in 0..2 {
            self.squared[k] += other.squared[k];
            self.deviations[k] += other.deviations[k];
            self.lagged[k] += other.lagged[k];
            self.lagged_deviations[k] += other.lagged_deviations[k];
        }
    }

    /// Returns the measures of band `band`. Without vertices or frames they are NaN.
    fn metrics(&self, band: usize) -> BandMetrics {
        let least = self.weight * LEAST_AMPLITUDE * LEAST_AMPLITUDE;
        let counted = |sum: f64| if sum <= least { 0.0 } else { sum };
        let ratio_of = |sums: [f64; 2]| match self.weight > 0.0 {
            true => ratio(sums.map(counted)),
            false => f64::NAN,
        };
        let deviations = self.deviations.map(counted);
        let autocorrelation = |k: usize| {
            let has_signal = self.lagged_deviations[k] != 0.0 && deviations[k] != 0.0;
            has_signal.then(|| self.lagged[k] / self.lagged_deviations[k])
        };
        BandMetrics {
            from_cm: band.checked_sub(1).map_or(0, |finer| WAVELENGTHS_CM[finer]),
            to_cm: WAVELENGTHS_CM.get(band).copied(),
            amplitude_ratio: ratio_of(self.squared),
            living_ratio: ratio_of(deviations),
            // A constant signal has no correlation.
            correlation: (!deviations.contains(&0.0))
                .then(|| self.covariance / (deviations[0] * deviations[1]).sqrt()),
            autocorrelation_1s: autocorrelation(0),
            autocorrelation_1s_truth: autocorrelation(1),
        }
    }
}

impl LifeSums {
    /// Adds the sums of other clips.
    pub(crate) fn pool(&mut self, other: &Self) {
        self.frames += other.frames;
        for (band, more) in self.bands.iter_mut().zip(&other.bands) {
            band.pool(more);
        }
        for k in 0..2 {
            self.strains[k].pool(&other.strains[k]);
            self.squared_bending[k] += other.squared_bending[k];
            self.self_crossings[k].pool(&other.self_crossings[k]);
            self.second_differences[k].pool(&other.second_differences[k]);
        }
    }

    /// Writes the measures of life into metrics.
    pub(crate) fn write(&self, metrics: &mut Metrics) {
        let bands = self.bands.iter().enumerate();
        metrics.bands = bands.map(|(band, sums)| sums.metrics(band)).collect();
        let percent = |k: usize, share: f64| Some(100.0 * self.strains[k].percentile(share));
        metrics.strain_p01_percent = percent(0, 0.01);
        metrics.strain_p99_percent = percent(0, 0.99);
        metrics.strain_p01_percent_truth = percent(1, 0.01);
        metrics.strain_p99_percent_truth = percent(1, 0.99);
        let least = self.frames as f64 * LEAST_BENDING * LEAST_BENDING;
        let bending = |sum: f64| if sum <= least { 0.0 } else { sum };
        metrics.bending_ratio = Some(ratio(self.squared_bending.map(bending)));
        let crossings = self.self_crossings.map(|sums| sums.percent());
        [
            metrics.self_crossing_edges_percent,
            metrics.self_crossing_edges_percent_truth,
        ] = crossings;
        // `ratio` takes squares.
        let popping = |k: usize| self.second_differences[k].percentile(0.99).powi(2);
        metrics.popping_ratio = Some(ratio([popping(0), popping(1)]));
    }
}
