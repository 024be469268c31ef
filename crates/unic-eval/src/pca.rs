//! Principal component analysis for far more coordinates than samples, by the Gram matrix of the
//! samples.

use faer::{Accum, Mat, MatMut, MatRef, Par, Side, linalg::matmul::matmul};
use rayon::prelude::*;
use std::ops::Range;

/// Number of columns in memory at once in f64: 6 KiB for each sample.
const BLOCK_COLUMNS: usize = 768;
/// Number of rows of the Gram matrix that one task fills.
const STRIP_ROWS: usize = 64;
/// Least variance of a component, as a share of the largest. Smaller ones are rounding errors.
const LEAST_VARIANCE: f64 = 1e-12;

/// Matrix of samples × coordinates that is read piece by piece and need not fit into memory.
pub trait SampleMatrix: Sync {
    /// Returns the number of samples T.
    fn rows(&self) -> usize;
    /// Returns the number of coordinates D.
    fn columns(&self) -> usize;
    /// Writes the coordinates `columns` of sample `row` into `out`, which has as many entries.
    fn read(&self, row: usize, columns: Range<usize>, out: &mut [f32]);
}

/// Mean and leading orthonormal directions of a set of samples.
///
/// D may be large, because the Gram matrix is T × T. The matrix and its eigenvalues are computed in
/// f64. The result has the same bits for any number of threads.
#[derive(Clone, Debug)]
pub struct PrincipalComponents {
    mean: Vec<f32>,
    /// K × D, row-major, orthonormal rows by descending variance.
    components: Vec<f32>,
    variances: Vec<f64>,
}

impl PrincipalComponents {
    /// Computes the first `count` components, or fewer where the samples span fewer dimensions.
    pub fn fit(samples: &(impl SampleMatrix + ?Sized), count: usize) -> Self {
        let mean = mean(samples);
        let (scale, variances) = leading_samples(&gram(samples, &mean), count);
        let components = combine(samples, &mean, &scale);
        Self {
            mean,
            components,
            variances,
        }
    }

    /// Returns the number of components K.
    pub fn len(&self) -> usize {
        self.variances.len()
    }

    /// Returns whether there is no component, because all samples are equal.
    pub fn is_empty(&self) -> bool {
        self.variances.is_empty()
    }

    /// Returns the mean of the samples, D numbers.
    pub fn mean(&self) -> &[f32] {
        &self.mean
    }

    /// Returns component `k`, a unit vector of D numbers.
    pub fn component(&self, k: usize) -> &[f32] {
        let columns = self.mean.len();
        &self.components[k * columns..(k + 1) * columns]
    }

    /// Returns the variance of the samples along each component, in descending order.
    pub fn variances(&self) -> &[f64] {
        &self.variances
    }

    /// Returns the coordinates of a sample along the components, K numbers.
    pub fn project(&self, sample: &[f32]) -> Vec<f64> {
        self.project_rows(sample)
    }

    /// Returns the coordinates (N × K, row-major) of the rows of `samples` (N × D, row-major).
    pub fn project_rows(&self, samples: &[f32]) -> Vec<f64> {
        let (columns, count) = (self.mean.len(), self.len());
        let rows = samples.len() / columns.max(1);
        let mut coordinates = vec![0.0; rows * count];
        for range in blocks(columns) {
            // Blocks bound the memory of the f64 copies.
            let centred = Mat::from_fn(rows, range.len(), |r, c| {
                let column = range.start + c;
                f64::from(samples[r * columns + column] - self.mean[column])
            });
            let along = Mat::from_fn(range.len(), count, |c, k| {
                f64::from(self.components[k * columns + range.start + c])
            });
            let into = MatMut::from_row_major_slice_mut(&mut coordinates, rows, count);
            matmul(into, Accum::Add, &centred, &along, 1.0, Par::Seq);
        }
        coordinates
    }

    /// Computes the sample with the given coordinates: mean + Σ z_k component_k.
    pub fn reconstruct(&self, coordinates: &[f64], sample: &mut Vec<f32>) {
        sample.clone_from(&self.mean);
        for (k, &z) in coordinates.iter().enumerate().take(self.len()) {
            // Reconstruction is in f32: its result is f32, and errors of 1e-7 of a metre do not
            // matter.
            let z = z as f32;
            for (x, c) in sample.iter_mut().zip(self.component(k)) {
                *x += z * c;
            }
        }
    }
}

