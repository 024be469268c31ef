//! The rest shape that reproduces frames under given bones and weights.

use glam::{DMat3, DVec3, Mat3, Vec3};
use unic_core::{skinning::SkinningWeights, transform::Rigid};

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
        let rest = (matrix.inverse() * right).as_vec3();
        // Opposite rotations cancel in the blend, in every frame: such a vertex has no rest position, and
        // the heaviest joint's stands for it.
        match (rest.is_finite(), weights.row(vertex).next()) {
            (false, Some((joint, _))) => transforms[0][joint].inverse().point(positions[0][vertex]),
            _ => rest,
        }
    };
    (0..weights.len()).map(vertex).collect()
}
