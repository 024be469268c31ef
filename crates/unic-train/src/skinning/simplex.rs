//! Weights of one vertex: a small quadratic program over a simplex.

/// Least squares over weights of at least 0 that sum to 1: ½ wᵀ H w − cᵀ w + ½ s |w − given|².
pub(super) struct SimplexProblem<'a> {
    /// Symmetric matrix H.
    pub(super) squares: Vec<Vec<f64>>,
    /// Vector c.
    pub(super) targets: Vec<f64>,
    /// Weights that the last term pulls to.
    pub(super) given: &'a [f64],
    /// Factor s of the last term, above 0.
    pub(super) stiffness: f64,
}

impl SimplexProblem<'_> {
    /// Smallest exchange that counts.
    const TOLERANCE: f64 = 1e-6;
    /// Largest number of passes over the pairs.
    const PASSES: usize = 200;

    /// Improves feasible weights by moving weight between two joints at a time, which keeps the sum,
    /// until no pair gains (Platt 1998, *Sequential Minimal Optimization*, section 2.1).
    pub(super) fn solve(&self, weights: &mut [f64]) {
        let mut slopes = self.slopes(weights);
        for _ in 0..Self::PASSES {
            let mut largest = 0.0f64;
            for to in 1..weights.len() {
                for from in 0..to {
                    largest = largest.max(self.exchange(weights, &mut slopes, to, from).abs());
                }
            }
            if largest <= Self::TOLERANCE {
                break;
            }
        }
    }

    /// Moves weight from one joint to another up to the minimum or to 0. Returns how much.
    fn exchange(&self, weights: &mut [f64], slopes: &mut [f64], to: usize, from: usize) -> f64 {
        let h = &self.squares;
        let curvature = h[to][to] + h[from][from] - 2.0 * h[to][from] + 2.0 * self.stiffness;
        let wanted = (slopes[from] - slopes[to]) / curvature;
        let step = wanted.clamp(-weights[to], weights[from]);
        weights[to] += step;
        weights[from] -= step;
        for (slope, (to, from)) in slopes.iter_mut().zip(h[to].iter().zip(&h[from])) {
            *slope += step * (to - from);
        }
        slopes[to] += step * self.stiffness;
        slopes[from] -= step * self.stiffness;
        step
    }

    /// Gradient of the sum.
    fn slopes(&self, weights: &[f64]) -> Vec<f64> {
        let slope = |joint: usize| {
            let products = self.squares[joint].iter().zip(weights);
            let squares: f64 = products.map(|(h, w)| h * w).sum();
            squares - self.targets[joint] + self.stiffness * (weights[joint] - self.given[joint])
        };
        (0..weights.len()).map(slope).collect()
    }
}

#[cfg(test)]
mod tests;
