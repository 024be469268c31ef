//! Statistics of one second of a garment, by which the judge tells garments apart.

use super::{band_filter::BANDS, frame::LifeFrame};
use std::collections::VecDeque;

/// Number of statistics of each band.
const OF_BAND: usize = 3;
/// Number of statistics of a window: those of the bands, four of strain and one of bending.
const FEATURES: usize = OF_BAND * BANDS + 5;

/// Least amplitude whose logarithm counts, metres. Rounding errors are below it.
const LEAST_AMPLITUDE: f64 = 1e-6;

/// Window of a second with its statistics.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Window {
    /// Number of measured frames from the start of the clip to the end of the window.
    pub(super) end: usize,
    /// Statistics.
    pub(super) features: [f64; FEATURES],
}

/// Returns the statistics of consecutive frames.
///
/// For each band these are the natural logarithms of the RMS amplitude, the standard deviation over
/// time and the RMS difference of consecutive frames, in metres; then the means over frames of 1st
/// and 99th percentile, mean and standard deviation of the strain, and the logarithm of the RMS
/// bending.
pub(super) fn features(frames: &VecDeque<LifeFrame>, weights: &[f64]) -> [f64; FEATURES] {
    let mut features = [0.0; FEATURES];
    for band in 0..BANDS {
        let of_band = band_features(frames, band * weights.len(), weights);
        features[OF_BAND * band..][..OF_BAND].copy_from_slice(&of_band);
    }
    let mean = |of: fn(&LifeFrame) -> f64| frames.iter().map(of).sum::<f64>() / frames.len() as f64;
    features[OF_BAND * BANDS..].copy_from_slice(&[
        mean(|frame| frame.cloth.strains.percentile(0.01)),
        mean(|frame| frame.cloth.strains.percentile(0.99)),
        mean(|frame| frame.cloth.mean_strain),
        mean(|frame| frame.cloth.strain_deviation),
        logarithm(mean(|frame| frame.cloth.squared_bending)),
    ]);
    features
}

/// Returns the statistics of the band whose signals start at index `first`.
fn band_features(frames: &VecDeque<LifeFrame>, first: usize, weights: &[f64]) -> [f64; OF_BAND] {
    let (mut squared, mut deviations, mut differences) = (0.0, 0.0, 0.0);
    for (v, weight) in weights.iter().enumerate() {
        let signal = || frames.iter().map(|frame| f64::from(frame.signals[first + v]));
        let sum: f64 = signal().sum();
        let squares: f64 = signal().map(|x| x * x).sum();
        let changes = signal()
            .zip(signal().skip(1))
            .map(|(before, now)| (now - before).powi(2));
        squared += weight * squares;
        deviations += weight * (squares - sum * sum / frames.len() as f64);
        differences += weight * changes.sum::<f64>();
    }
    let a_frame = 1.0 / (weights.iter().sum::<f64>() * frames.len() as f64);
    [squared, deviations, differences].map(|sum| logarithm(sum * a_frame))
}

/// Returns the natural logarithm of an RMS amplitude, given its square.
fn logarithm(squared: f64) -> f64 {
    // Written so that NaN stays NaN, which `max` would replace.
    if squared < LEAST_AMPLITUDE * LEAST_AMPLITUDE {
        LEAST_AMPLITUDE.ln()
    } else {
        0.5 * squared.ln()
    }
}
