//! Gains of replayed residuals: how much of them brings the garment to life on motions left out, at
//! a limited cost of accuracy.
//!
//! Only *drift* is replayed, the variation slower than half a hertz. Predictions of the motion
//! nearly have the faster one, and residuals that are faster lower the correlation with the truth.

use crate::{
    config::ReplaySettings,
    recurrence::{Sequence, swings},
};
use std::ops::Range;

/// First coefficient that residuals are added to. The two before carry the garment as a whole,
/// which follows the motion.
const FIRST: usize = 2;

/// Largest gain.
const MOST: f64 = 1.5;

/// A sequence that was animated with the residuals of other motions: drift of its coefficients,
/// frames × K each.
pub(super) struct Fold {
    /// Number K of coefficients.
    outputs: usize,
    truth: Vec<f32>,
    predicted: Vec<f32>,
    played: Vec<f32>,
    /// Truth minus prediction, with all frequencies.
    error: Vec<f32>,
}

impl Fold {
    /// Joins a sequence with its coefficients as predicted without its motion and the residuals
    /// that were replayed, frames × K.
    pub(super) fn new(sequence: &Sequence, predicted: &[f32], played: &[f32], fps: f32) -> Self {
        let outputs = sequence.outputs();
        let drift = |values: &[f32]| drift(values, outputs, fps);
        let pairs = sequence.coefficients.iter().zip(predicted);
        Self {
            outputs,
            truth: drift(&sequence.coefficients),
            predicted: drift(predicted),
            played: drift(played),
            error: pairs.map(|(c, p)| c - p).collect(),
        }
    }
}

/// Gain of each coefficient's residuals.
#[derive(Debug, PartialEq)]
pub(super) struct Gains(Vec<f32>);

impl Gains {
    /// Finds the gains with which predictions have the wanted standard deviation, shortened to the
    /// allowed cost. Returns none if nothing is gained.
    pub(super) fn measure(settings: &ReplaySettings, folds: &[Fold]) -> Option<Self> {
        let outputs = folds.first()?.outputs;
        let mut gains = Self(vec![0.0; outputs]);
        for octave in octaves(outputs) {
            let gain = Moments::of(folds, octave.clone()).gain(settings.deviation.into());
            gains.0[octave].fill(gain as f32);
        }
        let share = gains.affordable(settings.cost.into(), folds) as f32;
        gains.0.iter_mut().for_each(|gain| *gain *= share);
        gains.0.iter().any(|gain| *gain > 0.0).then_some(gains)
    }

    /// Returns the part of residuals, frames × K, that is replayed.
    pub(super) fn scaled(&self, residuals: &[f32], fps: f32) -> Vec<f32> {
        self.added(&drift(residuals, self.0.len(), fps)).collect()
    }

    fn added(&self, drift: &[f32]) -> impl Iterator<Item = f32> {
        drift.iter().zip(self.0.iter().cycle()).map(|(x, gain)| x * gain)
    }

    /// Largest share of the gains, up to 1, with which the root mean square error grows by no more
    /// than `cost`, as a share of itself.
    fn affordable(&self, cost: f64, folds: &[Fold]) -> f64 {
        let (mut error, mut along, mut added) = (0.0, 0.0, 0.0);
        for fold in folds {
            for (e, x) in fold.error.iter().zip(self.added(&fold.played)) {
                let (e, x) = (f64::from(*e), f64::from(x));
                error += e * e;
                along += e * x;
                added += x * x;
            }
        }
        // The root λ of |e − λ x|² = (1 + cost)² |e|².
        let room = ((1.0 + cost).powi(2) - 1.0) * error;
        match added > 0.0 {
            true => ((along + (along * along + added * room).sqrt()) / added).clamp(0.0, 1.0),
            false => 0.0,
        }
    }
}

/// Octaves of the coefficients from [`FIRST`] on: 2 and 3, 4 to 7, 8 to 15. Pooled, because the
/// variance of a single coefficient on little motion is noise.
fn octaves(outputs: usize) -> impl Iterator<Item = Range<usize>> {
    let starts = std::iter::successors(Some(FIRST), |start| Some(2 * start));
    let starts = starts.take_while(move |start| *start < outputs);
    starts.map(move |start| start..(2 * start).min(outputs))
}

/// Sums of squares and products of an octave's drift, over the frames of all folds.
#[derive(Default)]
struct Moments {
    truth: f64,
    predicted: f64,
    played: f64,
    /// Product of prediction and played residual.
    product: f64,
}

