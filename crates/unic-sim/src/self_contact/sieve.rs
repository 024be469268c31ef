//! Which points may be near a face, or any of a block of faces: a quick look before the exact one.

use super::points::Region;
use crate::lanes::{Lanes, Lanes3};
use glam::Vec3;
use std::f32::consts::SQRT_2;

/// Rounding of places within a garment, metres.
const ROUNDING_M: f32 = 1e-5;

/// How far from a face points are near it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Over and under the face, for what does not move relative to it, metres.
    pub(super) above_m: f32,
    /// Beside it.
    pub(super) beside_m: f32,
    /// Time for which motion is looked ahead.
    pub(super) seconds: f32,
    /// Travel that is looked ahead at most, metres.
    pub(super) most_travel_m: f32,
}

impl Reach {
    /// What motion at a relative speed of m/s adds to both, metres.
    #[inline]
    pub(super) fn travel_m(&self, speed: f32) -> f32 {
        (speed * self.seconds).min(self.most_travel_m)
    }

    /// Greatest distance from a face of what moves at that speed relative to it, metres.
    #[inline]
    pub(super) fn distance_m(&self, speed: f32) -> f32 {
        self.above_m.hypot(self.beside_m) + ROUNDING_M + SQRT_2 * self.travel_m(speed)
    }
}

/// Bounds of moving points.
#[derive(Clone, Copy, Debug)]
pub(super) struct MovingBox {
    /// Positions, metres.
    pub(super) low: Vec3,
    pub(super) high: Vec3,
    /// Velocities, m/s.
    pub(super) least: Vec3,
    pub(super) most: Vec3,
}

impl MovingBox {
    pub(super) const EMPTY: Self = Self {
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
        least: Vec3::INFINITY,
        most: Vec3::NEG_INFINITY,
    };

    #[inline]
    pub(super) fn with(self, places: [Vec3; 3], velocities: [Vec3; 3]) -> Self {
        let ([a, b, c], [u, v, w]) = (places, velocities);
        Self {
            low: self.low.min(a).min(b).min(c),
            high: self.high.max(a).max(b).max(c),
            least: self.least.min(u).min(v).min(w),
            most: self.most.max(u).max(v).max(w),
        }
    }
}

/// Where points may be near any of the faces in a box.
pub(super) struct Surroundings {
    low: Lanes3,
    high: Lanes3,
    velocity: Lanes3,
    /// Of the faces, around `velocity`, m/s.
    spread: Lanes,
    travel: Travel,
    near_m: Lanes,
}

impl Surroundings {
    pub(super) fn new(faces: &MovingBox, reach: &Reach) -> Self {
        Self {
            low: Lanes3::splat(faces.low),
            high: Lanes3::splat(faces.high),
            velocity: Lanes3::splat(0.5 * (faces.least + faces.most)),
            spread: Lanes::splat(0.5 * faces.least.distance(faces.most)),
            travel: Travel::new(reach),
            near_m: Lanes::splat(reach.distance_m(0.0)),
        }
    }
}

impl Region for Surroundings {
    #[inline(always)]
    fn excess_m(&self, places: Lanes3, velocities: Lanes3) -> Lanes {
        let (below, over) = (self.low - places, places - self.high);
        let outside_m = below
            .x
            .max(over.x)
            .max(below.y)
            .max(over.y)
            .max(below.z)
            .max(over.z);
        let travel_m = self.travel.lanes_m(velocities - self.velocity, self.spread);
        outside_m - self.near_m - travel_m * Lanes::splat(SQRT_2)
    }
}

/// Where points may be near one face.
pub(super) struct Prism {
    first: Lanes3,
    normal: Lanes3,
    /// Of each edge, unit, in the plane; zero for a degenerate face, beside which nothing is.
    outward: [Lanes3; 3],
    /// Distance of the edge that is not at the first corner from it, metres.
    height_m: Lanes,
    velocity: Lanes3,
    /// Of the corners, around `velocity`, m/s.
    spread: Lanes,
    travel: Travel,
    above_m: Lanes,
    beside_m: Lanes,
}

