//! Closest point on one triangle.

use crate::bounds::{Aabb, Ray, squared_length, vec_max, vec_min};
use glam::Vec3;

/// Ratio of height to longest edge below which a triangle is treated as its longest edge.
///
/// The direction of the normal of such a triangle is rounding noise in f32. Its inside is within a
/// ten-thousandth of the edge's length of the edge.
const MIN_RELATIVE_HEIGHT: f32 = 1e-4;

/// Part of a triangle on which a closest point lies.
///
/// Vertices are numbered 0, 1, 2. Edge k runs from vertex k to vertex k + 1 (mod 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Interior of the triangle.
    Face,
    /// Interior of an edge, by number.
    Edge(u8),
    /// Vertex, by number.
    Vertex(u8),
}

/// Point of a triangle that is closest to a query point p.
#[derive(Clone, Copy, Debug)]
pub struct TrianglePoint {
    /// Closest point minus p, metres.
    pub offset: Vec3,
    /// |offset|², m²; NaN for a triangle that is not finite.
    pub squared_distance: f32,
    /// Barycentric coordinates: no weight is negative, and they sum to one.
    pub barycentric: Vec3,
    /// Part of the triangle on which the point lies.
    pub feature: Feature,
}

/// Triangle with precomputed values for closest-point and ray queries; it takes two cache lines.
///
/// ```
/// use glam::Vec3;
/// use unic_core::surface::{Feature, Triangle};
///
/// let hit = Triangle::new([Vec3::ZERO, Vec3::X, Vec3::Y]).closest(Vec3::new(0.5, -1.0, 0.0));
/// assert_eq!((hit.offset, hit.feature), (Vec3::Y, Feature::Edge(0)));
/// ```
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(128))]
pub struct Triangle {
    /// Corners in cyclic order from number `first` on.
    corners: [Vec3; 3],
    /// Vectors from `corners[0]` to `corners[1]` and to `corners[2]`, metres.
    sides: [Vec3; 2],
    /// Squared lengths of `sides`, m².
    squared_sides: [f32; 2],
    /// (sides[1] − sides[0]) · sides[0], m².
    opposite_dot_first: f32,
    /// 1 / |edge|² of `sides[0]`, of `sides[1]` and of the edge between their ends; zero for an
    /// edge without length.
    inverse_edges: [f32; 3],
    /// Gradients in the plane of the barycentric weights of `corners[1]` and `corners[2]`, 1/m.
    gradients: [Vec3; 2],
    /// Normal whose length is twice the area, m²; zero for a degenerate triangle.
    area_normal: Vec3,
    /// Number of the corner in `corners[0]`. A degenerate triangle starts with its longest edge.
    first: u8,
    is_degenerate: bool,
}

/// Nearest point of a triangle in the order of [`Triangle`]'s own corners, without its [`Feature`].
#[derive(Clone, Copy)]
pub(crate) struct Nearest {
    offset: Vec3,
    pub(crate) squared_distance: f32,
    /// Barycentric weights of the second and third corner.
    weights: [f32; 2],
    /// Flags of the edges on which the point lies: from the first corner to the second, from the
    /// first to the third, and between these two.
    is_on: [bool; 3],
}

impl Triangle {
    /// Creates the triangle between three corners, metres.
    ///
    /// A triangle with a corner that is not finite is at distance NaN from everything.
    #[inline(always)]
    pub fn new(corners: [Vec3; 3]) -> Self {
        let mut triangle = Self::default();
        triangle.pose(corners);
        triangle
    }

