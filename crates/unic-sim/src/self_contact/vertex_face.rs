//! Geometry of a vertex relative to a face.

use super::pair::ContactPair;
use crate::body::corners_of;
use glam::Vec3;

/// Margin around a face within which a vertex still touches it, in barycentric weights. Over the
/// outside of a crease a vertex projects into no face exactly.
const RIM: f32 = 0.05;

/// A vertex and a face at one moment, relative to the vertex. Relative positions keep the precision
/// of f32 far from the origin.
pub(super) struct VertexFace {
    /// The face's corners relative to the vertex, metres.
    corners: [Vec3; 3],
    /// (b − a) × (c − a), m².
    area_normal: Vec3,
}

impl VertexFace {
    #[inline]
    pub(super) fn new(positions: &[Vec3], pair: &ContactPair, face: [u32; 3]) -> Self {
        let vertex = positions[pair.vertex as usize];
        let [a, b, c] = corners_of(positions, face);
        Self {
            corners: [a - vertex, b - vertex, c - vertex],
            area_normal: (b - a).cross(c - a),
        }
    }

    /// Returns whether [`Self::height`] is at least the pair's thickness.
    #[inline]
    pub(super) fn is_clear(&self, pair: &ContactPair) -> bool {
        // Compares squares, to avoid a square root and a division: this runs for all pairs.
        let height = -self.corners[0].dot(self.area_normal) * pair.side;
        height >= 0.0 && height * height >= pair.thickness_m.powi(2) * self.area_normal.length_squared()
    }

    /// Returns the unit normal of the face; zero for a degenerate face.
    pub(super) fn normal(&self) -> Vec3 {
        self.area_normal.normalize_or_zero()
    }

    /// Returns the height of the vertex over the face's plane, metres; positive on the pair's side.
    #[inline]
    pub(super) fn height(&self, pair: &ContactPair) -> f32 {
        -self.corners[0].dot(self.normal()) * pair.side
    }

    /// Returns the barycentric weights of the vertex's projection, clamped to the face.
    ///
    /// Returns `None` when the projection is beyond the face's margin, or when the vertex is beside
    /// the face and at least the pair's thickness away from it.
    #[inline]
    pub(super) fn barycentric(&self, pair: &ContactPair) -> Option<Vec3> {
        let ([a, b, c], normal) = (self.corners, self.area_normal);
        let inverse = normal.length_squared().recip();
        let v = a.dot(normal.cross(c - a)) * inverse;
        let w = a.dot((b - a).cross(normal)) * inverse;
        let weights = Vec3::new(1.0 - v - w, v, w);
        // Negated, so that NaN and degenerate faces are no contact.
        if !(weights.min_element() >= -RIM && inverse.is_finite()) {
            return None;
        }
        let inside = weights.max(Vec3::ZERO);
        let clamped = inside / inside.element_sum();
        let is_far_beside = inside != weights && self.offset(clamped).length() >= pair.thickness_m;
        (!is_far_beside).then_some(clamped)
    }

    /// Returns the vector from the point of the face with these weights to the vertex, metres.
    #[inline]
    pub(super) fn offset(&self, weights: Vec3) -> Vec3 {
        let [a, b, c] = self.corners;
        -(a * weights.x + b * weights.y + c * weights.z)
    }
}
