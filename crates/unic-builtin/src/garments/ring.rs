//! Convex outlines around a body part.

use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// Number of directions in which the support function of a ring is sampled.
pub(crate) const DIRECTIONS: usize = 180;

/// Closed convex curve in a plane, like a measuring tape around a body part.
///
/// The curve is the envelope of its support function h(θ): the distance from the origin to the
/// tangent line whose normal has the angle θ. Offsetting adds to h, blending blends h, smoothing
/// convolves h. Each gives a convex curve again, and the circumference is ∫h dθ (Cauchy's formula).
///
/// The parameter u in 0..1 is the share of the circumference, from the direction `front` towards
/// `side`. Seen against `axis = front × side` it runs counter-clockwise, so that u × v points
/// outward for v along `axis`. On a trunk, u = 0 is at the front (+Z) and u = 0.25 at the left
/// (+X).
#[derive(Clone, Debug, PartialEq)]
pub struct Ring {
    /// Origin of the plane's coordinates, metres.
    origin: Vec3,
    /// Unit direction of the angle 0.
    front: Vec3,
    /// Unit direction of the angle π/2.
    side: Vec3,
    /// h at the angles 2πk / [`DIRECTIONS`] from `front` towards `side`, metres.
    support: Vec<f32>,
    /// Points of the envelope; the first is repeated at the end.
    outline: Vec<OutlinePoint>,
}

/// Point of a closed curve.
#[derive(Clone, Copy, Debug, PartialEq)]
struct OutlinePoint {
    /// Length of the curve up to the point, metres.
    along: f32,
    /// Coordinates along front and side, metres.
    point: Vec2,
}

impl Ring {
    /// Convex hull of points in a plane, with rounded corners; none for fewer than three points.
    ///
    /// Points are given along `front` and `side`, which are orthonormal, from `origin`.
    pub fn around(origin: Vec3, [front, side]: [Vec3; 2], points: &[Vec2]) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let reach = |k| {
            points
                .iter()
                .map(|p| p.dot(direction(k)))
                .fold(f32::MIN, f32::max)
        };
        let support = rounded((0..DIRECTIONS).map(reach).collect());
        Some(Self::from_support(origin, [front, side], support))
    }

    /// Ellipse with the given half axes along `front` and `side`, metres.
    pub fn ellipse(origin: Vec3, [front, side]: [Vec3; 2], half: Vec2) -> Self {
        let support = (0..DIRECTIONS).map(|k| (direction(k) * half).length());
        Self::from_support(origin, [front, side], support.collect())
    }

    fn from_support(origin: Vec3, [front, side]: [Vec3; 2], support: Vec<f32>) -> Self {
        let outline = outline(&support);
        Self {
            origin,
            front,
            side,
            support,
            outline,
        }
    }

    /// Origin of the plane's coordinates, metres.
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Unit normal of the plane, along which v of a tube grows.
    pub fn axis(&self) -> Vec3 {
        self.front.cross(self.side)
    }

    /// Length of the curve, metres.
    pub fn circumference(&self) -> f32 {
        self.outline.last().map_or(0.0, |last| last.along)
    }

    /// Support function at an angle from `front` towards `side`, metres.
    pub fn support(&self, angle: f32) -> f32 {
        let at = (angle / TAU).rem_euclid(1.0) * DIRECTIONS as f32;
        let (k, t) = (at.floor() as usize, at.fract());
        let of = |k: usize| self.support[k % DIRECTIONS];
        of(k) * (1.0 - t) + of(k + 1) * t
    }

    /// World point at the share `u` of the circumference; periodic in u.
    pub fn point(&self, u: f32) -> Vec3 {
        let s = u.rem_euclid(1.0) * self.circumference();
        let next = self.outline.partition_point(|p| p.along <= s);
        let next = next.clamp(1, self.outline.len() - 1);
        let (a, b) = (self.outline[next - 1], self.outline[next]);
        // Neighbouring points may coincide where the curve has a corner.
        let t = ((s - a.along) / (b.along - a.along).max(1e-9)).clamp(0.0, 1.0);
        self.lifted(a.point.lerp(b.point, t))
    }

    /// World point where the curve's normal has the given angle from `front` towards `side`.
    ///
    /// Points of the same angle on neighbouring rings lie next to each other.
    pub fn point_at_angle(&self, angle: f32) -> Vec3 {
        let step = TAU / DIRECTIONS as f32;
        let slope = (self.support(angle + step) - self.support(angle - step)) / (2.0 * step);
        let (sin, cos) = angle.sin_cos();
        let h = self.support(angle);
        self.lifted(Vec2::new(cos, sin) * h + Vec2::new(-sin, cos) * slope)
    }

    /// Distance from the origin to the curve in a direction of the plane, metres.
    pub fn radius(&self, angle: f32) -> f32 {
        // The curve bounds the intersection of the half planes n(θ)·p ≤ h(θ). Lines almost parallel
        // to the direction cannot be the first to be met.
        let (sin, cos) = angle.sin_cos();
        let along = Vec2::new(cos, sin);
        let reach = |k: usize| {
            let facing = direction(k).dot(along);
            if facing > 0.05 {
                self.support[k] / facing
            } else {
                f32::MAX
            }
        };
        (0..DIRECTIONS).map(reach).fold(f32::MAX, f32::min)
    }

    /// Curve that lies `ease` metres further out everywhere.
    #[must_use]
    pub fn offset(&self, ease: f32) -> Self {
        let support = self.support.iter().map(|h| h + ease).collect();
        Self::from_support(self.origin, [self.front, self.side], support)
    }

    /// Curve moved by a displacement, metres.
    #[must_use]
    pub fn moved(&self, by: Vec3) -> Self {
        Self {
            origin: self.origin + by,
            ..self.clone()
        }
    }

    /// Blend of this curve (t = 0) with another one (t = 1), frames included.
    #[must_use]
    pub fn blended(&self, other: &Self, t: f32) -> Self {
        let both = self.support.iter().zip(&other.support);
        let support = both.map(|(a, b)| a + (b - a) * t).collect();
        let front = self.front.lerp(other.front, t).normalize_or(self.front);
        let side = self.side.lerp(other.side, t).reject_from(front);
        let frame = [front, side.normalize_or(self.side)];
        Self::from_support(self.origin.lerp(other.origin, t), frame, support)
    }

    /// Smallest convex curve around this one and another one, in the plane of this one.
    ///
    /// It is the outline of a garment that falls straight from a wider place above. Both frames
    /// must have the same directions.
    #[must_use]
    pub fn around_both(&self, other: &Self) -> Self {
        let shift = other.origin - self.origin;
        let shift = Vec2::new(shift.dot(self.front), shift.dot(self.side));
        // The maximum of two support functions is that of the common hull.
        let of_other = |k: usize| other.support[k] + shift.dot(direction(k));
        let support = (0..DIRECTIONS).map(|k| self.support[k].max(of_other(k)));
        Self::from_support(self.origin, [self.front, self.side], support.collect())
    }

    /// Smallest curve around this one that is mirror-symmetric in `side`.
    #[must_use]
    pub fn symmetric(&self) -> Self {
        let mirrored = |k: usize| self.support[(DIRECTIONS - k) % DIRECTIONS];
        let support = (0..DIRECTIONS).map(|k| self.support[k].max(mirrored(k)));
        Self::from_support(self.origin, [self.front, self.side], support.collect())
    }

    /// World point of a point in the plane's coordinates.
    fn lifted(&self, plane: Vec2) -> Vec3 {
        self.origin + self.front * plane.x + self.side * plane.y
    }
}

