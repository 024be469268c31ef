//! Logistic regression with a penalty on the squared weights, by Newton's method.

use faer::{Mat, Side, prelude::Solve};

/// Strength of the penalty: half the squared norm of the weights of standardised inputs counts as
/// much as the sum of the losses of all samples.
const STRENGTH: f64 = 1.0;
/// Penalty on the intercept: so small that it only keeps the Hessian regular.
const INTERCEPT_STRENGTH: f64 = 1e-9;
/// Largest number of Newton steps. Ten are usual.
const MOST_STEPS: usize = 50;
/// Largest number of halvings of a step that does not lower the loss.
const MOST_HALVINGS: usize = 30;
/// Length of a step that ends the iteration.
const SHORTEST_STEP: f64 = 1e-9;
/// Standard deviation below which an input counts as constant.
const LEAST_DEVIATION: f64 = 1e-9;

/// Sample of the regression.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample<'a> {
    /// Inputs, D numbers.
    pub(super) inputs: &'a [f64],
    /// Whether the sample belongs to the positive class.
    pub(super) is_positive: bool,
}

/// Fitted classifier. The same samples give the same bits.
#[derive(Clone, Debug)]
pub(super) struct LogisticRegression {
    /// Mean and reciprocal standard deviation of each input in the training samples. The
    /// reciprocal is 0 for a constant input.
    scales: Vec<(f64, f64)>,
    /// Weights of the standardised inputs, then the intercept.
    weights: Vec<f64>,
}

impl LogisticRegression {
    /// Fits samples. Without samples, or with inputs that are not finite, the result decides
    /// nothing: every [score](Self::score) is 0 or NaN.
    pub(super) fn fit(samples: &[Sample]) -> Self {
        let dimension = samples.first().map_or(0, |sample| sample.inputs.len());
        let mut fitted = Self {
            scales: (0..dimension).map(|d| scale(samples, d)).collect(),
            weights: vec![0.0; dimension + 1],
        };
        let rows: Vec<(Vec<f64>, f64)> = samples
            .iter()
            .map(|sample| (fitted.standardised(sample.inputs), f64::from(sample.is_positive)))
            .collect();
        for _ in 0..MOST_STEPS {
            let Some(step) = newton_step(&rows, &fitted.weights) else {
                break;
            };
            let length = step.iter().map(|s| s * s).sum::<f64>().sqrt();
            fitted.weights = descend(&rows, &fitted.weights, &step);
            if length.is_nan() || length < SHORTEST_STEP {
                break;
            }
        }
        fitted
    }

    /// Returns the logarithm of the odds that a sample is positive.
    pub(super) fn score(&self, inputs: &[f64]) -> f64 {
        dot(&self.standardised(inputs), &self.weights)
    }

    /// Returns the standardised inputs, then 1 for the intercept.
    fn standardised(&self, inputs: &[f64]) -> Vec<f64> {
        let scaled = inputs.iter().zip(&self.scales);
        let scaled = scaled.map(|(x, (mean, reciprocal))| (x - mean) * reciprocal);
        scaled.chain([1.0]).collect()
    }
}

/// Returns the mean of input `d` and the reciprocal of its standard deviation.
fn scale(samples: &[Sample], d: usize) -> (f64, f64) {
    let count = samples.len() as f64;
    let mean = samples.iter().map(|s| s.inputs[d]).sum::<f64>() / count;
    let variance = samples.iter().map(|s| (s.inputs[d] - mean).powi(2)).sum::<f64>() / count;
    let deviation = variance.sqrt();
    let reciprocal = if deviation < LEAST_DEVIATION {
        0.0
    } else {
        1.0 / deviation
    };
    (mean, reciprocal)
}

/// Returns the loss: the negative log-likelihood with the penalty.
fn loss(rows: &[(Vec<f64>, f64)], weights: &[f64]) -> f64 {
    let of_row = |(x, target): &(Vec<f64>, f64)| {
        let score = dot(x, weights);
        // ln(1 + exp(score)), written so that exp cannot overflow.
        score.max(0.0) + (-score.abs()).exp().ln_1p() - target * score
    };
    let penalty: f64 = (0..weights.len())
        .map(|i| strength(i, weights) * weights[i] * weights[i])
        .sum();
    rows.iter().map(of_row).sum::<f64>() + 0.5 * penalty
}

