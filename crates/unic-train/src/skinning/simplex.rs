//! Weights of one vertex: a small quadratic program over a simplex.

use std::ops::ControlFlow;

/// Least squares over weights of at least 0 that sum to 1: ½ wᵀ H w − cᵀ w + ½ s |w − given|².
pub(super) struct SimplexProblem<'a> {
    /// H, symmetric.
    pub(super) squares: Vec<Vec<f64>>,
    /// c.
    pub(super) targets: Vec<f64>,
    pub(super) given: &'a [f64],
    /// s.
    pub(super) stiffness: f64,
}

impl SimplexProblem<'_> {
    /// Smallest step that counts.
    const TOLERANCE: f64 = 1e-7;
    /// Largest number of passes over the pairs.
    const PASSES: usize = 500;

    /// Improves feasible weights by moving weight between two joints at a time, which keeps the sum,
    /// until no pair gains (Platt 1998, *Sequential Minimal Optimization*, section 2.1).
    pub(super) fn solve(&self, weights: &mut [f64]) {
        let _ = (0..Self::PASSES).try_for_each(|_| {
            let mut largest = 0.0f64;
            for to in 1..weights.len() {
                for from in 0..to {
                    largest = largest.max(self.exchange(weights, to, from).abs());
                }
            }
            match largest > Self::TOLERANCE {
                true => ControlFlow::Continue(()),
                false => ControlFlow::Break(()),
            }
        });
    }

    /// Moves weight from one joint to another up to the minimum or to a bound. Returns how much.
    fn exchange(&self, weights: &mut [f64], to: usize, from: usize) -> f64 {
        let h = &self.squares;
        let curvature = h[to][to] + h[from][from] - 2.0 * h[to][from] + 2.0 * self.stiffness;
        let slope = self.slope(weights, to) - self.slope(weights, from);
        let step = (-slope / curvature).clamp(-weights[to], weights[from]);
        weights[to] += step;
        weights[from] -= step;
        step
    }

    fn slope(&self, weights: &[f64], joint: usize) -> f64 {
        let products = self.squares[joint].iter().zip(weights);
        let squares: f64 = products.map(|(h, w)| h * w).sum();
        squares - self.targets[joint] + self.stiffness * (weights[joint] - self.given[joint])
    }
}

#[cfg(test)]
mod tests;