/// Unit vector at the angle 2πk / [`DIRECTIONS`].
fn direction(k: usize) -> Vec2 {
    let (sin, cos) = (TAU * k as f32 / DIRECTIONS as f32).sin_cos();
    Vec2::new(cos, sin)
}

/// Rounds the corners of a hull.
///
/// A corner is a single point for a whole range of normals, which would crowd into it.
fn rounded(mut support: Vec<f32>) -> Vec<f32> {
    // Each pass averages h with itself turned by ±2 degrees; the deviation of eight passes is 4
    // degrees.
    for _ in 0..8 {
        let of = |k: usize| support[(k + DIRECTIONS) % DIRECTIONS];
        support = (0..DIRECTIONS)
            .map(|k| 0.5 * of(k) + 0.25 * (of(k + DIRECTIONS - 1) + of(k + 1)))
            .collect();
    }
    support
}

/// Points of the envelope p(θ) = h n + h' n' of a support function.
fn outline(support: &[f32]) -> Vec<OutlinePoint> {
    let step = TAU / DIRECTIONS as f32;
    let of = |k: usize| support[k % DIRECTIONS];
    let mut along = 0.0;
    let mut outline: Vec<OutlinePoint> = Vec::with_capacity(DIRECTIONS + 1);
    for k in 0..=DIRECTIONS {
        // Central difference of h.
        let slope = (of(k + 1) - of(k + DIRECTIONS - 1)) / (2.0 * step);
        let normal = direction(k % DIRECTIONS);
        let point = normal * of(k) + normal.perp() * slope;
        along += outline.last().map_or(0.0, |last| last.point.distance(point));
        outline.push(OutlinePoint { along, point });
    }
    outline
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: [Vec3; 2] = [Vec3::Z, Vec3::X];

    #[test]
    fn an_offset_circle_is_a_circle() {
        let ring = Ring::ellipse(Vec3::Y, FRAME, Vec2::splat(0.2)).offset(0.05);
        assert!((ring.circumference() - TAU * 0.25).abs() < 1e-3);
        for k in 0..7 {
            let u = k as f32 / 7.0;
            let (sin, cos) = (u * TAU).sin_cos();
            let exact = Vec3::new(sin * 0.25, 1.0, cos * 0.25);
            assert!(ring.point(u).distance(exact) < 2e-3);
            assert!(ring.point_at_angle(u * TAU).distance(exact) < 1e-3);
            assert!((ring.radius(u * TAU) - 0.25).abs() < 1e-3);
        }
    }

    #[test]
    fn the_hull_of_a_square_is_round_at_its_corners() {
        let points = [Vec2::ONE, -Vec2::ONE, Vec2::new(1.0, -1.0), Vec2::new(-1.0, 1.0)];
        let ring = Ring::around(Vec3::ZERO, FRAME, &points).unwrap();
        // The circumference of a Minkowski average is the average of the circumferences.
        assert!((ring.circumference() - 8.0).abs() < 0.05);
        assert!((ring.radius(0.0) - 1.0).abs() < 0.1);
        assert!((ring.radius(TAU / 8.0) - 2f32.sqrt()).abs() < 0.03);
    }

    #[test]
    fn blending_is_linear_in_the_circumference() {
        let small = Ring::ellipse(Vec3::ZERO, FRAME, Vec2::new(0.1, 0.2));
        let large = Ring::ellipse(Vec3::Y, FRAME, Vec2::new(0.5, 0.3));
        let middle = small.blended(&large, 0.25);
        let expected = 0.75 * small.circumference() + 0.25 * large.circumference();
        assert!((middle.circumference() - expected).abs() < 1e-3);
        assert!((middle.origin() - Vec3::Y * 0.25).length() < 1e-6);
    }
}
