//! Small systems of linear equations.

/// Ridge relative to the largest diagonal element. It keeps singular systems solvable.
const RIDGE: f64 = 1e-13;

/// Solves `matrix` x = `right` for a symmetric positive semidefinite row-major matrix, in place: the
/// solution replaces `right`. By Cholesky's decomposition.
pub(super) fn solve(matrix: &mut [f64], right: &mut [f64]) {
    let n = right.len();
    let largest = (0..n)
        .map(|i| matrix[i * n + i])
        .fold(f64::MIN_POSITIVE, f64::max);
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| matrix[i * n + k] * matrix[j * n + k]).sum();
            let rest = matrix[i * n + j] - sum;
            matrix[i * n + j] = match i == j {
                true => (rest + RIDGE * largest).max(RIDGE * largest).sqrt(),
                false => rest / matrix[j * n + j],
            };
        }
    }
    for i in 0..n {
        let sum: f64 = (0..i).map(|k| matrix[i * n + k] * right[k]).sum();
        right[i] = (right[i] - sum) / matrix[i * n + i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| matrix[k * n + i] * right[k]).sum();
        right[i] = (right[i] - sum) / matrix[i * n + i];
    }
}

#[cfg(test)]
mod tests {
    use super::solve;

    #[test]
    fn a_system_is_solved() {
        // [[4, 2, 1], [2, 3, 0], [1, 0, 2]] (1, -2, 3)
        let mut matrix = [4.0, 2.0, 1.0, 2.0, 3.0, 0.0, 1.0, 0.0, 2.0];
        let mut right = [3.0, -4.0, 7.0];
        solve(&mut matrix, &mut right);
        for (found, expected) in right.iter().zip([1.0, -2.0, 3.0]) {
            assert!((found - expected).abs() < 1e-9, "{right:?}");
        }
    }
}