    /// Moves the triangle to new corners, metres.
    // Inlined, and written field by field: a triangle made elsewhere and copied costs twice as
    // much.
    #[inline(always)]
    pub(crate) fn pose(&mut self, [a, b, c]: [Vec3; 3]) {
        // Zero times a number that is not finite is NaN: one test instead of nine.
        let poison = ((a + b + c) * 0.0).element_sum();
        let normal = (b - a).cross(c - a);
        let squared = [
            squared_length(b - a),
            squared_length(c - b),
            squared_length(a - c),
        ];
        let longest = squared[0].max(squared[1]).max(squared[2]);
        let area = squared_length(normal);
        let inverse_area = area.recip();
        // |normal| is longest edge times height, so it is compared with ratio times longest edge²;
        // both sides are squared.
        let min_area = MIN_RELATIVE_HEIGHT * longest;
        let is_sound = area > min_area * min_area && inverse_area.is_finite();
        if is_sound && poison == 0.0 {
            self.prepare([a, b, c], squared, normal, inverse_area);
            (self.first, self.is_degenerate) = (0, false);
        } else {
            self.pose_degenerate([a + poison, b + poison, c + poison], squared);
        }
    }

    /// Computes what queries need, from the corners and the squared lengths of the edges ab, bc,
    /// ca.
    #[inline(always)]
    fn prepare(&mut self, [a, b, c]: [Vec3; 3], squared: [f32; 3], area_normal: Vec3, inverse_area: f32) {
        let sides = [b - a, c - a];
        let inverse = |x: f32| if x > f32::MIN_POSITIVE { x.recip() } else { 0.0 };
        self.corners = [a, b, c];
        self.sides = sides;
        self.squared_sides = [squared[0], squared[2]];
        self.opposite_dot_first = (c - b).dot(sides[0]);
        self.inverse_edges = [inverse(squared[0]), inverse(squared[2]), inverse(squared[1])];
        self.gradients = [
            sides[1].cross(area_normal) * inverse_area,
            area_normal.cross(sides[0]) * inverse_area,
        ];
        self.area_normal = area_normal;
    }

    /// Stores a triangle that queries treat as its longest edge.
    #[cold]
    #[inline(never)]
    fn pose_degenerate(&mut self, corners: [Vec3; 3], squared: [f32; 3]) {
        let first = (1..3).fold(0, |best, k| if squared[k] > squared[best] { k } else { best });
        let rotated = [0, 1, 2].map(|k| (first + k) % 3);
        let (corners, squared) = (rotated.map(|k| corners[k]), rotated.map(|k| squared[k]));
        self.prepare(corners, squared, Vec3::ZERO, 0.0);
        (self.first, self.is_degenerate) = (first as u8, true);
    }

    /// Corners in the order in which they were given.
    #[inline(always)]
    pub(crate) fn corners(&self) -> [Vec3; 3] {
        let [a, b, c] = self.corners;
        match self.first {
            0 => [a, b, c],
            1 => [c, a, b],
            _ => [b, c, a],
        }
    }

    #[inline(always)]
    pub(crate) fn bounds(&self) -> Aabb {
        let [a, b, c] = self.corners;
        Aabb {
            min: vec_min(vec_min(a, b), c),
            max: vec_max(vec_max(a, b), c),
        }
    }

    /// Normal whose length is twice the area, m²; zero for a degenerate triangle.
    pub(crate) fn area_normal(&self) -> Vec3 {
        self.area_normal
    }

    /// Unit normal; zero for a degenerate triangle.
    pub fn normal(&self) -> Vec3 {
        self.area_normal.normalize_or_zero()
    }

    /// Intersects the triangle with a ray.
    ///
    /// Returns none for a miss, for a crossing before the ray's origin and for a degenerate
    /// triangle.
    ///
    /// Corners are taken relative to the origin, so that the three volumes whose signs decide have
    /// the same bits for the two triangles at an edge: no ray slips between them.
    pub(crate) fn crossing(&self, ray: &Ray) -> Option<Crossing> {
        let [a, b, c] = self.corners;
        let [a, b, c] = [a - ray.origin, b - ray.origin, c - ray.origin];
        let dot_area_normal = ray.direction.dot(self.area_normal);
        let t = a.dot(self.area_normal) / dot_area_normal;
        let side = |u: Vec3, v: Vec3| ray.direction.dot(u.cross(v));
        let sides = [side(a, b), side(b, c), side(c, a)];
        let through = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
        let is_crossing = through && t >= 0.0 && dot_area_normal != 0.0;
        is_crossing.then_some(Crossing { t, dot_area_normal })
    }