/// Computes the mean of the rows, summed in f64 in the order of the rows.
pub fn mean(samples: &(impl SampleMatrix + ?Sized)) -> Vec<f32> {
    let rows = samples.rows();
    let block_mean = |columns: Range<usize>| {
        let mut row = vec![0.0_f32; columns.len()];
        let mut sum = vec![0.0_f64; columns.len()];
        for r in 0..rows {
            samples.read(r, columns.clone(), &mut row);
            sum.iter_mut().zip(&row).for_each(|(s, x)| *s += f64::from(*x));
        }
        sum.into_iter().map(move |s| (s / rows.max(1) as f64) as f32)
    };
    let blocks: Vec<_> = blocks(samples.columns())
        .into_par_iter()
        .map(block_mean)
        .collect();
    blocks.into_iter().flatten().collect()
}

/// Splits the columns into blocks of [`BLOCK_COLUMNS`].
fn blocks(columns: usize) -> Vec<Range<usize>> {
    (0..columns.div_ceil(BLOCK_COLUMNS))
        .map(|b| b * BLOCK_COLUMNS..((b + 1) * BLOCK_COLUMNS).min(columns))
        .collect()
}

/// Reads a block of columns of all samples and subtracts the mean. Row-major.
fn centred(samples: &(impl SampleMatrix + ?Sized), mean: &[f32], columns: &Range<usize>) -> Vec<f64> {
    let width = columns.len();
    let mut block = vec![0.0_f64; samples.rows() * width];
    let rows = block.par_chunks_exact_mut(width).enumerate();
    rows.for_each_init(
        || vec![0.0_f32; width],
        |row, (r, out)| {
            samples.read(r, columns.clone(), row);
            for ((x, m), out) in row.iter().zip(&mean[columns.clone()]).zip(out) {
                *out = f64::from(*x) - f64::from(*m);
            }
        },
    );
    block
}

/// Computes the inner products of the centred samples, divided by their number. Only the lower
/// triangle is complete.
fn gram(samples: &(impl SampleMatrix + ?Sized), mean: &[f32]) -> Mat<f64> {
    let rows = samples.rows();
    let mut gram = vec![0.0_f64; rows * rows];
    // Blocks are added one after another, and each entry is one task's: the order of summation does
    // not depend on threads.
    for columns in blocks(samples.columns()) {
        let width = columns.len();
        let block = centred(samples, mean, &columns);
        let strips = gram.par_chunks_mut(STRIP_ROWS * rows.max(1)).enumerate();
        strips.for_each(|(s, strip)| {
            let first = s * STRIP_ROWS;
            let height = strip.len() / rows;
            let last = first + height;
            let own = MatRef::from_row_major_slice(&block[first * width..last * width], height, width);
            let all = MatRef::from_row_major_slice(&block[..last * width], last, width);
            let strip = MatMut::from_row_major_slice_mut(strip, height, rows);
            let below = strip.subcols_mut(0, last);
            // Only columns up to the diagonal are computed, which is half of the work.
            let weight = 1.0 / rows as f64;
            matmul(below, Accum::Add, own, all.transpose(), weight, Par::Seq);
        });
    }
    MatRef::from_row_major_slice(&gram, rows, rows).to_owned()
}

/// Returns the weights of the samples in each component (T × K), and the variances of the
/// components.
///
/// With G = X Xᵀ / T = V Λ Vᵀ the components are the rows of (T Λ)^{-1/2} Vᵀ X.
fn leading_samples(gram: &Mat<f64>, count: usize) -> (Mat<f64>, Vec<f64>) {
    let rows = gram.nrows();
    let Ok(eigen) = gram.self_adjoint_eigen(Side::Lower) else {
        return (Mat::zeros(rows, 0), Vec::new());
    };
    // The solver gives eigenvalues in ascending order.
    let value = |k: usize| eigen.S()[rows - 1 - k];
    let kept = (0..rows.min(count))
        // Rounding makes eigenvalues of dependent samples tiny or negative instead of 0.
        .take_while(|&k| value(k) > value(0).max(0.0) * LEAST_VARIANCE && value(k) > 0.0)
        .count();
    // Dividing by the square root of T λ makes the components unit vectors.
    let weights = Mat::from_fn(rows, kept, |t, k| {
        eigen.U()[(t, rows - 1 - k)] / (rows as f64 * value(k)).sqrt()
    });
    (weights, (0..kept).map(value).collect())
}

