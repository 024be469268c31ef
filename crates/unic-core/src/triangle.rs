//! Closest point on one triangle.

use crate::bvh::{Aabb, Ray, lower, squared_length, upper};
use glam::Vec3;

/// Height over longest edge below which a triangle counts as its edges: in f32 the direction of
/// its normal is noise, while its edges lie within a ten-thousandth of their length of its inside.
const LEAST_HEIGHT: f32 = 1e-4;

/// What part of a triangle a closest point lies on. Vertices are numbered 0, 1, 2; edge k runs from
/// vertex k to vertex k + 1 (mod 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Inside.
    Face,
    /// Between the ends of an edge.
    Edge(u8),
    /// At a vertex.
    Vertex(u8),
}

/// Closest point of a triangle to a point p.
#[derive(Clone, Copy, Debug)]
pub struct TrianglePoint {
    /// Closest point minus p, metres.
    pub offset: Vec3,
    /// |offset|², m²; NaN for a triangle that is not finite.
    pub squared_distance: f32,
    /// Weights of the corners: none negative, sum one.
    pub barycentric: Vec3,
    /// The part of the triangle that the point lies on.
    pub feature: Feature,
}

/// A posed triangle, ready for queries: two cache lines.
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
    /// From `first` on.
    corners: [Vec3; 3],
    /// From the first corner to the second and the third.
    sides: [Vec3; 2],
    /// Their lengths, m².
    squared_sides: [f32; 2],
    /// (second side − first side) · first side, m².
    turn: f32,
    /// 1 / |edge|² of the edges from the first to the second corner, to the third, and between them;
    /// zero for an edge without length.
    inverse_edges: [f32; 3],
    /// Gradients over the plane of the weights of the second and third corner, 1/m.
    gradients: [Vec3; 2],
    /// The normal with twice the area for its length, m²; zero when degenerate.
    area_normal: Vec3,
    /// The number of the first corner. A degenerate triangle is its longest edge, and that begins here.
    first: u8,
    is_degenerate: bool,
}

/// The nearest point of a triangle, before anybody asks what it lies on.
#[derive(Clone, Copy)]
pub(crate) struct Nearest {
    offset: Vec3,
    pub(crate) squared_distance: f32,
    /// Of the second and third corner.
    weights: [f32; 2],
    /// On the edge from the first corner to the second, to the third, and between them.
    is_on: [bool; 3],
}

impl Triangle {
    /// From its corners, metres. One with a corner that is not finite is never near anything.
    #[inline(always)]
    pub fn new(corners: [Vec3; 3]) -> Self {
        let mut triangle = Self::default();
        triangle.pose(corners);
        triangle
    }

    /// Becomes the triangle between these corners.
    // Inlined and field by field: a triangle made elsewhere and copied costs twice as much.
    #[inline(always)]
    pub(crate) fn pose(&mut self, [a, b, c]: [Vec3; 3]) {
        // NaN if anything is not finite: such a number times zero is.
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
        let least_area = LEAST_HEIGHT * longest;
        // |normal| = longest edge · height over it.
        let is_sound = area > least_area * least_area && inverse_area.is_finite();
        if is_sound && poison == 0.0 {
            self.prepare([a, b, c], squared, normal, inverse_area);
            (self.first, self.is_degenerate) = (0, false);
        } else {
            self.degenerate([a + poison, b + poison, c + poison], squared);
        }
    }

    #[inline(always)]
    fn prepare(&mut self, [a, b, c]: [Vec3; 3], squared: [f32; 3], area_normal: Vec3, inverse_area: f32) {
        let sides = [b - a, c - a];
        let inverse = |x: f32| if x > f32::MIN_POSITIVE { x.recip() } else { 0.0 };
        self.corners = [a, b, c];
        self.sides = sides;
        self.squared_sides = [squared[0], squared[2]];
        self.turn = (c - b).dot(sides[0]);
        self.inverse_edges = [inverse(squared[0]), inverse(squared[2]), inverse(squared[1])];
        self.gradients = [
            sides[1].cross(area_normal) * inverse_area,
            area_normal.cross(sides[0]) * inverse_area,
        ];
        self.area_normal = area_normal;
    }