impl Prism {
    /// Around a face of that unit normal, or of none.
    pub(super) fn new(corners: [Vec3; 3], velocities: [Vec3; 3], normal: Vec3, reach: &Reach) -> Self {
        let [a, b, c] = corners;
        let outward = |edge: Vec3| edge.cross(normal).normalize_or_zero();
        let outward = [outward(b - a), outward(c - b), outward(a - c)];
        let [first, second, third] = velocities;
        let spread_squared = first.distance_squared(second).max(first.distance_squared(third));
        Self {
            first: Lanes3::splat(a),
            normal: Lanes3::splat(normal),
            // Written out: `map` over an array of three is not always inlined.
            outward: [
                Lanes3::splat(outward[0]),
                Lanes3::splat(outward[1]),
                Lanes3::splat(outward[2]),
            ],
            height_m: Lanes::splat((b - a).dot(outward[1])),
            velocity: Lanes3::splat(first),
            spread: Lanes::splat(spread_squared.sqrt()),
            travel: Travel::new(reach),
            above_m: Lanes::splat(reach.above_m + ROUNDING_M),
            beside_m: Lanes::splat(reach.beside_m + ROUNDING_M),
        }
    }
}

impl Region for Prism {
    #[inline(always)]
    fn excess_m(&self, places: Lanes3, velocities: Lanes3) -> Lanes {
        let travel_m = self.travel.lanes_m(velocities - self.velocity, self.spread);
        let arm = places - self.first;
        let above_m = arm.dot(self.normal).abs() - self.above_m;
        let [first, second, third] = self.outward;
        let beside_m = arm.dot(first).max(arm.dot(third));
        let beside_m = beside_m.max(arm.dot(second) - self.height_m) - self.beside_m;
        above_m.max(beside_m) - travel_m
    }
}

/// [`Reach::travel_m`] of eight.
struct Travel {
    seconds: Lanes,
    most_m: Lanes,
}

impl Travel {
    fn new(reach: &Reach) -> Self {
        Self {
            seconds: Lanes::splat(reach.seconds),
            most_m: Lanes::splat(reach.most_travel_m),
        }
    }

    #[inline(always)]
    fn lanes_m(&self, relative: Lanes3, spread: Lanes) -> Lanes {
        ((relative.dot(relative).sqrt() + spread) * self.seconds).min(self.most_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::self_contact::points::Points;
    use proptest::prelude::*;
    use unic_core::surface::Triangle;

    const REACH: Reach = Reach {
        above_m: 0.004,
        beside_m: 0.001,
        seconds: 0.008,
        most_travel_m: 0.01,
    };

    fn vector(reach: f32) -> impl Strategy<Value = Vec3> {
        let axis = || -reach..=reach;
        (axis(), axis(), axis()).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn what_is_near_passes(
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
            let mut points = Points::default();
            points.reset(1);
            points.set(0, 0, p, velocity);
            let (mut in_prism, mut around) = (Vec::new(), Vec::new());
            points.sieve(0..1, &Prism::new(corners, velocities, triangle.normal(), &REACH), &mut in_prism);
            let bounds = MovingBox::EMPTY.with(corners, velocities);
            points.sieve(0..1, &Surroundings::new(&bounds, &REACH), &mut around);
            prop_assert!(!is_near || (in_prism.len(), around.len()) == (1, 1));
        }
    }

    #[test]
    fn what_is_far_or_nowhere_does_not_pass() {
        let corners = [Vec3::ZERO, Vec3::X * 0.01, Vec3::Z * 0.01];
        let prism = Prism::new(corners, [Vec3::ZERO; 3], Vec3::NEG_Y, &REACH);
        let mut points = Points::default();
        points.reset(3);
        points.set(0, 0, Vec3::new(0.003, 0.0042, 0.003), Vec3::ZERO);
        points.set(1, 1, Vec3::new(-0.0012, 0.0, 0.003), Vec3::ZERO);
        let mut found = Vec::new();
        points.sieve(0..3, &prism, &mut found);
        assert!(found.is_empty(), "{found:?}");
    }
}
