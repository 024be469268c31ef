//! A vertex over a face.

use super::pairs::Pair;
use crate::body::corners_of;
use glam::Vec3;

/// How far beyond a face, in barycentric weights, a vertex is still held: over the outside of a
/// crease no face is straight below.
const RIM: f32 = 0.05;

/// A vertex and a face at one moment.
pub(super) struct Configuration {
    /// The face's corners relative to the vertex, metres.
    corners: [Vec3; 3],
    /// (b − a) × (c − a), m².
    area_normal: Vec3,
}

impl Configuration {
    #[inline]
    pub(super) fn of(positions: &[Vec3], pair: &Pair, face: [u32; 3]) -> Self {
        let vertex = positions[pair.vertex as usize];
        let [a, b, c] = corners_of(positions, face);
        Self {
            corners: [a - vertex, b - vertex, c - vertex],
            area_normal: (b - a).cross(c - a),
        }
    }

    /// The vertex is far enough over the face's plane: [`Self::height`] is at least the pair's
    /// thickness, told without a root, as it is for most pairs.
    #[inline]
    pub(super) fn is_clear(&self, pair: &Pair) -> bool {
        let height = -self.corners[0].dot(self.area_normal) * pair.side;
        height >= 0.0 && height * height >= pair.thickness_m.powi(2) * self.area_normal.length_squared()
    }

    /// Unit; zero for a degenerate face.
    pub(super) fn normal(&self) -> Vec3 {
        self.area_normal.normalize_or_zero()
    }

    /// Of the vertex over the face's plane, on the pair's side, metres.
    #[inline]
    pub(super) fn height(&self, pair: &Pair) -> f32 {
        -self.corners[0].dot(self.normal()) * pair.side
    }

    /// Weights of the vertex's projection, clamped into the face; none when it is beyond its rim, or
    /// beside the face and far enough away from it.
    #[inline]
    pub(super) fn barycentric(&self, pair: &Pair) -> Option<Vec3> {
        let ([a, b, c], normal) = (self.corners, self.area_normal);
        let inverse = normal.length_squared().recip();
        let v = a.dot(normal.cross(c - a)) * inverse;
        let w = a.dot((b - a).cross(normal)) * inverse;
        let weights = Vec3::new(1.0 - v - w, v, w);
        if !(weights.min_element() >= -RIM && inverse.is_finite()) {
            return None;
        }
        let inside = weights.max(Vec3::ZERO);
        let clamped = inside / inside.element_sum();
        let is_far_beside = inside != weights && self.offset(clamped).length() >= pair.thickness_m;
        (!is_far_beside).then_some(clamped)
    }

    /// The vertex as seen from a point of the face, metres.
    #[inline]
    pub(super) fn offset(&self, weights: Vec3) -> Vec3 {
        let [a, b, c] = self.corners;
        -(a * weights.x + b * weights.y + c * weights.z)
    }
}
