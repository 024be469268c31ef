//! Ridge regression from sums over pairs of inputs and outputs. Sums of clips add up to folds of a
//! cross-validation.

use faer::{Accum, Mat, MatMut, MatRef, Par, Side, linalg::matmul::matmul, prelude::Solve};

/// Sums over pairs of an input x (P numbers) and an output y (Q numbers), in f64.
///
/// Sums of disjoint sets of pairs add up, so that a fold of a cross-validation needs no pass over
/// the pairs.
#[derive(Clone, Debug)]
pub struct Moments {
    /// Number of pairs N.
    count: f64,
    /// Σ x.
    inputs: Vec<f64>,
    /// Σ y.
    outputs: Vec<f64>,
    /// Σ x xᵀ, P × P.
    inputs_inputs: Mat<f64>,
    /// Σ x yᵀ, P × Q.
    inputs_outputs: Mat<f64>,
}

/// Affine map y = Bᵀ x + b.
#[derive(Clone, Debug)]
pub struct LinearMap {
    /// B, P × Q.
    coefficients: Mat<f64>,
    /// b, Q numbers.
    intercept: Vec<f64>,
}

impl Moments {
    /// Sums over the N = `count` rows of `inputs` (N × P, row-major) and `outputs` (N × Q,
    /// row-major).
    pub fn new(inputs: &[f64], outputs: &[f64], count: usize) -> Self {
        let (p, q) = (inputs.len() / count.max(1), outputs.len() / count.max(1));
        let x = MatRef::from_row_major_slice(inputs, count, p);
        let y = MatRef::from_row_major_slice(outputs, count, q);
        let mut moments = Self {
            count: count as f64,
            inputs: column_sums(x),
            outputs: column_sums(y),
            inputs_inputs: Mat::zeros(p, p),
            inputs_outputs: Mat::zeros(p, q),
        };
        for (into, with) in [(&mut moments.inputs_inputs, x), (&mut moments.inputs_outputs, y)] {
            matmul(into.as_mut(), Accum::Add, x.transpose(), with, 1.0, Par::Seq);
        }
        moments
    }

    /// Adds up the sums of disjoint sets of pairs, which have the same P and Q. Returns `None`
    /// without any set.
    pub fn pooled<'a>(mut sets: impl Iterator<Item = &'a Self>) -> Option<Self> {
        let mut all = sets.next()?.clone();
        for set in sets {
            all.count += set.count;
            all.inputs.iter_mut().zip(&set.inputs).for_each(|(a, b)| *a += b);
            all.outputs
                .iter_mut()
                .zip(&set.outputs)
                .for_each(|(a, b)| *a += b);
            all.inputs_inputs += &set.inputs_inputs;
            all.inputs_outputs += &set.inputs_outputs;
        }
        Some(all)
    }

    /// Returns the minimiser of Σ ‖y − Bᵀx − b‖² + N · strength · ‖B‖². The intercept b is not
    /// penalised. `None` stands for a singular system, which a positive strength rules out.
    pub fn solve(&self, strength: f64) -> Option<LinearMap> {
        let (p, q) = (self.inputs.len(), self.outputs.len());
        let ridge = |i: usize, j: usize| if i == j { self.count * strength } else { 0.0 };
        // Products of means are subtracted, which removes b from the system. The difference cancels
        // where means are large beside deviations: f64 and standardised inputs leave enough digits.
        let covariance = Mat::from_fn(p, p, |i, j| {
            let product = self.inputs[i] * self.inputs[j] / self.count;
            self.inputs_inputs[(i, j)] - product + ridge(i, j)
        });
        let cross = Mat::from_fn(p, q, |i, j| {
            self.inputs_outputs[(i, j)] - self.inputs[i] * self.outputs[j] / self.count
        });
        let coefficients = covariance.llt(Side::Lower).ok()?.solve(cross);
        let explained = |j| (0..p).map(|i| coefficients[(i, j)] * self.inputs[i]).sum::<f64>();
        let intercept = |j: usize| (self.outputs[j] - explained(j)) / self.count;
        Some(LinearMap {
            intercept: (0..q).map(intercept).collect(),
            coefficients,
        })
    }
}

/// Returns the sum of each column.
fn column_sums(matrix: MatRef<'_, f64>) -> Vec<f64> {
    (matrix.col_iter()).map(|column| column.iter().sum()).collect()
}

impl LinearMap {
    /// Returns the number of outputs Q.
    pub fn outputs(&self) -> usize {
        self.intercept.len()
    }

    /// Returns the coefficient of input `i` in output `j`.
    pub fn coefficient(&self, i: usize, j: usize) -> f64 {
        self.coefficients[(i, j)]
    }

    /// Returns the output (Q numbers) of one input (P numbers).
    pub fn apply(&self, input: &[f64]) -> Vec<f64> {
        self.apply_rows(input)
    }

    /// Returns the outputs (N × Q, row-major) of the rows of `inputs` (N × P, row-major).
    pub fn apply_rows(&self, inputs: &[f64]) -> Vec<f64> {
        let (p, q) = (self.coefficients.nrows(), self.outputs());
        let rows = inputs.len() / p.max(1);
        let mut outputs = self.intercept.repeat(rows);
        let into = MatMut::from_row_major_slice_mut(&mut outputs, rows, q);
        let inputs = MatRef::from_row_major_slice(&inputs[..rows * p], rows, p);
        matmul(into, Accum::Add, inputs, &self.coefficients, 1.0, Par::Seq);
        outputs
    }
}