impl Moments {
    fn of(folds: &[Fold], octave: Range<usize>) -> Self {
        let mut sums = Self::default();
        for fold in folds {
            let rows = |drift: &'_ Vec<f32>| -> Vec<f32> {
                let rows = drift.chunks_exact(fold.outputs);
                rows.flat_map(|row| &row[octave.clone()]).copied().collect()
            };
            let [truth, predicted, played] = [&fold.truth, &fold.predicted, &fold.played].map(rows);
            for ((c, a), b) in truth.iter().zip(&predicted).zip(&played) {
                let [c, a, b] = [*c, *a, *b].map(f64::from);
                sums.truth += c * c;
                sums.predicted += a * a;
                sums.played += b * b;
                sums.product += a * b;
            }
        }
        sums
    }

    /// Gain g, 0 to [`MOST`], with which |a + g b| is the wanted share of |c|.
    fn gain(&self, wanted: f64) -> f64 {
        let missing = wanted * wanted * self.truth - self.predicted;
        if missing <= 0.0 || self.played <= 0.0 {
            return 0.0;
        }
        let root = (self.product * self.product + self.played * missing).sqrt();
        ((root - self.product) / self.played).clamp(0.0, MOST)
    }
}

/// Variation slower than half a hertz, about its mean: frames × `outputs`.
fn drift(values: &[f32], outputs: usize, fps: f32) -> Vec<f32> {
    let swing = swings(values, outputs, fps);
    let mut drift: Vec<f32> = values.iter().zip(&swing).map(|(x, s)| x - s).collect();
    centre(&mut drift, outputs);
    drift
}

/// Subtracts the mean of each of `outputs` columns.
pub(super) fn centre(values: &mut [f32], outputs: usize) {
    for k in 0..outputs {
        let column = || values.iter().skip(k).step_by(outputs);
        // In f64: a long clip adds many numbers.
        let mean = column().map(|x| f64::from(*x)).sum::<f64>() / column().len().max(1) as f64;
        let column = values.iter_mut().skip(k).step_by(outputs);
        column.for_each(|x| *x -= mean as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    #[test]
    fn a_gain_fills_the_missing_variance() {
        let sums = |predicted: f64, product: f64| Moments {
            truth: 4.0,
            predicted,
            played: 2.0,
            product,
        };
        // |a|² + g² |b|² = 4.
        assert!((sums(2.0, 0.0).gain(1.0) - 1.0).abs() < 1e-12);
        // |a|² + 2 g a·b + g² |b|² = 4.
        let g = sums(1.0, 0.5).gain(1.0);
        assert!((1.0 + g + 2.0 * g * g - 4.0).abs() < 1e-12);
        assert_eq!(sums(4.0, 0.0).gain(1.0), 0.0);
        assert_eq!(sums(1.0, 0.0).gain(0.5), 0.0);
        assert_eq!(sums(0.0, 0.0).gain(9.0), MOST);
    }

    /// Fold of three coefficients whose last one is a slow wave, predicted as zero. The played
    /// residual is the same wave with another phase.
    fn fold(phase: f32) -> Fold {
        let wave = |phase: f32| -> Vec<f32> {
            let number = |t: usize| (0.02 * t as f32 + phase).sin();
            (0..1885).flat_map(|t| [0.0, 0.0, number(t)]).collect()
        };
        let (truth, played) = (wave(0.0), wave(phase));
        Fold {
            outputs: 3,
            predicted: vec![0.0; truth.len()],
            error: truth.clone(),
            truth: drift(&truth, 3, 30.0),
            played: drift(&played, 3, 30.0),
        }
    }

    #[test]
    fn gains_reach_the_wanted_deviation_within_the_cost() {
        let settings = |deviation, cost| ReplaySettings {
            at_inference: true,
            deviation,
            cost,
        };
        // Residuals a quarter of a period late: all of them cost 41 %.
        let late = [fold(FRAC_PI_2)];
        let free = Gains::measure(&settings(0.9, 1.0), &late).unwrap();
        assert!((free.0[2] - 0.9).abs() < 0.02, "{free:?}");
        assert_eq!(free.0[..2], [0.0; 2]);
        let cheap = Gains::measure(&settings(0.9, 0.02), &late).unwrap();
        let growth = (1.0 + f64::from(cheap.0[2]).powi(2)).sqrt();
        assert!((growth - 1.02).abs() < 4e-3, "{growth}");
        // The right residuals lower the error.
        let right = Gains::measure(&settings(0.9, 0.0), &[fold(0.0)]).unwrap();
        assert!((right.0[2] - 0.9).abs() < 0.02, "{right:?}");
        assert_eq!(Gains::measure(&settings(0.0, 1.0), &late), None);
    }
}
