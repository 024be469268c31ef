//! Axis-aligned bounding boxes and rays.

use glam::Vec3;

/// Axis-aligned bounding box, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
}

impl Aabb {
    /// The box without points, infinitely far from everything.
    pub(crate) const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Smallest box around points. Coordinates that are NaN are ignored.
    #[inline(always)]
    pub(crate) fn around(points: &[Vec3]) -> Self {
        points
            .iter()
            .fold(Self::EMPTY, |b, &p| b.union(Self { min: p, max: p }))
    }

    /// Smallest box around both. Coordinates of `other` that are NaN are ignored.
    #[inline(always)]
    pub(crate) fn union(self, other: Self) -> Self {
        Self {
            min: vec_min(self.min, other.min),
            max: vec_max(self.max, other.max),
        }
    }
}

/// Minimum of each coordinate; the coordinate of `a` where that of `b` is NaN.
#[inline(always)]
pub(crate) fn vec_min(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(scalar_min(a.x, b.x), scalar_min(a.y, b.y), scalar_min(a.z, b.z))
}

/// Maximum of each coordinate; the coordinate of `a` where that of `b` is NaN.
#[inline(always)]
pub(crate) fn vec_max(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(scalar_max(a.x, b.x), scalar_max(a.y, b.y), scalar_max(a.z, b.z))
}

// A comparison and a selection compile to one instruction. `f32::min` and `f32::max` ignore a NaN
// on either side, which takes several.

/// The lower of two numbers; `a` where `b` is NaN.
#[inline(always)]
pub(crate) fn scalar_min(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The higher of two numbers; `a` where `b` is NaN.
#[inline(always)]
pub(crate) fn scalar_max(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// Half line: origin + t · direction, t ≥ 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
    /// Reciprocal of each coordinate of the direction, finite.
    pub(crate) inverse_direction: Vec3,
}

impl Ray {
    /// Smallest magnitude of a coordinate of the direction. The reciprocal times any length in
    /// metres is finite, so that no box test computes 0 · ∞.
    const MIN_COMPONENT: f32 = 1e-30;

    pub(crate) fn new(origin: Vec3, direction: Vec3) -> Self {
        let inverse = |x: f32| {
            let is_zero = x.abs() < Self::MIN_COMPONENT;
            if is_zero { Self::MIN_COMPONENT } else { x }.recip()
        };
        Self {
            origin,
            direction,
            inverse_direction: Vec3::from(direction.to_array().map(inverse)),
        }
    }
}

/// |v|² in m².
///
/// Terms are added in the order x, y, z in which box distances are: rounding is monotone, so a
/// point in a box is never nearer than the box, to the last bit.
pub(crate) fn squared_length(v: Vec3) -> f32 {
    v.x * v.x + v.y * v.y + v.z * v.z
}
