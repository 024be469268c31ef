//! Ridge regression from additive sums, so that folds are sums of clips.

use faer::{Accum, Mat, MatMut, MatRef, Par, Side, linalg::matmul::matmul, prelude::Solve};

/// Sums over pairs of an input x (P numbers) and an output y (Q numbers), in f64.
///
/// Sums of disjoint sets of pairs add up, so leaving a clip out costs a subtraction.
#[derive(Clone, Debug)]
pub struct Moments {
    count: f64,
    inputs: Vec<f64>,
    outputs: Vec<f64>,
    inputs_inputs: Mat<f64>,
    inputs_outputs: Mat<f64>,
}

/// y = Bᵀ x + b.
#[derive(Clone, Debug)]
pub struct LinearMap {
    /// P × Q.
    coefficients: Mat<f64>,
    intercept: Vec<f64>,
}

impl Moments {
    /// Of the rows of `inputs` (N × P, row-major) and `outputs` (N × Q, row-major).
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

    /// Sums over all given sets of pairs, which have the same P and Q; `None` of no set.
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

    /// Minimiser of Σ ‖y − Bᵀx − b‖² + N · strength · ‖B‖², N the number of pairs; the intercept is
    /// free. `None` when the system is singular, which a positive strength rules out.
    pub fn solve(&self, strength: f64) -> Option<LinearMap> {
        let (p, q) = (self.inputs.len(), self.outputs.len());
        let ridge = |i: usize, j: usize| if i == j { self.count * strength } else { 0.0 };
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

fn column_sums(matrix: MatRef<'_, f64>) -> Vec<f64> {
    (matrix.col_iter()).map(|column| column.iter().sum()).collect()
}

impl LinearMap {
    /// Number of outputs Q.
    pub fn outputs(&self) -> usize {
        self.intercept.len()
    }

    /// Contribution of input `i` to output `j` a unit.
    pub fn coefficient(&self, i: usize, j: usize) -> f64 {
        self.coefficients[(i, j)]
    }

    /// The output of one input, which has P numbers.
    pub fn apply(&self, input: &[f64]) -> Vec<f64> {
        self.apply_rows(input)
    }

    /// The outputs (N × Q, row-major) of the rows of `inputs` (N × P, row-major).
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
