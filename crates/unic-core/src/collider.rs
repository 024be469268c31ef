//! Solid objects besides the body that push a garment: the ground, furniture, props.
//!
//! For engines, through [`Animator::set_colliders`](crate::Animator::set_colliders).
//!
//! ```
//! use glam::Vec3;
//! use unic_core::collider::Collider;
//!
//! let ball = Collider::sphere(0.1, Vec3::Y);
//! let p = Vec3::new(0.0, 1.05, 0.0);
//! // Out of the ball, to 3 mm over its surface.
//! assert!(ball.push_out(p, 0.003).unwrap().distance(Vec3::Y * 1.103) < 1e-6);
//! assert_eq!(ball.push_out(Vec3::Y * 2.0, 0.003), None);
//! ```

use crate::{
    surface::{Surface, Triangle, TrianglePoint},
    transform::Rigid,
};
use glam::{Quat, Vec3};
use std::sync::Arc;

/// Smallest cosine between the direction to the closest point of a mesh and the normal there.
///
/// Below it the point is beyond a rim of an open mesh, and not under its surface.
const MIN_RIM_COSINE: f32 = 0.3;

/// Distance to a surface below which the normal replaces the direction to the closest point,
/// metres: rounding makes the direction of such a short vector random.
const MIN_DISTANCE_M: f32 = 1e-4;

/// Number of bisections of a capsule's axis in the search for its point nearest to a triangle. They
/// narrow a metre to less than a hundredth of a millimetre.
const BISECTIONS: usize = 17;

/// Solid shape in its own frame, metres.
#[derive(Clone, Debug)]
pub enum ColliderShape {
    /// Half space below y = 0.
    HalfSpace,
    /// Sphere around the origin.
    Sphere {
        /// Radius, metres.
        radius_m: f32,
    },
    /// Capsule around a segment of the y axis that is centred at the origin.
    Capsule {
        /// Radius, metres.
        radius_m: f32,
        /// Distance from the origin to the centre of each end, metres.
        half_length_m: f32,
    },
    /// Inner side of a mesh with outward normals. The mesh may be open.
    Mesh(Arc<Surface>),
}

/// Solid shape with its place in the world.
#[derive(Clone, Debug)]
pub struct Collider {
    /// Shape in the collider's own frame; copies share a mesh.
    pub shape: ColliderShape,
    /// Transform into world space; set it in every frame in which the collider moves.
    pub world_from_collider: Rigid,
}

impl Collider {
    /// Level ground at a height in world space, metres.
    pub fn ground(height_m: f32) -> Self {
        Self {
            shape: ColliderShape::HalfSpace,
            world_from_collider: Rigid::new(Quat::IDENTITY, Vec3::Y * height_m),
        }
    }

    /// Sphere in world space, metres.
    pub fn sphere(radius_m: f32, centre: Vec3) -> Self {
        Self {
            shape: ColliderShape::Sphere { radius_m },
            world_from_collider: Rigid::new(Quat::IDENTITY, centre),
        }
    }

    /// Capsule in world space with an axis from one point to another, metres.
    pub fn capsule(radius_m: f32, from: Vec3, to: Vec3) -> Self {
        let axis = (to - from).try_normalize().unwrap_or(Vec3::Y);
        Self {
            shape: ColliderShape::Capsule {
                radius_m,
                half_length_m: 0.5 * from.distance(to),
            },
            world_from_collider: Rigid::new(Quat::from_rotation_arc(Vec3::Y, axis), 0.5 * (from + to)),
        }
    }

    /// Mesh with a transform into world space.
    pub fn mesh(surface: Arc<Surface>, world_from_collider: Rigid) -> Self {
        Self {
            shape: ColliderShape::Mesh(surface),
            world_from_collider,
        }
    }

    /// Pushes a point in world space that is lower than `margin_m` over the surface to that height,
    /// along the shortest way. None when the point is high enough.
    pub fn push_out(&self, p: Vec3, margin_m: f32) -> Option<Vec3> {
        let local = self.world_from_collider.inverse().point(p);
        let out = match &self.shape {
            ColliderShape::HalfSpace => (local.y < margin_m).then(|| local.with_y(margin_m)),
            ColliderShape::Mesh(surface) => push_out_of_mesh(surface, local, margin_m),
            _ => {
                let AxisPoint { point, radius_m } = self.nearest_axis_point(local)?;
                let offset = local - point;
                // On the axis itself every direction is as short.
                let direction = offset.try_normalize().unwrap_or(Vec3::X);
                (offset.length() < radius_m + margin_m).then(|| point + direction * (radius_m + margin_m))
            }
        };
        out.map(|out| self.world_from_collider.point(out))
    }

