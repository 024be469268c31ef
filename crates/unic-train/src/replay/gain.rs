//! Gain of replayed wrinkles: how much of them brings a garment to life on motions left out, at a
//! limited cost of accuracy.

use super::{centre, residuals::Residuals, shapes::WrinkleShapes};
use crate::config::ReplaySettings;
use rayon::prelude::*;

/// Largest gain.
const MOST: f64 = 1.5;

/// Number of frames that a gain is measured in.
const MOST_FRAMES: usize = 1000;

/// Sums of squares and products over frames of motions left out, in m². Wrinkles are about their
/// mean over the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Moments {
    /// True wrinkles.
    truth: f64,
    /// Predicted wrinkles.
    predicted: f64,
    /// Replayed wrinkles.
    played: f64,
    /// Product of predicted and replayed wrinkles.
    product: f64,
    /// Error of the prediction, of all displacements.
    error: f64,
    /// Product of that error and the replayed wrinkles, with their mean.
    along: f64,
    /// Replayed wrinkles with their mean.
    added: f64,
}

/// Returns the gain with which the wrinkles of `played`, frames × R by sequence, bring those of the
/// predictions to the wanted standard deviation, or the largest one within the allowed cost.
pub(super) fn gain(
    settings: &ReplaySettings,
    residuals: Residuals,
    shapes: &WrinkleShapes,
    played: &[Vec<f32>],
) -> f64 {
    let frames = residuals.spread(MOST_FRAMES);
    let of_sequence = |i: usize| Moments::of(residuals, shapes, i, &frames[i], &played[i]);
    // Collected first and summed in order: the result does not depend on the number of threads.
    let all: Vec<Moments> = (0..frames.len()).into_par_iter().map(of_sequence).collect();
    let sums = all.into_iter().fold(Moments::default(), Moments::plus);
    sums.wanted(settings.deviation.into())
        .min(sums.affordable(settings.cost.into()))
}

impl Moments {
    /// Sums over some frames of one sequence.
    fn of(residuals: Residuals, shapes: &WrinkleShapes, i: usize, frames: &[usize], played: &[f32]) -> Self {
        let (vertices, count) = (residuals.garment.rest.vertices.len(), shapes.len());
        let fields: Vec<_> = frames.iter().map(|t| residuals.frame(i, *t)).collect();
        let (truth, residual): (Vec<_>, Vec<_>) = fields.into_iter().map(|f| (f.truth, f.residual)).unzip();
        let mut wrinkles = shapes.filter.wrinkles(&truth);
        let lacking = shapes.filter.wrinkles(&residual);
        let mut predicted: Vec<f32> = wrinkles.iter().zip(&lacking).map(|(u, r)| u - r).collect();
        let played = |t: &usize| &played[t * count..][..count];
        let mut played: Vec<f32> = frames.iter().flat_map(played).copied().collect();
        let heights: Vec<f32> = residual.iter().flat_map(|r| shapes.filter.heights(r)).collect();
        let (along, added) = (dot(&shapes.projected(&heights), &played), dot(&played, &played));
        centre(&mut wrinkles, vertices);
        centre(&mut predicted, vertices);
        centre(&mut played, count);
        Self {
            truth: dot(&wrinkles, &wrinkles),
            predicted: dot(&predicted, &predicted),
            played: dot(&played, &played),
            // Played wrinkles are about their mean, so that of the shapes counts for nothing.
            product: dot(&shapes.projected(&predicted), &played),
            error: residual
                .iter()
                .flatten()
                .map(|r| f64::from(r.length_squared()))
                .sum(),
            along,
            added,
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            truth: self.truth + other.truth,
            predicted: self.predicted + other.predicted,
            played: self.played + other.played,
            product: self.product + other.product,
            error: self.error + other.error,
            along: self.along + other.along,
            added: self.added + other.added,
        }
    }

    /// Gain g, 0 to [`MOST`], with which |predicted + g played| is the wanted share of |truth|.
    fn wanted(&self, share: f64) -> f64 {
        let missing = share * share * self.truth - self.predicted;
        if missing <= 0.0 || self.played <= 0.0 {
            return 0.0;
        }
        let root = (self.product * self.product + self.played * missing).sqrt();
        ((root - self.product) / self.played).clamp(0.0, MOST)
    }

    /// Largest gain with which the root mean square error grows by no more than `cost`, as a share
    /// of itself.
    fn affordable(&self, cost: f64) -> f64 {
        // The root g of |error − g played|² = (1 + cost)² |error|².
        let room = ((1.0 + cost).powi(2) - 1.0) * self.error;
        match self.added > 0.0 {
            true => (self.along + (self.along * self.along + self.added * room).sqrt()) / self.added,
            false => 0.0,
        }
    }
}

/// Inner product, summed in f64.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_fills_the_missing_variance() {
        let sums = |predicted: f64, product: f64| Moments {
            truth: 4.0,
            predicted,
            played: 2.0,
            product,
            ..Moments::default()
        };
        // |a|² + g² |b|² = 4.
        assert!((sums(2.0, 0.0).wanted(1.0) - 1.0).abs() < 1e-12);
        // |a|² + 2 g a·b + g² |b|² = 4.
        let g = sums(1.0, 0.5).wanted(1.0);
        assert!((1.0 + g + 2.0 * g * g - 4.0).abs() < 1e-12);
        assert_eq!(sums(4.0, 0.0).wanted(1.0), 0.0);
        assert_eq!(sums(1.0, 0.0).wanted(0.5), 0.0);
        assert_eq!(sums(0.0, 0.0).wanted(9.0), MOST);
    }

    #[test]
    fn an_affordable_gain_lets_the_error_grow_by_the_cost() {
        for along in [-0.5, 0.0, 0.5] {
            let sums = Moments {
                error: 9.0,
                along,
                added: 2.0,
                ..Moments::default()
            };
            let g = sums.affordable(0.02);
            let grown = 9.0 - 2.0 * g * along + g * g * 2.0;
            assert!((grown.sqrt() / 3.0 - 1.02).abs() < 1e-12, "{along}");
        }
        assert_eq!(Moments::default().affordable(1.0), 0.0);
    }
}