/// Combines the samples to components: weightsᵀ · X, K × D row-major.
fn combine(samples: &(impl SampleMatrix + ?Sized), mean: &[f32], weights: &Mat<f64>) -> Vec<f32> {
    let (columns, count) = (samples.columns(), weights.ncols());
    let mut components = vec![0.0_f32; count * columns];
    for range in blocks(columns) {
        let block = centred(samples, mean, &range);
        let block = MatRef::from_row_major_slice(&block, samples.rows(), range.len());
        let piece = weights.transpose() * block;
        for k in 0..count {
            let row = &mut components[k * columns..][range.clone()];
            row.iter_mut()
                .enumerate()
                .for_each(|(c, out)| *out = piece[(k, c)] as f32);
        }
    }
    components
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Row-major samples in memory.
    struct Rows(Vec<Vec<f32>>);

    impl SampleMatrix for Rows {
        fn rows(&self) -> usize {
            self.0.len()
        }

        fn columns(&self) -> usize {
            self.0.first().map_or(0, Vec::len)
        }

        fn read(&self, row: usize, columns: Range<usize>, out: &mut [f32]) {
            out.copy_from_slice(&self.0[row][columns]);
        }
    }

    fn centred_matrix(rows: &Rows) -> Mat<f64> {
        let mean = mean(rows);
        Mat::from_fn(rows.rows(), rows.columns(), |t, c| {
            f64::from(rows.0[t][c]) - f64::from(mean[c])
        })
    }

    fn residual(pca: &PrincipalComponents, rows: &Rows) -> f64 {
        let mut again = Vec::new();
        let error = |row: &Vec<f32>, again: &mut Vec<f32>| {
            pca.reconstruct(&pca.project(row), again);
            row.iter()
                .zip(again)
                .map(|(a, b)| f64::from(*a - *b).powi(2))
                .sum::<f64>()
        };
        rows.0.iter().map(|row| error(row, &mut again)).sum()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        // Columns: fewer and more than a block; fewer and more than samples.
        #[test]
        fn agrees_with_a_singular_value_decomposition(
            seed in 0u32..1000, samples in 2usize..90, columns in prop::sample::select(vec![1, 7, 60, 1000]),
        ) {
            let value = |t: usize, c: usize| {
                let x = (seed as usize + 31 * t + 17 * c) as f32;
                (x * 0.7).sin() + (x * x * 0.013).cos() + if c.is_multiple_of(3) { t as f32 * 0.05 } else { 0.0 }
            };
            let rows = Rows((0..samples).map(|t| (0..columns).map(|c| value(t, c)).collect()).collect());
            let pca = PrincipalComponents::fit(&rows, 5);
            let singular = centred_matrix(&rows).singular_values().unwrap();
            let (mut kept, total) = (0.0, singular.iter().map(|s| s * s).sum::<f64>());
            for (k, variance) in pca.variances().iter().enumerate() {
                let expected = singular[k] * singular[k] / samples as f64;
                prop_assert!((variance - expected).abs() < 1e-9 * singular[0].powi(2) + 1e-12);
                kept += singular[k] * singular[k];
            }
            for (i, j) in (0..pca.len()).flat_map(|i| (0..=i).map(move |j| (i, j))) {
                let terms = pca.component(i).iter().zip(pca.component(j));
                let product: f64 = terms.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
                prop_assert!((product - if i == j { 1.0 } else { 0.0 }).abs() < 1e-4, "{i} {j} {product}");
            }
            // No subspace of that dimension has a smaller residual (Eckart and Young).
            let left = residual(&pca, &rows);
            prop_assert!((left - (total - kept)).abs() < 1e-5 * total + 1e-6, "{left} {}", total - kept);
        }
    }

    #[test]
    fn equal_samples_have_no_components() {
        let pca = PrincipalComponents::fit(&Rows(vec![vec![0.1, 0.2]; 9]), 3);
        assert!(pca.is_empty());
        let mut sample = Vec::new();
        pca.reconstruct(&[], &mut sample);
        assert_eq!(sample, [0.1, 0.2]);
        assert!(PrincipalComponents::fit(&Rows(Vec::new()), 3).is_empty());
    }

    #[test]
    fn two_directions_give_two_components() {
        let rows = (0..40).map(|t| {
            let (a, b) = ((t as f32).sin(), (t as f32 * 0.3).cos());
            vec![a, 2.0 * b, a - b, 0.0]
        });
        assert_eq!(PrincipalComponents::fit(&Rows(rows.collect()), 4).len(), 2);
    }
}