    /// Finds the point of a garment triangle that is deepest in a sphere or capsule.
    ///
    /// None for other shapes, and for a triangle that is high enough everywhere.
    pub(crate) fn push_face_out(&self, corners: [Vec3; 3], margin_m: f32) -> Option<DeepestPoint> {
        let collider_from_world = self.world_from_collider.inverse();
        let local = corners.map(|p| collider_from_world.point(p));
        let AxisPoint { point, radius_m } = self.nearest_axis_point(local[0])?;
        // Broad phase: no point of the triangle is farther from its first corner than its longest
        // side.
        let longest = local[0].distance(local[1]).max(local[0].distance(local[2]));
        if local[0].distance(point) > radius_m + margin_m + longest {
            return None;
        }
        let triangle = Triangle::new(local);
        let hit = nearest_to_axis(&triangle, self.half_length_m());
        let distance = hit.squared_distance.sqrt();
        // A triangle that crosses the axis is pushed to either side: both are as near.
        let direction = hit.offset.try_normalize().unwrap_or_else(|| triangle.normal());
        let depth = radius_m + margin_m - distance;
        (depth > 0.0).then(|| DeepestPoint {
            barycentric: hit.barycentric,
            push: self.world_from_collider.vector(direction * depth),
        })
    }

    /// Point of the axis of a capsule, or the centre of a sphere, that is nearest to a local point.
    fn nearest_axis_point(&self, local: Vec3) -> Option<AxisPoint> {
        let half = self.half_length_m();
        match self.shape {
            ColliderShape::Sphere { radius_m } | ColliderShape::Capsule { radius_m, .. } => {
                let point = Vec3::Y * local.y.clamp(-half, half);
                Some(AxisPoint { point, radius_m })
            }
            _ => None,
        }
    }

    fn half_length_m(&self) -> f32 {
        match self.shape {
            ColliderShape::Capsule { half_length_m, .. } => half_length_m.max(0.0),
            _ => 0.0,
        }
    }
}

/// Point of a triangle that is deepest in a collider.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeepestPoint {
    /// Barycentric coordinates of the point.
    pub(crate) barycentric: Vec3,
    /// Vector that takes the point to the margin, world space, metres.
    pub(crate) push: Vec3,
}

/// Point of the axis of a sphere or capsule, in the collider's own frame.
struct AxisPoint {
    point: Vec3,
    radius_m: f32,
}

/// Returns the point of a triangle that is nearest to the segment of the y axis from −`half` to
/// `half`, with its offset from the nearest point of the segment.
///
/// The distance between a convex set and a point that moves along a line is a convex function of
/// the point's position. So bisection follows the side on which the closest point lies.
fn nearest_to_axis(triangle: &Triangle, half: f32) -> TrianglePoint {
    let (mut middle, mut step) = (0.0, half);
    let mut hit = triangle.closest(Vec3::ZERO);
    // The axis of a sphere has no length.
    let bisections = if half > 0.0 { BISECTIONS } else { 0 };
    for _ in 0..bisections {
        step *= 0.5;
        middle += step.copysign(hit.offset.y);
        hit = triangle.closest(Vec3::Y * middle);
    }
    hit
}

