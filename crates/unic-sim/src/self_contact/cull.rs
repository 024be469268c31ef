//! Conservative culling: volumes that contain all points that may touch a face, or any face of a
//! block. They are tested before the exact distance.

use super::moving_points::CullVolume;
use crate::simd::{F32x8, Vec3x8};
use glam::Vec3;
use std::f32::consts::SQRT_2;

/// Upper bound of the rounding error of a distance, metres. Culling and the exact test compute
/// distances in different ways, and culling must never reject what the exact test accepts.
const ROUNDING_M: f32 = 1e-5;

/// The distances from a face within which points are near it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Reach in front of and behind the face, without relative motion, metres.
    pub(super) above_m: f32,
    /// Reach beside the face within its plane, without relative motion, metres.
    pub(super) beside_m: f32,
    /// Time span of the predicted motion, seconds.
    pub(super) seconds: f32,
    /// Largest predicted travel, metres.
    pub(super) max_travel_m: f32,
}

impl Reach {
    /// Returns the distance that both reaches grow by for a relative speed in m/s, metres.
    #[inline]
    pub(super) fn travel_m(&self, speed: f32) -> f32 {
        (speed * self.seconds).min(self.max_travel_m)
    }

    /// Returns an upper bound of the distance from a face of a near point with this relative speed
    /// in m/s, metres.
    #[inline]
    pub(super) fn distance_m(&self, speed: f32) -> f32 {
        // Height and distance beside are perpendicular. Both grow by the travel, hence √2.
        self.above_m.hypot(self.beside_m) + ROUNDING_M + SQRT_2 * self.travel_m(speed)
    }
}

/// Bounds of the positions and velocities of moving points.
#[derive(Clone, Copy, Debug)]
pub(super) struct MovingBox {
    /// Smallest coordinates, metres.
    pub(super) low: Vec3,
    /// Largest coordinates, metres.
    pub(super) high: Vec3,
    /// Smallest velocity components, m/s.
    pub(super) min_velocity: Vec3,
    /// Largest velocity components, m/s.
    pub(super) max_velocity: Vec3,
}

impl MovingBox {
    pub(super) const EMPTY: Self = Self {
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
        min_velocity: Vec3::INFINITY,
        max_velocity: Vec3::NEG_INFINITY,
    };

    /// Returns the bounds extended by the corners of a face.
    #[inline]
    pub(super) fn with(self, positions: [Vec3; 3], velocities: [Vec3; 3]) -> Self {
        let ([a, b, c], [u, v, w]) = (positions, velocities);
        Self {
            low: self.low.min(a).min(b).min(c),
            high: self.high.max(a).max(b).max(c),
            min_velocity: self.min_velocity.min(u).min(v).min(w),
            max_velocity: self.max_velocity.max(u).max(v).max(w),
        }
    }
}

/// The volume in which points may be near any face of a block.
pub(super) struct BlockVolume {
    low: Vec3x8,
    high: Vec3x8,
    /// Centre of the faces' velocities, m/s.
    velocity: Vec3x8,
    /// Largest deviation of the faces' velocities from `velocity`, m/s.
    spread: F32x8,
    travel: TravelBound,
    /// Reach without relative motion, metres.
    near_m: F32x8,
}

impl BlockVolume {
    pub(super) fn new(faces: &MovingBox, reach: &Reach) -> Self {
        Self {
            low: Vec3x8::splat(faces.low),
            high: Vec3x8::splat(faces.high),
            velocity: Vec3x8::splat(0.5 * (faces.min_velocity + faces.max_velocity)),
            spread: F32x8::splat(0.5 * faces.min_velocity.distance(faces.max_velocity)),
            travel: TravelBound::new(reach),
            near_m: F32x8::splat(reach.distance_m(0.0)),
        }
    }
}

impl CullVolume for BlockVolume {
    #[inline(always)]
    fn outside_m(&self, positions: Vec3x8, velocities: Vec3x8) -> F32x8 {
        let (below, over) = (self.low - positions, positions - self.high);
        // The distance in the maximum norm, which is at most the Euclidean one: conservative, and
        // without a root.
        let outside_m = below
            .x
            .max(over.x)
            .max(below.y)
            .max(over.y)
            .max(below.z)
            .max(over.z);
        let travel_m = self.travel.travel_m(velocities - self.velocity, self.spread);
        outside_m - self.near_m - travel_m * F32x8::splat(SQRT_2)
    }
}

/// The volume in which points may be near one face: a triangular prism around it.
pub(super) struct FacePrism {
    /// Position of the first corner, metres.
    first: Vec3x8,
    normal: Vec3x8,
    /// Unit normal of each edge in the face's plane, outward. Zero for a degenerate face, as is
    /// `normal`: its prism accepts all points.
    outward: [Vec3x8; 3],
    /// Distance of the first corner from the opposite edge, metres.
    height_m: F32x8,
    /// Velocity of the first corner, m/s.
    velocity: Vec3x8,
    /// Largest deviation of the corners' velocities from `velocity`, m/s.
    spread: F32x8,
    travel: TravelBound,
    above_m: F32x8,
    beside_m: F32x8,
}

