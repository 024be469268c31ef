//! Blend of the linear map and the recurrence, weighted by what they predict of motions left out.

use super::sequence::{Sequence, motion_count};
use unic_core::recurrence::Recurrence;

/// Blends with a smaller gain are noise: share of the squares left by the linear map that the blend
/// removes.
const LEAST_GAIN: f64 = 0.02;

/// Linear map and recurrences on motions that they were not trained on.
pub(super) struct Blend {
    /// Weight of the recurrence, above 0; the linear map has the rest of 1.
    pub(super) recurrence_share: f32,
    /// Blended coefficients of each sequence, T × K.
    pub(super) left_out: Vec<Vec<f32>>,
}

impl Blend {
    /// Finds the weight with the least error. Returns none if the recurrences add nothing
    /// significant.
    pub(super) fn fit(sequences: &[Sequence], recurrent: Vec<Vec<f32>>) -> Option<Self> {
        let gain = Gain::measure(sequences, &recurrent);
        let share = gain.share as f32;
        let mut left_out = recurrent;
        for (s, left_out) in sequences.iter().zip(&mut left_out) {
            let pairs = left_out.iter_mut().zip(&s.linear);
            pairs.for_each(|(x, linear)| *x = linear + share * (*x - linear));
        }
        gain.is_significant().then_some(Self {
            recurrence_share: share,
            left_out,
        })
    }

    /// Scales a recurrence's outputs by its weight.
    pub(super) fn weighted(&self, mut recurrence: Recurrence) -> Recurrence {
        recurrence.head.scale(self.recurrence_share);
        recurrence
    }
}

/// Gain of a blend over the linear map, on motions left out.
#[derive(Clone, Copy, Debug)]
struct Gain {
    /// Weight of the recurrence with the least error, 0 to 1. Each motion is weighted by the
    /// inverse of its squares, so that a lively motion does not decide alone.
    share: f64,
    /// Share of the squares left by the linear map that the blend removes, averaged over motions.
    gain: f64,
    /// Standard error of that average.
    gain_error: f64,
}

impl Gain {
    fn measure(sequences: &[Sequence], recurrent: &[Vec<f32>]) -> Self {
        let clips = by_motion(sequences, recurrent);
        let sum = |of: fn(&Projection) -> f64| clips.iter().map(of).sum::<f64>();
        let (along, squares) = (sum(|c| c.along), sum(|c| c.squares));
        let share = if squares > 0.0 {
            (along / squares).clamp(0.0, 1.0)
        } else {
            0.0
        };
        // (|t|² − |t − share · c|²) / |t|², expanded.
        let gains = || clips.iter().map(|c| share * (2.0 * c.along - share * c.squares));
        let count = clips.len().max(1) as f64;
        let gain = gains().sum::<f64>() / count;
        // A lone motion has no variance: its standard error is zero.
        let variance = gains().map(|g| (g - gain).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        Self {
            share,
            gain,
            gain_error: (variance / count).sqrt(),
        }
    }

    /// Returns whether the gain exceeds both [`LEAST_GAIN`] and its own standard error.
    fn is_significant(&self) -> bool {
        self.gain > LEAST_GAIN.max(self.gain_error)
    }
}

/// Projection of one motion's change c, from the linear map to the recurrence, on the wanted change
/// t, from the linear map to the truth.
struct Projection {
    /// ⟨c, t⟩ / |t|².
    along: f64,
    /// |c|² / |t|².
    squares: f64,
}

/// Sums over the frames of one motion.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// ⟨c, t⟩.
    along: f64,
    /// |c|².
    squares: f64,
    /// |t|².
    size: f64,
}

fn by_motion(sequences: &[Sequence], recurrent: &[Vec<f32>]) -> Vec<Projection> {
    let mut sums = vec![Sums::default(); motion_count(sequences)];
    for (sequence, recurrent) in sequences.iter().zip(recurrent) {
        let sums = &mut sums[sequence.motion_number];
        let pairs = recurrent.iter().zip(&sequence.coefficients);
        for ((x, truth), linear) in pairs.zip(&sequence.linear) {
            let (c, t) = (f64::from(x - linear), f64::from(truth - linear));
            sums.along += c * t;
            sums.squares += c * c;
            sums.size += t * t;
        }
    }
    // A motion that the linear map predicts exactly has nothing left to compare.
    let sized = sums.into_iter().filter(|sums| sums.size > 0.0);
    sized
        .map(|sums| Projection {
            along: sums.along / sums.size,
            squares: sums.squares / sums.size,
        })
        .collect()
}
