//! Quaternions x, y, z, w as rows of graphs, and the rotations that they stand for.

use crate::graph::{Graph, Value};

/// Divisor below which [`Graph::angle`] divides by this number. A half-turn's tangent is then large
/// enough for an exact right angle, and finite.
const SMALLEST_DIVISOR: f32 = 1e-30;

/// Matrices L with L(q) p = q p, one for each of the elements x, y, z, w of q, which they are
/// multiplied by.
#[rustfmt::skip]
const LEFT_FACTORS: [[f32; 16]; 4] = [
    [0., 0., 0., 1.,   0., 0., -1., 0.,   0., 1., 0., 0.,   -1., 0., 0., 0.],
    [0., 0., 1., 0.,   0., 0., 0., 1.,   -1., 0., 0., 0.,   0., -1., 0., 0.],
    [0., -1., 0., 0.,   1., 0., 0., 0.,   0., 0., 0., 1.,   0., 0., -1., 0.],
    [1., 0., 0., 0.,   0., 1., 0., 0.,   0., 0., 1., 0.,   0., 0., 0., 1.],
];

/// A rotation matrix minus the identity, in terms of the products of two elements: (product, entry
/// of the matrix in row-major order, factor). Product 4 i + j is that of elements i and j.
const MATRIX_TERMS: [(usize, usize, f32); 18] = [
    (5, 0, -2.0),
    (10, 0, -2.0),
    (1, 1, 2.0),
    (11, 1, -2.0),
    (2, 2, 2.0),
    (7, 2, 2.0),
    (1, 3, 2.0),
    (11, 3, 2.0),
    (0, 4, -2.0),
    (10, 4, -2.0),
    (6, 5, 2.0),
    (3, 5, -2.0),
    (2, 6, 2.0),
    (7, 6, -2.0),
    (6, 7, 2.0),
    (3, 7, 2.0),
    (0, 8, -2.0),
    (5, 8, -2.0),
];

impl Graph {
    /// Matrices of left multiplication by quaternions (N, 4): (N, 4, 4). They multiply as the
    /// quaternions do.
    pub(crate) fn left_factors(&mut self, q: Value) -> Value {
        let factors = self.constant(&[4, 16], LEFT_FACTORS.as_flattened());
        let flat = self.matmul(q, factors);
        self.reshape(flat, &[-1, 4, 4])
    }

    /// Products q p of quaternions (N, 4) and (N, 4) or (1, 4).
    pub(crate) fn product(&mut self, q: Value, p: Value) -> Value {
        let q = self.left_factors(q);
        let p = self.reshape(p, &[-1, 1, 4]);
        let terms = self.mul(q, p);
        self.sum(terms, 2)
    }

    /// Inverses of unit quaternions (N, 4).
    pub(crate) fn conjugate(&mut self, q: Value) -> Value {
        let signs = self.constant(&[1, 4], &[-1.0, -1.0, -1.0, 1.0]);
        self.mul(q, signs)
    }