/// Returns the Newton step at `weights`. `None` stands for a Hessian that is not finite.
fn newton_step(rows: &[(Vec<f64>, f64)], weights: &[f64]) -> Option<Vec<f64>> {
    let count = weights.len();
    let mut gradient = Mat::from_fn(count, 1, |i, _| strength(i, weights) * weights[i]);
    let mut hessian = Mat::from_fn(
        count,
        count,
        |i, j| if i == j { strength(i, weights) } else { 0.0 },
    );
    for (x, target) in rows {
        let probability = 1.0 / (1.0 + (-dot(x, weights)).exp());
        let curvature = probability * (1.0 - probability);
        for i in 0..count {
            gradient[(i, 0)] += (probability - target) * x[i];
            for j in 0..count {
                hessian[(i, j)] += curvature * x[i] * x[j];
            }
        }
    }
    let step = hessian.llt(Side::Lower).ok()?.solve(gradient);
    Some((0..count).map(|i| -step[(i, 0)]).collect())
}

/// Returns `weights` plus the step, which is halved until the loss does not rise.
fn descend(rows: &[(Vec<f64>, f64)], weights: &[f64], step: &[f64]) -> Vec<f64> {
    let before = loss(rows, weights);
    let at = |share: f64| -> Vec<f64> { weights.iter().zip(step).map(|(w, s)| w + share * s).collect() };
    let shares = (0..MOST_HALVINGS).map(|k| 0.5_f64.powi(k as i32));
    let lower = shares.map(at).find(|next| loss(rows, next) <= before);
    lower.unwrap_or_else(|| weights.to_vec())
}

/// Returns the penalty on weight `i`; the last one is the intercept.
fn strength(i: usize, weights: &[f64]) -> f64 {
    if i + 1 < weights.len() {
        STRENGTH
    } else {
        INTERCEPT_STRENGTH
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(inputs: &[[f64; 2]], positive: impl Fn(usize) -> bool) -> LogisticRegression {
        let sample = |(i, inputs)| Sample {
            inputs,
            is_positive: positive(i),
        };
        let samples: Vec<Sample> = inputs.iter().map(|x| &x[..]).enumerate().map(sample).collect();
        LogisticRegression::fit(&samples)
    }

    #[test]
    fn the_gradient_of_the_loss_is_zero_at_the_fit() {
        let inputs: Vec<[f64; 2]> = (0..40)
            .map(|i| [f64::from(i * 7 % 11), f64::from(i * i % 13)])
            .collect();
        let is_positive = |i: usize| i.is_multiple_of(3) || inputs[i][0] > 8.0;
        let fitted = fit(&inputs, is_positive);
        let rows: Vec<_> = (0..40)
            .map(|i| (fitted.standardised(&inputs[i]), f64::from(is_positive(i))))
            .collect();
        for d in 0..3 {
            let at = |shift: f64| {
                let mut weights = fitted.weights.clone();
                weights[d] += shift;
                loss(&rows, &weights)
            };
            assert!(((at(1e-5) - at(-1e-5)) / 2e-5).abs() < 1e-6, "weight {d}");
        }
    }

    #[test]
    fn separable_classes_are_separated_and_constant_inputs_ignored() {
        let inputs: Vec<[f64; 2]> = (0..20).map(|i| [f64::from(i), 5.0]).collect();
        let fitted = fit(&inputs, |i| i >= 10);
        for (i, x) in inputs.iter().enumerate() {
            assert_eq!(fitted.score(x) > 0.0, i >= 10);
        }
        assert_eq!(fitted.weights[1], 0.0);
    }

    #[test]
    fn inputs_that_are_not_finite_decide_nothing() {
        let fitted = fit(&[[1.0, 2.0], [f64::NAN, 3.0]], |i| i == 0);
        assert!(fitted.score(&[1.0, 2.0]).is_nan());
    }
}
