//! Closest point on one triangle.

use crate::bvh::{Ray, squared_length};
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

impl TrianglePoint {
    const NOWHERE: Self = Self {
        offset: Vec3::NAN,
        squared_distance: f32::INFINITY,
        barycentric: Vec3::NAN,
        feature: Feature::Face,
    };
}

/// A posed triangle, ready for queries.
///
/// ```
/// use glam::Vec3;
/// use unic_core::surface::{Feature, Triangle};
///
/// let hit = Triangle::new([Vec3::ZERO, Vec3::X, Vec3::Y]).closest(Vec3::new(0.5, -1.0, 0.0));
/// assert_eq!((hit.offset, hit.feature), (Vec3::Y, Feature::Edge(0)));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    corners: [Vec3; 3],
    /// (b − a) × (c − a), the normal with twice the area for its length; zero when degenerate.
    area_normal: Vec3,
}

impl Triangle {
    /// From its corners, metres. One with a corner that is not finite is never near anything.
    pub fn new(corners: [Vec3; 3]) -> Self {
        if !corners.iter().all(|c| c.is_finite()) {
            return Self {
                corners: [Vec3::NAN; 3],
                area_normal: Vec3::ZERO,
            };
        }
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        let sides = [b - a, c - b, a - c].map(squared_length);
        let longest = sides[0].max(sides[1]).max(sides[2]);
        // |normal| = longest edge · height over it.
        let is_sound = squared_length(normal) > (LEAST_HEIGHT * longest).powi(2);
        Self {
            corners,
            area_normal: if is_sound { normal } else { Vec3::ZERO },
        }
    }

    pub(crate) fn corners(&self) -> [Vec3; 3] {
        self.corners
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
        let [a, b, c] = self.relative_to(ray.origin);
        let along = ray.direction.dot(self.area_normal);
        let t = a.dot(self.area_normal) / along;
        let side = |u: Vec3, v: Vec3| ray.direction.dot(u.cross(v));
        let sides = [side(a, b), side(b, c), side(c, a)];
        let through = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
        (through && t >= 0.0 && along != 0.0).then_some((t, along))
    }

    /// The closest point to `p`, degenerate or not.
    ///
    /// Inside the prism over the triangle it is p's projection, else the nearest point of the
    /// edges that p is beyond. Everything is computed relative to `p`, so that errors scale with
    /// the distance to the triangle and not with the distance to the origin.
    pub fn closest(&self, p: Vec3) -> TrianglePoint {
        let corners = self.relative_to(p);
        let mut found = self.closest_relative(corners);
        // Rounding may carry a point a hair out of the triangle's box; kept inside, it is never
        // nearer than the box, so that a search over boxes finds the same answer by any route.
        let [a, b, c] = corners;
        found.offset = found.offset.max(a.min(b).min(c)).min(a.max(b).max(c));
        found.squared_distance = squared_length(found.offset);
        found
    }

    // Written out: `map` over an array of three is not always inlined here.
    fn relative_to(&self, p: Vec3) -> [Vec3; 3] {
        let [a, b, c] = self.corners;
        [a - p, b - p, c - p]
    }

    /// For corners relative to the query point.
    fn closest_relative(&self, corners: [Vec3; 3]) -> TrianglePoint {
        let ([a, b, c], normal) = (corners, self.area_normal);
        let inverse = normal.length_squared().recip();
        if !inverse.is_finite() {
            return closest_on_edges(corners, [true; 3]);
        }
        let v = a.dot(normal.cross(c - a)) * inverse;
        let w = a.dot((b - a).cross(normal)) * inverse;
        let beyond = [w < 0.0, v + w > 1.0, v < 0.0];
        if beyond.contains(&true) {
            return closest_on_edges(corners, beyond);
        }
        TrianglePoint {
            offset: normal * (a.dot(normal) * inverse),
            squared_distance: 0.0,
            barycentric: Vec3::new((1.0 - v - w).max(0.0), v, w),
            feature: Feature::Face,
        }
    }
}

/// Closest point of the chosen edges, one at least.
fn closest_on_edges(corners: [Vec3; 3], chosen: [bool; 3]) -> TrianglePoint {
    let edges = (0..3).filter(|&edge| chosen[usize::from(edge)]);
    let mut best = TrianglePoint::NOWHERE;
    for found in edges.map(|edge| closest_on_edge(corners, edge)) {
        if found.squared_distance < best.squared_distance {
            best = found;
        }
    }
    best
}

fn closest_on_edge(corners: [Vec3; 3], edge: u8) -> TrianglePoint {
    let (start, end) = (usize::from(edge), usize::from(edge + 1) % 3);
    let (a, along) = (corners[start], corners[end] - corners[start]);
    let squared = along.length_squared();
    let t = if squared > 0.0 {
        -a.dot(along) / squared
    } else {
        0.0
    };
    let mut barycentric = [0.0; 3];
    let (t, feature) = if t <= 0.0 {
        (0.0, Feature::Vertex(start as u8))
    } else if t >= 1.0 {
        (1.0, Feature::Vertex(end as u8))
    } else {
        (t, Feature::Edge(edge))
    };
    barycentric[start] = 1.0 - t;
    barycentric[end] = t;
    // The far end itself, not the near one plus the edge, which rounds.
    let offset = if t == 1.0 { corners[end] } else { a + along * t };
    TrianglePoint {
        offset,
        squared_distance: squared_length(offset),
        barycentric: barycentric.into(),
        feature,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bvh::{Aabb, Bvh},
        shapes::point,
    };
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
