//! Convex outlines around a body part.

use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// Directions in which a ring knows its support.
pub(crate) const DIRECTIONS: usize = 180;

/// A closed convex curve in a plane, as a measuring tape lies around a body part: the envelope of its
/// support function h(θ), the distance from the origin to the tangent line with normal angle θ.
///
/// Offsetting adds to h, blending blends h, smoothing convolves h; each gives a convex curve again,
/// and the circumference is ∫h dθ (Cauchy's formula).
///
/// The curve's parameter u in 0..1 is the share of the circumference from the direction `front`
/// towards `side`; seen against `axis = front × side` that is counter-clockwise, so that (u, v) with v
/// along `axis` turns outward. For a trunk u = 0 is at the front (+Z), 0.25 at the left (+X).
#[derive(Clone, Debug, PartialEq)]
pub struct Ring {
    origin: Vec3,
    front: Vec3,
    side: Vec3,
    /// h at the angles 2πk / [`DIRECTIONS`] from `front` towards `side`, metres.
    support: Vec<f32>,
    /// Points of the envelope with their distance along the curve; the first is repeated at the end.
    outline: Vec<(f32, Vec2)>,
}

impl Ring {
    /// The convex hull of points of a plane, given as (along front, along side) from `origin`, its
    /// corners rounded.
    ///
    /// `front` and `side` are orthonormal. None for fewer than three points.
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

    /// The ellipse with the given half axes along `front` and `side`.
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

    /// Where the plane's coordinates start.
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Unit normal of the plane: the direction in which v of a tube grows.
    pub fn axis(&self) -> Vec3 {
        self.front.cross(self.side)
    }

    /// Length of the curve, metres.
    pub fn circumference(&self) -> f32 {
        self.outline.last().map_or(0.0, |last| last.0)
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
        let next = self.outline.partition_point(|(along, _)| *along <= s);
        let next = next.clamp(1, self.outline.len() - 1);
        let ((a, p), (b, q)) = (self.outline[next - 1], self.outline[next]);
        let plane = p.lerp(q, ((s - a) / (b - a).max(1e-9)).clamp(0.0, 1.0));
        self.lifted(plane)
    }

    /// World point where the tangent's normal has the given angle from `front` towards `side`:
    /// neighbouring rings have such points next to each other.
    pub fn point_at_angle(&self, angle: f32) -> Vec3 {
        let step = TAU / DIRECTIONS as f32;
        let slope = (self.support(angle + step) - self.support(angle - step)) / (2.0 * step);
        let (sin, cos) = angle.sin_cos();
        let h = self.support(angle);
        self.lifted(Vec2::new(cos, sin) * h + Vec2::new(-sin, cos) * slope)
    }

    /// Distance from the origin to the curve in a direction of the plane, metres.
    pub fn radius(&self, angle: f32) -> f32 {
        // The curve is the intersection of the half planes n(θ)·p ≤ h(θ).
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

    /// The curve `ease` metres further out everywhere.
    #[must_use]
    pub fn offset(&self, ease: f32) -> Self {
        let support = self.support.iter().map(|h| h + ease).collect();
        Self::from_support(self.origin, [self.front, self.side], support)
    }

    /// The curve moved by a displacement.
    #[must_use]
    pub fn moved(&self, by: Vec3) -> Self {
        Self {
            origin: self.origin + by,
            ..self.clone()
        }
    }

    /// The curve between this one (t = 0) and another (t = 1); the frame too is blended.
    #[must_use]
    pub fn blended(&self, other: &Self, t: f32) -> Self {
        let both = self.support.iter().zip(&other.support);
        let support = both.map(|(a, b)| a + (b - a) * t).collect();
        let front = self.front.lerp(other.front, t).normalize_or(self.front);
        let side = self.side.lerp(other.side, t).reject_from(front);
        let frame = [front, side.normalize_or(self.side)];
        Self::from_support(self.origin.lerp(other.origin, t), frame, support)
    }

    /// A convex curve around both, in this one's plane: for a garment that hangs over what is above
    /// it. The other's frame must have the same directions.
    #[must_use]
    pub fn around_both(&self, other: &Self) -> Self {
        let shift = other.origin - self.origin;
        let shift = Vec2::new(shift.dot(self.front), shift.dot(self.side));
        let of_other = |k: usize| other.support[k] + shift.dot(direction(k));
        let support = (0..DIRECTIONS).map(|k| self.support[k].max(of_other(k)));
        Self::from_support(self.origin, [self.front, self.side], support.collect())
    }

    /// Mirror-symmetric in `side`: in each direction the larger of both sides.
    #[must_use]
    pub fn symmetric(&self) -> Self {
        let mirrored = |k: usize| self.support[(DIRECTIONS - k) % DIRECTIONS];
        let support = (0..DIRECTIONS).map(|k| self.support[k].max(mirrored(k)));
        Self::from_support(self.origin, [self.front, self.side], support.collect())
    }

    fn lifted(&self, plane: Vec2) -> Vec3 {
        self.origin + self.front * plane.x + self.side * plane.y
    }
}

fn direction(k: usize) -> Vec2 {
    let (sin, cos) = (TAU * k as f32 / DIRECTIONS as f32).sin_cos();
    Vec2::new(cos, sin)
}

/// Rounds corners: a hull's corner is one point for a whole range of directions, which would bunch
/// the curve's normals there.
fn rounded(mut support: Vec<f32>) -> Vec<f32> {
    // Each pass averages the curve with itself turned by ±2 degrees; eight spread about ±6.
    for _ in 0..8 {
        let of = |k: usize| support[(k + DIRECTIONS) % DIRECTIONS];
        support = (0..DIRECTIONS)
            .map(|k| 0.5 * of(k) + 0.25 * (of(k + DIRECTIONS - 1) + of(k + 1)))
            .collect();
    }
    support
}

/// The envelope p(θ) = h n + h' n', with the length along it.
fn outline(support: &[f32]) -> Vec<(f32, Vec2)> {
    let step = TAU / DIRECTIONS as f32;
    let of = |k: usize| support[k % DIRECTIONS];
    let mut along = 0.0;
    let mut outline: Vec<(f32, Vec2)> = Vec::with_capacity(DIRECTIONS + 1);
    for k in 0..=DIRECTIONS {
        let slope = (of(k + 1) - of(k + DIRECTIONS - 1)) / (2.0 * step);
        let normal = direction(k % DIRECTIONS);
        let point = normal * of(k) + normal.perp() * slope;
        along += outline.last().map_or(0.0, |(_, last)| last.distance(point));
        outline.push((along, point));
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
