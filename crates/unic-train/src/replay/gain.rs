//! Gain of replayed wrinkles: how much of them brings a garment to life on motions left out, at a
//! limited cost of accuracy.

use super::{
    residuals::{Residuals, spread},
    shapes::{ROWS, WrinkleShapes},
};
use crate::config::ReplaySettings;
use rayon::prelude::*;

/// Largest gain.
const MOST: f64 = 1.5;

/// Largest number of frames that a gain is measured in.
const MOST_FRAMES: usize = 1000;

/// Number of frames of a sequence that show how its wrinkles vary.
const LEAST_FRAMES: usize = 30;

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
///
/// The prediction is the prior's. The strain projection and the field come after it, and the
/// projection adds some wrinkles.
pub(super) fn gain(
    settings: &ReplaySettings,
    residuals: Residuals,
    shapes: &WrinkleShapes,
    played: &[Vec<f32>],
) -> f64 {
    let frames = spread(&residuals.lengths(), MOST_FRAMES, LEAST_FRAMES);
    let of_sequence = |(i, frames): (usize, Vec<usize>)| {
        let mut sums = Sums::default();
        for piece in frames.chunks(ROWS) {
            sums.add(residuals, shapes, (i, piece), &played[i]);
        }
        sums.moments(frames.len())
    };
    // Collected first and summed in order: the result does not depend on the number of threads.
    let all: Vec<Moments> = frames.into_par_iter().map(of_sequence).collect();
    let moments = all.into_iter().fold(Moments::default(), Moments::plus);
    (moments.wanted(settings.deviation.into())).min(moments.affordable(settings.cost.into()))
}

/// Sums over frames of one sequence, from which its [`Moments`] follow.
#[derive(Default)]
struct Sums {
    truth: Variance,
    predicted: Variance,
    played: Variance,
    /// Wrinkles of the prediction in coefficients of the shapes.
    projected: Variance,
    /// Product of predicted and played wrinkles.
    product: f64,
    error: f64,
    along: f64,
}

/// Sums of numbers over frames.
#[derive(Default)]
struct Variance {
    /// Sum of each number.
    sums: Vec<f64>,
    /// Sum of the squares of all.
    squares: f64,
}

impl Variance {
    /// Adds frames × `count` numbers.
    fn add(&mut self, numbers: &[f32], count: usize) {
        self.sums.resize(count, 0.0);
        for frame in numbers.chunks_exact(count.max(1)) {
            let pairs = self.sums.iter_mut().zip(frame);
            pairs.for_each(|(sum, x)| *sum += f64::from(*x));
        }
        self.squares += dot(numbers, numbers);
    }

    /// Sum of products of the means with those of other numbers, over so many frames.
    fn of_means(&self, other: &Self, frames: usize) -> f64 {
        let products = self.sums.iter().zip(&other.sums).map(|(a, b)| a * b);
        products.sum::<f64>() / frames.max(1) as f64
    }

    /// Sum of squares about the mean of so many frames.
    fn about_mean(&self, frames: usize) -> f64 {
        (self.squares - self.of_means(self, frames)).max(0.0)
    }
}

impl Sums {
    /// Adds some frames of a sequence, in which a replay plays the coefficients `played`.
    fn add(
        &mut self,
        residuals: Residuals,
        shapes: &WrinkleShapes,
        (sequence, frames): (usize, &[usize]),
        played: &[f32],
    ) {
        let (vertices, count) = (residuals.garment.rest.vertices.len(), shapes.len());
        let fields = frames.iter().map(|t| residuals.frame(sequence, *t));
        let (truth, residual): (Vec<_>, Vec<_>) = fields.map(|f| (f.truth, f.residual)).unzip();
        let truth = shapes.filter.wrinkles(&truth);
        let lacking = shapes.filter.wrinkles(&residual);
        let predicted: Vec<f32> = truth.iter().zip(&lacking).map(|(u, r)| u - r).collect();
        let projected = shapes.projected(&predicted);
        let of_frame = |t: &usize| &played[t * count..][..count];
        let played: Vec<f32> = frames.iter().flat_map(of_frame).copied().collect();
        let heights: Vec<f32> = residual.iter().flat_map(|r| shapes.filter.heights(r)).collect();
        self.product += dot(&projected, &played);
        self.along += dot(&shapes.projected(&heights), &played);
        self.error += (residual.iter().flatten())
            .map(|r| f64::from(r.length_squared()))
            .sum::<f64>();
        self.truth.add(&truth, vertices);
        self.predicted.add(&predicted, vertices);
        self.played.add(&played, count);
        self.projected.add(&projected, count);
    }

    /// Moments over so many frames.
    fn moments(&self, frames: usize) -> Moments {
        Moments {
            truth: self.truth.about_mean(frames),
            predicted: self.predicted.about_mean(frames),
            played: self.played.about_mean(frames),
            product: self.product - self.projected.of_means(&self.played, frames),
            error: self.error,
            along: self.along,
            added: self.played.squares,
        }
    }
}

impl Moments {
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