    /// Returns the closest point to `p`; the triangle may be degenerate.
    ///
    /// It is the projection of `p` where that lies in the triangle, else the nearest point of an
    /// edge. Everything is computed relative to a corner, so that errors scale with the triangle
    /// and the distance to it, and not with the distance to the origin.
    pub fn closest(&self, p: Vec3) -> TrianglePoint {
        self.with_feature(self.nearest(p))
    }

    /// Computes the closest point to `p` without branches.
    ///
    /// A loop over many points compiles to vector instructions, and gives each point the same bits
    /// as a call for it alone.
    #[inline(always)]
    pub(crate) fn nearest(&self, p: Vec3) -> Nearest {
        let q = p - self.corners[0];
        let [s, t] = [q.dot(self.sides[0]), q.dot(self.sides[1])];
        let [v, w] = [q.dot(self.gradients[0]), q.dot(self.gradients[1])];
        let [ss, tt] = self.squared_sides;
        let is_beyond_third = v + w > 1.0;
        // The projection may lie beyond two edges. The nearest point is then on the edge onto which
        // it projects; if it projects onto neither, the nearest point is their corner, on both.
        let is_first = (w < 0.0) & ((v >= 0.0) | (s > 0.0)) & (!is_beyond_third | (s < ss));
        let is_first = is_first | self.is_degenerate;
        let is_second = (v < 0.0) & !is_first & (!is_beyond_third | (t < tt));
        let is_third = is_beyond_third & !is_first & !is_second;
        let on_first = unit(s * self.inverse_edges[0]);
        let on_second = unit(t * self.inverse_edges[1]);
        let on_third = unit((t - s - self.opposite_dot_first) * self.inverse_edges[2]);
        let v = select(is_first, on_first, select(is_second, 0.0, v));
        let w = select(is_first, 0.0, select(is_second, on_second, w));
        let v = select(is_third, 1.0 - on_third, v);
        let w = select(is_third, on_third, w);
        // Rounding may move the point slightly out of the triangle's box. Clamped to the box it is
        // never nearer than the box, so the order in which a tree is searched does not change the
        // answer.
        let Aabb { min, max } = self.bounds();
        let offset = self.sides[0] * v + self.sides[1] * w - q;
        let offset = vec_max(offset, min - p);
        let offset = vec_min(offset, max - p);
        Nearest {
            offset,
            squared_distance: squared_length(offset),
            weights: [v, w],
            is_on: [is_first, is_second, is_third],
        }
    }

    /// Adds the feature and the barycentric coordinates in the given order of the corners.
    fn with_feature(&self, nearest: Nearest) -> TrianglePoint {
        let [v, w] = nearest.weights;
        let (weights, edge) = match nearest.is_on {
            [true, ..] => ([1.0 - v, v, 0.0], Some(0)),
            [_, true, _] => ([1.0 - w, 0.0, w], Some(2)),
            [.., true] => ([0.0, v, w], Some(1)),
            _ => ([(1.0 - v - w).max(0.0), v, w], None),
        };
        let corner = |k: usize| (usize::from(self.first) + k) % 3;
        let mut barycentric = [0.0; 3];
        (0..3).for_each(|k| barycentric[corner(k)] = weights[k]);
        let at_a_corner = (0..3).find(|&k| weights[k] == 1.0);
        let feature = match (edge, at_a_corner) {
            (None, _) => Feature::Face,
            (Some(_), Some(k)) => Feature::Vertex(corner(k) as u8),
            (Some(edge), None) => Feature::Edge(corner(edge) as u8),
        };
        TrianglePoint {
            offset: nearest.offset,
            squared_distance: nearest.squared_distance,
            barycentric: barycentric.into(),
            feature,
        }
    }
}