    /// Rotation matrices of unit quaternions (N, 4): (N, 9), row-major.
    pub(crate) fn matrices(&mut self, q: Value) -> Value {
        let column = self.reshape(q, &[-1, 4, 1]);
        let row = self.reshape(q, &[-1, 1, 4]);
        let products = self.mul(column, row);
        let products = self.reshape(products, &[-1, 16]);
        let mut factors = [0.0; 9 * 16];
        for (product, entry, factor) in MATRIX_TERMS {
            factors[16 * entry + product] = factor;
        }
        let factors = self.constant(&[9, 16], &factors);
        let identity = self.constant(&[9], &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        self.linear_with(products, factors, identity)
    }

    /// Vectors (N, 3) rotated by matrices (N, 9), one each.
    pub(crate) fn rotated(&mut self, matrices: Value, vectors: Value) -> Value {
        let matrices = self.reshape(matrices, &[-1, 3, 3]);
        let vectors = self.reshape(vectors, &[-1, 1, 3]);
        let terms = self.mul(matrices, vectors);
        self.sum(terms, 2)
    }

    /// Vectors (N, 3) or (1, 3) rotated by the inverses of matrices (N, 9), one each.
    pub(crate) fn unrotated(&mut self, matrices: Value, vectors: Value) -> Value {
        let matrices = self.reshape(matrices, &[-1, 3, 3]);
        let vectors = self.reshape(vectors, &[-1, 3, 1]);
        let terms = self.mul(matrices, vectors);
        self.sum(terms, 1)
    }

    /// Vectors (N, 3) rotated by the inverse of one matrix (1, 9).
    pub(crate) fn unrotated_together(&mut self, matrix: Value, vectors: Value) -> Value {
        let matrix = self.reshape(matrix, &[3, 3]);
        self.matmul(vectors, matrix)
    }

    /// Vectors (N, 3) rotated by one quaternion (1, 4).
    // The matrix of the inverse, and not a transposed matrix: onnxruntime 1.32 cannot read a graph in
    // which it merges that operation with the product of a value that is also an output.
    pub(crate) fn rotated_together(&mut self, rotation: Value, vectors: Value) -> Value {
        let inverse = self.conjugate(rotation);
        let matrix = self.matrices(inverse);
        self.unrotated_together(matrix, vectors)
    }

    /// Angle of the vector (x, y), in −π..=π radians: the arc tangent of y / x with its quadrant. 0
    /// for a vector of length 0.
    pub(crate) fn angle(&mut self, y: Value, x: Value) -> Value {
        let [xx, yy] = [x, y].map(|v| self.mul(v, v));
        let squared = self.add(xx, yy);
        let length = self.map("Sqrt", squared);
        // The tangent of half the angle is y / (length + x), and also (length − x) / y. Each
        // has a half-plane where it does not cancel.
        let sum = self.add(length, x);
        let difference = self.sub(length, x);
        let is_left = self.is_below(x, 0.0);
        let numerator = self.choose(is_left, difference, y);
        let denominator = self.choose(is_left, y, sum);
        // No division by zero: a runtime may choose by multiplying with 0 and 1.
        let magnitude = self.map("Abs", denominator);
        let is_zero = self.is_below(magnitude, SMALLEST_DIVISOR);
        let smallest = self.scalar(SMALLEST_DIVISOR);
        let denominator = self.choose(is_zero, smallest, denominator);
        let tangent = self.div(numerator, denominator);
        let half = self.map("Atan", tangent);
        self.scale(half, 2.0)
    }

    /// Quaternions (1, 4) of rotations about +Y by angles (1, 1), radians.
    pub(crate) fn rotation_about_y(&mut self, angle: Value) -> Value {
        let half = self.scale(angle, 0.5);
        let [sine, cosine] = ["Sin", "Cos"].map(|function| self.map(function, half));
        let zero = self.constant(&[1, 1], &[0.0]);
        self.concat(&[zero, sine, zero, cosine], 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Mat3, Mat4, Quat, Vec4};

    const Q: Quat = Quat::from_xyzw(0.2, -0.4, 0.1, 0.888_819_4);

    #[test]
    fn left_factors_multiply_as_quaternions_do() {
        let p = Quat::from_xyzw(-0.5, 0.1, 0.7, 0.5);
        let matrix = (Q.to_array().iter().zip(LEFT_FACTORS))
            // glam's matrices are column-major.
            .fold(Mat4::ZERO, |sum, (&x, factor)| {
                sum + Mat4::from_cols_array(&factor).transpose() * x
            });
        let product = matrix * Vec4::from(p);
        assert!(
            (product - Vec4::from(Q * p)).length() < 1e-6,
            "{product} {}",
            Q * p
        );
    }

    #[test]
    fn matrix_terms_are_those_of_a_rotation_matrix() {
        let q = Q.to_array();
        let mut matrix = Mat3::IDENTITY.to_cols_array();
        for (product, entry, factor) in MATRIX_TERMS {
            matrix[entry] += factor * q[product / 4] * q[product % 4];
        }
        let expected = Mat3::from_quat(Q).transpose().to_cols_array();
        for (a, b) in matrix.iter().zip(expected) {
            assert!((a - b).abs() < 1e-6, "{matrix:?} {expected:?}");
        }
    }
}