    #[cold]
    #[inline(never)]
    fn degenerate(&mut self, corners: [Vec3; 3], squared: [f32; 3]) {
        let first = (1..3).fold(0, |best, k| if squared[k] > squared[best] { k } else { best });
        let turned = [0, 1, 2].map(|k| (first + k) % 3);
        let (corners, squared) = (turned.map(|k| corners[k]), turned.map(|k| squared[k]));
        self.prepare(corners, squared, Vec3::ZERO, 0.0);
        (self.first, self.is_degenerate) = (first as u8, true);
    }

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
            min: lower(lower(a, b), c),
            max: upper(upper(a, b), c),
        }
    }

    /// The normal with twice the area for its length, m²; zero when degenerate.
    pub(crate) fn area_normal(&self) -> Vec3 {
        self.area_normal
    }

    /// Unit normal; zero when degenerate.
    pub fn normal(&self) -> Vec3 {
        self.area_normal.normalize_or_zero()
    }

    /// Where a ray passes through, as a multiple of its direction, and the cosine of direction and
    /// normal times their lengths: positive from behind. None past it, before the ray's origin,
    /// or for a degenerate triangle.
    ///
    /// Corners are taken relative to the origin, so that the three volumes whose signs decide have
    /// the same bits for the two triangles at an edge: no ray slips between them.
    pub(crate) fn crossing(&self, ray: &Ray) -> Option<(f32, f32)> {
        let [a, b, c] = self.corners;
        let [a, b, c] = [a - ray.origin, b - ray.origin, c - ray.origin];
        let along = ray.direction.dot(self.area_normal);
        let t = a.dot(self.area_normal) / along;
        let side = |u: Vec3, v: Vec3| ray.direction.dot(u.cross(v));
        let sides = [side(a, b), side(b, c), side(c, a)];
        let through = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
        (through && t >= 0.0 && along != 0.0).then_some((t, along))
    }

    /// The closest point to `p`, degenerate or not.
    ///
    /// Over the triangle it is p's projection, else the nearest point of an edge that p is beyond.
    /// Everything is computed relative to a corner, so that errors scale with the triangle and
    /// the distance to it, and not with the distance to the origin.
    pub fn closest(&self, p: Vec3) -> TrianglePoint {
        self.named(self.nearest(p))
    }

    /// Free of branches: compiled for many points at once it is vector instructions, and gives each
    /// point the bits that it gets alone.
    #[inline(always)]
    pub(crate) fn nearest(&self, p: Vec3) -> Nearest {
        let q = p - self.corners[0];
        let [s, t] = [q.dot(self.sides[0]), q.dot(self.sides[1])];
        let [v, w] = [q.dot(self.gradients[0]), q.dot(self.gradients[1])];
        let [ss, tt] = self.squared_sides;
        let is_beyond_third = v + w > 1.0;
        // Of two edges that p is beyond, the one over which it lies; the other where it lies over
        // neither, and the corner between them is nearest.
        let is_first = (w < 0.0) & ((v >= 0.0) | (s > 0.0)) & (!is_beyond_third | (s < ss));
        let is_first = is_first | self.is_degenerate;
        let is_second = (v < 0.0) & !is_first & (!is_beyond_third | (t < tt));
        let is_third = is_beyond_third & !is_first & !is_second;
        let on_first = unit(s * self.inverse_edges[0]);
        let on_second = unit(t * self.inverse_edges[1]);
        let on_third = unit((t - s - self.turn) * self.inverse_edges[2]);
        let v = pick(is_first, on_first, pick(is_second, 0.0, v));
        let w = pick(is_first, 0.0, pick(is_second, on_second, w));
        let v = pick(is_third, 1.0 - on_third, v);
        let w = pick(is_third, on_third, w);
        // Rounding may carry a point a hair out of the triangle's box; kept inside, it is never
        // nearer than the box, so that a search over boxes finds the same answer by any route.
        let Aabb { min, max } = self.bounds();
        let offset = self.sides[0] * v + self.sides[1] * w - q;
        let offset = upper(offset, min - p);
        let offset = lower(offset, max - p);
        Nearest {
            offset,
            squared_distance: squared_length(offset),
            weights: [v, w],
            is_on: [is_first, is_second, is_third],
        }
    }

    /// With what it lies on.
    fn named(&self, nearest: Nearest) -> TrianglePoint {
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

// Spelled out as choices: what stands for these in the standard library is not one instruction.

#[inline(always)]
fn pick(condition: bool, a: f32, b: f32) -> f32 {
    if condition { a } else { b }
}

/// Between zero and one.
#[inline(always)]
fn unit(t: f32) -> f32 {
    let t = pick(t > 0.0, t, 0.0);
    pick(t < 1.0, t, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bvh::Bvh, shapes::point};
    use glam::DVec3;
    use proptest::prelude::*;

    /// Distance in f64 by bisecting the triangle's two parameters: convex in each, shares no code.
    fn distance_by_search(p: Vec3, triangle: [Vec3; 3]) -> f64 {
        let [a, b, c] = triangle.map(|v| (v - p).as_dvec3());
        let on_ray = |s: f64| {
            let (start, end) = (a.lerp(b, s), a.lerp(c, s));
            least(|t| DVec3::lerp(start, end, t).length_squared())
        };
        least(on_ray).sqrt()
    }

    /// Least value of a convex function on [0, 1] by ternary search.
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
            // Every other triangle is a sliver, down to exactly degenerate ones.
            let flat = if flat < 0.5 { flat * flat * flat } else { 1.0 };
            let c = a.lerp(b, 0.3).lerp(c, flat);
            let found = Triangle::new([a, b, c]).closest(p);
            let expected = distance_by_search(p, [a, b, c]);
            let tolerance = 2.0 * f64::from(LEAST_HEIGHT);
            prop_assert!((f64::from(found.squared_distance.sqrt()) - expected).abs() < tolerance);
            let blend = a * found.barycentric.x + b * found.barycentric.y + c * found.barycentric.z;
            prop_assert!((blend - p - found.offset).length() < 1e-3);
            prop_assert!(found.barycentric.min_element() >= 0.0);
            prop_assert!((found.barycentric.element_sum() - 1.0).abs() < 1e-6);
        }
    }

    proptest! {
        #[test]
        fn no_closest_point_is_nearer_than_the_box_to_the_bit(
            p in point(1.0), corners in [point(0.5), point(0.5), point(0.5)], level in 0usize..4,
        ) {
            // A triangle in a plane of one axis fills its box as seen from beside that plane.
            let corners = corners.map(|mut c| {
                if level < 3 {
                    c[level] = 0.1;
                }
                c
            });
            let mut tree = Bvh::build(&corners[..1]);
            tree.refit(|_| Aabb::around(&corners));
            let mut reached = false;
            tree.nearest(p, Triangle::new(corners).closest(p).squared_distance, |_, bound| {
                reached = true;
                bound
            });
            prop_assert!(reached);
        }
    }

    #[test]
    fn each_feature_owns_its_region() {
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
    fn points_and_segments_are_triangles_too() {
        let dot = Triangle::new([Vec3::ZERO; 3]).closest(Vec3::X);
        assert_eq!((dot.squared_distance, dot.feature), (1.0, Feature::Vertex(0)));
        let segment = Triangle::new([Vec3::X, Vec3::NEG_X, Vec3::X]).closest(Vec3::Y);
        assert!((segment.squared_distance - 1.0).abs() < 1e-6);
        let broken = Triangle::new([Vec3::X, Vec3::NAN, Vec3::Y]).closest(Vec3::Y);
        assert!(broken.squared_distance.is_nan());
    }
}
