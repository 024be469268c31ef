//! The rest shape that reproduces frames under given bones and weights.

use glam::{DMat3, DVec3, Mat3, Vec3};
use unic_core::{skinning::SkinningWeights, transform::Rigid};

/// Smallest determinant of Σ AᵀA, relative to that of a rotation in all frames.
const MIN_DETERMINANT: f64 = 1e-4;

/// Linear map and offset of one vertex in one frame by linear blend skinning: x = A r + b.
pub(super) fn blended(weights: &SkinningWeights, vertex: usize, transforms: &[Rigid]) -> (Mat3, Vec3) {
    let (mut linear, mut offset) = (Mat3::ZERO, Vec3::ZERO);
    for (joint, weight) in weights.row(vertex) {
        linear += Mat3::from_quat(transforms[joint].rotation) * weight;
        offset += transforms[joint].translation * weight;
    }
    (linear, offset)
}

/// Returns for each vertex the rest position r with the least Σ ‖A(t) r + b(t) − x(t)‖².
pub(super) fn fit(positions: &[&[Vec3]], transforms: &[Vec<Rigid>], weights: &SkinningWeights) -> Vec<Vec3> {
    let vertex = |vertex: usize| {
        let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
        for (frame, transforms) in positions.iter().zip(transforms) {
            let (linear, offset) = blended(weights, vertex, transforms);
            let transposed = linear.as_dmat3().transpose();
            matrix += transposed * linear.as_dmat3();
            right += transposed * (frame[vertex] - offset).as_dvec3();
        }
        let rest = inverted(matrix).map(|inverse| (inverse * right).as_vec3());
        // A vertex without a rest position of its own has that of the joint that moves it most.
        let heaviest = || {
            let joint = weights.row(vertex).next().map_or(0, |(joint, _)| joint);
            transforms[0][joint].inverse().point(positions[0][vertex])
        };
        rest.unwrap_or_else(heaviest)
    };
    (0..weights.len()).map(vertex).collect()
}

/// Inverts Σ AᵀA, unless the blended rotations cancel in some direction, in all frames.
pub(super) fn inverted(matrix: DMat3) -> Option<DMat3> {
    let mean = (matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z) / 3.0;
    // The cube of the mean is the largest determinant of this trace.
    let is_regular = matrix.determinant() > MIN_DETERMINANT * mean.powi(3);
    is_regular.then(|| matrix.inverse())
}