impl FacePrism {
    /// Makes the prism of a face with these corners and velocities. `normal` is the unit normal, or
    /// zero for a degenerate face.
    pub(super) fn new(corners: [Vec3; 3], velocities: [Vec3; 3], normal: Vec3, reach: &Reach) -> Self {
        let [a, b, c] = corners;
        let outward = |edge: Vec3| edge.cross(normal).normalize_or_zero();
        let outward = [outward(b - a), outward(c - b), outward(a - c)];
        let [first, second, third] = velocities;
        // The velocity of the closest point lies in the triangle of the corners' velocities. The
        // farthest point of a triangle from its first corner is one of the other two.
        let spread_squared = first.distance_squared(second).max(first.distance_squared(third));
        Self {
            first: Vec3x8::splat(a),
            normal: Vec3x8::splat(normal),
            // Written out: `map` over an array of three is not always inlined.
            outward: [
                Vec3x8::splat(outward[0]),
                Vec3x8::splat(outward[1]),
                Vec3x8::splat(outward[2]),
            ],
            height_m: F32x8::splat((b - a).dot(outward[1])),
            velocity: Vec3x8::splat(first),
            spread: F32x8::splat(spread_squared.sqrt()),
            travel: TravelBound::new(reach),
            above_m: F32x8::splat(reach.above_m + ROUNDING_M),
            beside_m: F32x8::splat(reach.beside_m + ROUNDING_M),
        }
    }
}

impl CullVolume for FacePrism {
    #[inline(always)]
    fn outside_m(&self, positions: Vec3x8, velocities: Vec3x8) -> F32x8 {
        let travel_m = self.travel.travel_m(velocities - self.velocity, self.spread);
        let arm = positions - self.first;
        // The largest of the signed distances from all planes is positive outside any of them.
        let above_m = arm.dot(self.normal).abs() - self.above_m;
        let [first, second, third] = self.outward;
        let beside_m = arm.dot(first).max(arm.dot(third));
        let beside_m = beside_m.max(arm.dot(second) - self.height_m) - self.beside_m;
        above_m.max(beside_m) - travel_m
    }
}

/// An upper bound of [`Reach::travel_m`] for eight points.
struct TravelBound {
    seconds: F32x8,
    max_travel_m: F32x8,
}

impl TravelBound {
    fn new(reach: &Reach) -> Self {
        Self {
            seconds: F32x8::splat(reach.seconds),
            max_travel_m: F32x8::splat(reach.max_travel_m),
        }
    }

    /// Returns the bound for points with these velocities relative to the centre of a face's
    /// velocities, which deviate from it by at most `spread`.
    #[inline(always)]
    fn travel_m(&self, relative: Vec3x8, spread: F32x8) -> F32x8 {
        ((relative.dot(relative).sqrt() + spread) * self.seconds).min(self.max_travel_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::self_contact::moving_points::MovingPoints;
    use proptest::prelude::*;
    use unic_core::surface::Triangle;

    const REACH: Reach = Reach {
        above_m: 0.004,
        beside_m: 0.001,
        seconds: 0.008,
        max_travel_m: 0.01,
    };

    fn vector(reach: f32) -> impl Strategy<Value = Vec3> {
        let axis = || -reach..=reach;
        (axis(), axis(), axis()).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn points_near_a_face_are_never_culled(
            corners in [vector(0.01), vector(0.01), vector(0.01)], p in vector(0.015),
            velocities in [vector(0.5), vector(0.5), vector(0.5)], velocity in vector(0.5),
        ) {
            let triangle = Triangle::new(corners);
            let hit = triangle.closest(p);
            let height_m = hit.offset.dot(triangle.normal());
            let beside_m = (hit.squared_distance - height_m * height_m).max(0.0).sqrt();
            let weights = hit.barycentric.to_array();
            let below: Vec3 = velocities.iter().zip(weights).map(|(v, w)| *v * w).sum();
            let travel_m = REACH.travel_m(velocity.distance(below));
            let is_near = height_m.abs() <= REACH.above_m + travel_m && beside_m <= REACH.beside_m + travel_m;
            let mut points = MovingPoints::default();
            points.reset(1);
            points.set(0, 0, p, velocity);
            let (mut in_prism, mut around) = (Vec::new(), Vec::new());
            points.cull(0..1, &FacePrism::new(corners, velocities, triangle.normal(), &REACH), &mut in_prism);
            let bounds = MovingBox::EMPTY.with(corners, velocities);
            points.cull(0..1, &BlockVolume::new(&bounds, &REACH), &mut around);
            prop_assert!(!is_near || (in_prism.len(), around.len()) == (1, 1));
        }
    }

    #[test]
    fn points_that_are_far_or_not_finite_are_culled() {
        let corners = [Vec3::ZERO, Vec3::X * 0.01, Vec3::Z * 0.01];
        let prism = FacePrism::new(corners, [Vec3::ZERO; 3], Vec3::NEG_Y, &REACH);
        let mut points = MovingPoints::default();
        points.reset(3);
        points.set(0, 0, Vec3::new(0.003, 0.0042, 0.003), Vec3::ZERO);
        points.set(1, 1, Vec3::new(-0.0012, 0.0, 0.003), Vec3::ZERO);
        let mut found = Vec::new();
        points.cull(0..3, &prism, &mut found);
        assert!(found.is_empty(), "{found:?}");
    }
}
