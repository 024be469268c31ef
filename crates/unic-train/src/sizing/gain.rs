//! Gain of a field over its prior on motion left out.

use super::judge::MotionError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Shares of the field's output that are tried, the whole output first.
pub(super) const SHARES: [f32; 4] = [1.0, 0.75, 0.5, 0.25];

/// Gains below this share of the prior's RMSE are noise.
const LEAST_GAIN: f64 = 0.002;

/// Standard errors by which a gain must differ from zero. The best of several shares and candidates
/// is chosen on the same motions, so one would accept noise.
const STANDARD_ERRORS: f64 = 2.0;

/// Gain of a field whose error is not finite. JSON has no infinity.
const DIVERGED: f64 = -1000.0;

/// Gain of a field with its best share, over motions that it has not seen. Each motion counts the
/// same, so that a lively one does not decide alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gain {
    /// Factor of the field's output, above 0 and at most 1.
    pub share: f32,
    /// Part of the prior's RMSE in free running that the field removes, averaged over motions.
    pub mean: f64,
    /// Standard error of that mean.
    pub error: f64,
    /// Gain on the motion that gains least.
    pub least: f64,
}

impl Gain {
    /// Finds the share whose gain has the largest lower bound.
    pub(super) fn best<'a>(errors: impl Iterator<Item = &'a MotionError>) -> Self {
        let mut motions: BTreeMap<usize, [f64; SHARES.len() + 1]> = BTreeMap::new();
        for error in errors {
            let sums = motions.entry(error.motion).or_default();
            sums.iter_mut()
                .zip(error.squares)
                .for_each(|(sum, square)| *sum += square);
        }
        let of_share = |(i, &share): (usize, &f32)| Self::of(share, motions.values().map(|e| relative(e, i)));
        let gains = SHARES.iter().enumerate().map(of_share);
        let better = |best: Self, gain: Self| {
            if gain.lower_bound() > best.lower_bound() {
                gain
            } else {
                best
            }
        };
        gains.reduce(better).unwrap_or(Self::NONE)
    }

    const NONE: Self = Self {
        share: 1.0,
        mean: DIVERGED,
        error: 0.0,
        least: DIVERGED,
    };

    fn of(share: f32, gains: impl Iterator<Item = f64> + Clone) -> Self {
        let count = gains.clone().count().max(1) as f64;
        let mean = gains.clone().sum::<f64>() / count;
        // A lone motion has no variance.
        let variance = gains.clone().map(|g| (g - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        Self {
            share,
            mean,
            error: (variance / count).sqrt(),
            least: gains.fold(f64::INFINITY, f64::min),
        }
    }

    /// The mean less two standard errors.
    pub(super) fn lower_bound(&self) -> f64 {
        self.mean - STANDARD_ERRORS * self.error
    }

    /// Returns whether the field converges and does no harm beyond one standard error. One without an
    /// effect after few steps may gain with more. One that does harm is far from a gain of two
    /// standard errors.
    pub(super) fn may_help(&self) -> bool {
        let noise = LEAST_GAIN.max(self.error);
        self.least > DIVERGED && self.mean >= -noise
    }

    /// Returns whether the gain exceeds both a least value and two standard errors.
    pub fn is_significant(&self) -> bool {
        self.mean > LEAST_GAIN.max(STANDARD_ERRORS * self.error)
    }
}

/// Part of the prior's RMSE that the share with index `i` removes. The prior's is last.
fn relative(squares: &[f64; SHARES.len() + 1], i: usize) -> f64 {
    let prior = squares[SHARES.len()];
    match 1.0 - (squares[i] / prior).sqrt() {
        // A prior without an error leaves nothing to remove.
        _ if prior == 0.0 => 0.0,
        gain if gain.is_finite() => gain,
        _ => DIVERGED,
    }
}