/// Point at which a ray passes through a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// Distance from the ray's origin as a multiple of its direction.
    pub(crate) t: f32,
    /// Dot product of the ray's direction and [`Triangle::area_normal`]: positive where the ray
    /// comes from the inner side.
    pub(crate) dot_area_normal: f32,
}

// Written as selections, which compile to one instruction each; `f32::clamp` does not.

#[inline(always)]
fn select(condition: bool, a: f32, b: f32) -> f32 {
    if condition { a } else { b }
}

/// Clamps to 0..1. NaN becomes 0.
#[inline(always)]
fn unit(t: f32) -> f32 {
    let t = select(t > 0.0, t, 0.0);
    select(t < 1.0, t, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::point;
    use glam::DVec3;
    use proptest::prelude::*;

    /// Distance in f64 by nested searches over the triangle's two parameters, an oracle without
    /// shared code: the distance is convex in each.
    fn distance_by_search(p: Vec3, triangle: [Vec3; 3]) -> f64 {
        let [a, b, c] = triangle.map(|v| (v - p).as_dvec3());
        let on_ray = |s: f64| {
            let (start, end) = (a.lerp(b, s), a.lerp(c, s));
            least(|t| DVec3::lerp(start, end, t).length_squared())
        };
        least(on_ray).sqrt()
    }

    /// Minimum of a convex function on [0, 1] by ternary search.
    fn least(f: impl Fn(f64) -> f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..80 {
            let third = (high - low) / 3.0;
            if f(low + third) < f(high - third) {
                high -= third;
            } else {
                low += third;
            }
        }
        f(0.5 * (low + high))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        #[test]
        fn agrees_with_a_search_over_the_triangle(
            p in point(1.0), a in point(0.5), b in point(0.5), c in point(0.5), flat in 0.0f32..1.0,
        ) {
            // Half of the triangles are slivers, down to exactly degenerate ones.
            let flat = if flat < 0.5 { flat * flat * flat } else { 1.0 };
            let c = a.lerp(b, 0.3).lerp(c, flat);
            let found = Triangle::new([a, b, c]).closest(p);
            let expected = distance_by_search(p, [a, b, c]);
            let tolerance = 2.0 * f64::from(MIN_RELATIVE_HEIGHT);
            prop_assert!((f64::from(found.squared_distance.sqrt()) - expected).abs() < tolerance);
            let blend = a * found.barycentric.x + b * found.barycentric.y + c * found.barycentric.z;
            prop_assert!((blend - p - found.offset).length() < 1e-3);
            prop_assert!(found.barycentric.min_element() >= 0.0);
            prop_assert!((found.barycentric.element_sum() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn each_feature_is_closest_in_its_region() {
        let triangle = Triangle::new([Vec3::ZERO, Vec3::X, Vec3::Y]);
        let feature = |x, y| triangle.closest(Vec3::new(x, y, 0.7)).feature;
        assert_eq!(feature(0.2, 0.2), Feature::Face);
        assert_eq!(feature(0.5, -0.1), Feature::Edge(0));
        assert_eq!(feature(0.8, 0.8), Feature::Edge(1));
        assert_eq!(feature(-0.1, 0.5), Feature::Edge(2));
        assert_eq!(feature(-0.1, -0.1), Feature::Vertex(0));
        assert_eq!(feature(1.5, 0.0), Feature::Vertex(1));
        assert_eq!(feature(0.0, 1.5), Feature::Vertex(2));
    }

    #[test]
    fn degenerate_triangles_are_points_or_segments() {
        let dot = Triangle::new([Vec3::ZERO; 3]).closest(Vec3::X);
        assert_eq!((dot.squared_distance, dot.feature), (1.0, Feature::Vertex(0)));
        let segment = Triangle::new([Vec3::X, Vec3::NEG_X, Vec3::X]).closest(Vec3::Y);
        assert!((segment.squared_distance - 1.0).abs() < 1e-6);
        let broken = Triangle::new([Vec3::X, Vec3::NAN, Vec3::Y]).closest(Vec3::Y);
        assert!(broken.squared_distance.is_nan());
    }
}