/// Does what [`Collider::push_out`] does, in the frame of a mesh.
fn push_out_of_mesh(surface: &Surface, local: Vec3, margin_m: f32) -> Option<Vec3> {
    let hit = surface.closest(local)?;
    if hit.signed_distance >= margin_m {
        return None;
    }
    let direction = match hit.distance < MIN_DISTANCE_M {
        true => hit.normal,
        // The sign of the distance turns the direction outwards from both sides.
        false => (local - hit.point) / hit.signed_distance,
    };
    (direction.dot(hit.normal) > MIN_RIM_COSINE).then(|| hit.point + direction * margin_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::{cube, point, sphere};
    use proptest::prelude::*;

    const MARGIN_M: f32 = 0.003;

    fn placed(axis: Vec3, angle: f32, at: Vec3) -> Rigid {
        Rigid::new(
            Quat::from_axis_angle(axis.try_normalize().unwrap_or(Vec3::X), angle),
            at,
        )
    }

    proptest! {
        #[test]
        fn points_below_the_margin_are_pushed_to_it_and_others_stay(
            p in point(0.4), from in point(0.2), to in point(0.2), height in -0.2f32..0.2,
        ) {
            let ground = Collider::ground(height);
            let expected = (p.y < height + MARGIN_M).then(|| p.with_y(height + MARGIN_M));
            let found = ground.push_out(p, MARGIN_M);
            prop_assert_eq!(found.is_some(), expected.is_some());
            prop_assert!(found.unwrap_or(p).distance(expected.unwrap_or(p)) < 1e-6);

            for (collider, core) in [
                (Collider::sphere(0.1, from), [from, from]),
                (Collider::capsule(0.1, from, to), [from, to]),
            ] {
                let axis = core[1] - core[0];
                let along = ((p - core[0]).dot(axis) / axis.length_squared().max(1e-12)).clamp(0.0, 1.0);
                let nearest = core[0] + axis * along;
                let low = p.distance(nearest) < 0.1 + MARGIN_M - 1e-5;
                let high = p.distance(nearest) > 0.1 + MARGIN_M + 1e-5;
                match collider.push_out(p, MARGIN_M) {
                    None => prop_assert!(!low),
                    Some(out) => {
                        prop_assert!(!high);
                        prop_assert!((out.distance(nearest) - 0.1 - MARGIN_M).abs() < 1e-5);
                        prop_assert!((out - nearest).angle_between(p - nearest) < 1e-2 || p.distance(nearest) < 1e-3);
                    }
                }
            }
        }

        #[test]
        fn a_sphere_mesh_pushes_like_a_sphere(p in point(0.2), axis in point(1.0), angle in -3.0f32..3.0) {
            let at = Vec3::new(3.0, 1.0, -2.0);
            let mesh = Collider::mesh(Arc::new(Surface::build(&sphere(4, 0.15))), placed(axis, angle, at));
            let ball = Collider::sphere(0.15, at);
            let [of_mesh, of_ball] = [&mesh, &ball].map(|c| c.push_out(p + at, MARGIN_M).unwrap_or(p + at));
            // Facets lie up to this far inside the ball. The depth of a facet changes which one is
            // nearest to a point, by an angle that grows as the point nears the centre.
            let sagitta = 2e-4;
            prop_assert!((of_mesh.distance(at) - of_ball.distance(at)).abs() < sagitta);
            prop_assert!(of_mesh.distance(of_ball) < 0.15 * (2.0 * sagitta / p.length()).sqrt());
        }

        #[test]
        fn no_point_of_a_triangle_is_deeper_than_the_one_found(
            a in point(0.3), b in point(0.3), c in point(0.3), u in 0.0f32..1.0, v in 0.0f32..1.0, to in point(0.2),
        ) {
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let p = a + (b - a) * u + (c - a) * v;
            for collider in [Collider::sphere(0.1, to), Collider::capsule(0.1, Vec3::ZERO, to)] {
                let deepest = collider.push_face_out([a, b, c], 0.0).map_or(0.0, |deepest| deepest.push.length());
                let depth = collider.push_out(p, 0.0).map_or(0.0, |out| out.distance(p));
                prop_assert!(depth <= deepest + 2e-5, "{} deeper than {}", depth, deepest);
            }
        }
    }

    #[test]
    fn a_box_pushes_through_its_nearest_side() {
        let turned = placed(Vec3::Y, std::f32::consts::FRAC_PI_2, Vec3::X * 10.0);
        let collider = Collider::mesh(Arc::new(Surface::build(&cube())), turned);
        let out = collider.push_out(Vec3::new(10.9, 0.1, 0.2), MARGIN_M).unwrap();
        assert!(out.distance(Vec3::new(11.0 + MARGIN_M, 0.1, 0.2)) < 1e-5, "{out}");
    }
}
