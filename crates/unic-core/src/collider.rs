//! What a garment stays out of besides the body: the ground, furniture, things that are carried.
//!
//! ```
//! use glam::Vec3;
//! use unic_core::collider::Collider;
//!
//! let ball = Collider::sphere(0.1, Vec3::Y);
//! let p = Vec3::new(0.0, 1.05, 0.0);
//! // Out of the ball to 3 mm over it.
//! assert!(ball.way_out(p, 0.003).unwrap().distance(Vec3::Y * 1.103) < 1e-6);
//! assert_eq!(ball.way_out(Vec3::Y * 2.0, 0.003), None);
//! ```

use crate::{
    surface::{Surface, Triangle, TrianglePoint},
    transform::Rigid,
};
use glam::{Quat, Vec3};
use std::sync::Arc;

/// Cosine between the way to the closest point of a mesh and the normal there below which a place is
/// beyond a rim of the mesh.
const LEAST_COSINE: f32 = 0.3;

/// Closer to a surface than this the way to it has no direction but the normal, metres.
const LEAST_DISTANCE_M: f32 = 1e-4;

/// Of a capsule's axis, to find its point nearest to a triangle: a metre to less than a hundredth of a
/// millimetre.
const HALVINGS: usize = 17;

/// A shape in its own frame, metres. It is solid.
#[derive(Clone, Debug)]
pub enum ColliderShape {
    /// All that is below y = 0.
    HalfSpace,
    /// Around the origin.
    Sphere {
        /// Metres.
        radius_m: f32,
    },
    /// Around a piece of the y axis, with round ends.
    Capsule {
        /// Metres.
        radius_m: f32,
        /// From the middle to the centre of each end, metres.
        half_length_m: f32,
    },
    /// Inside a mesh with outward normals; an open one has its inner side.
    Mesh(Arc<Surface>),
}

/// A shape and its place.
#[derive(Clone, Debug)]
pub struct Collider {
    /// In its own frame; shared by copies.
    pub shape: ColliderShape,
    /// Set anew in every frame in which it moves.
    pub world_from_collider: Rigid,
}

impl Collider {
    /// Level ground, world space, metres.
    pub fn ground(height_m: f32) -> Self {
        Self {
            shape: ColliderShape::HalfSpace,
            world_from_collider: Rigid::new(Quat::IDENTITY, Vec3::Y * height_m),
        }
    }

    /// A ball, metres.
    pub fn sphere(radius_m: f32, centre: Vec3) -> Self {
        Self {
            shape: ColliderShape::Sphere { radius_m },
            world_from_collider: Rigid::new(Quat::IDENTITY, centre),
        }
    }

    /// A capsule by the ends of its axis, metres.
    pub fn capsule(radius_m: f32, [from, to]: [Vec3; 2]) -> Self {
        let axis = (to - from).try_normalize().unwrap_or(Vec3::Y);
        Self {
            shape: ColliderShape::Capsule {
                radius_m,
                half_length_m: 0.5 * from.distance(to),
            },
            world_from_collider: Rigid::new(Quat::from_rotation_arc(Vec3::Y, axis), 0.5 * (from + to)),
        }
    }

    /// A mesh.
    pub fn mesh(surface: Arc<Surface>, world_from_collider: Rigid) -> Self {
        Self {
            shape: ColliderShape::Mesh(surface),
            world_from_collider,
        }
    }

    /// Where a place in the world goes that is lower than `margin_m` over the surface: along the
    /// shortest way between the two, to that height. None when it stays.
    pub fn way_out(&self, p: Vec3, margin_m: f32) -> Option<Vec3> {
        let local = self.world_from_collider.inverse().point(p);
        let out = match &self.shape {
            ColliderShape::HalfSpace => (local.y < margin_m).then(|| local.with_y(margin_m)),
            ColliderShape::Mesh(surface) => out_of_mesh(surface, local, margin_m),
            _ => {
                let (core, radius) = self.core(local)?;
                let way = local - core;
                let direction = way.try_normalize().unwrap_or(Vec3::X);
                (way.length() < radius + margin_m).then(|| core + direction * (radius + margin_m))
            }
        };
        out.map(|out| self.world_from_collider.point(out))
    }

    /// The point of a garment triangle that is deepest in a round collider, in the world, with the way
    /// that takes it to the margin; none for other shapes and for a triangle that stays.
    pub(crate) fn way_out_of_face(&self, corners: [Vec3; 3], margin_m: f32) -> Option<(TrianglePoint, Vec3)> {
        let collider_from_world = self.world_from_collider.inverse();
        let local = corners.map(|p| collider_from_world.point(p));
        let (core, radius) = self.core(local[0])?;
        let longest = local[0].distance(local[1]).max(local[0].distance(local[2]));
        if local[0].distance(core) > radius + margin_m + longest {
            return None;
        }
        let triangle = Triangle::new(local);
        let hit = nearest_to_axis(&triangle, self.half_length_m());
        let distance = hit.squared_distance.sqrt();
        // Through the axis itself, either side is as near.
        let direction = hit.offset.try_normalize().unwrap_or_else(|| triangle.normal());
        let deep = radius + margin_m - distance;
        (deep > 0.0).then(|| (hit, self.world_from_collider.vector(direction * deep)))
    }

    /// The closest point of what a round collider is around, and its radius.
    fn core(&self, local: Vec3) -> Option<(Vec3, f32)> {
        let half = self.half_length_m();
        match self.shape {
            ColliderShape::Sphere { radius_m } | ColliderShape::Capsule { radius_m, .. } => {
                Some((Vec3::Y * local.y.clamp(-half, half), radius_m))
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

/// The point of a triangle that is nearest to the piece of the y axis from −`half` to `half`, from the
/// nearest place there.
///
/// The distance between a convex set and a place that runs along a line is a convex function of it, so
/// the side on which the closest point lies says where to look on.
fn nearest_to_axis(triangle: &Triangle, half: f32) -> TrianglePoint {
    let (mut middle, mut step) = (0.0, half);
    let mut hit = triangle.closest(Vec3::ZERO);
    // A sphere has no axis to look along.
    let halvings = if half > 0.0 { HALVINGS } else { 0 };
    for _ in 0..halvings {
        step *= 0.5;
        middle += step.copysign(hit.offset.y);
        hit = triangle.closest(Vec3::Y * middle);
    }
    hit
}

fn out_of_mesh(surface: &Surface, local: Vec3, margin_m: f32) -> Option<Vec3> {
    let hit = surface.closest(local)?;
    if hit.signed_distance >= margin_m {
        return None;
    }
    let direction = match hit.distance < LEAST_DISTANCE_M {
        true => hit.normal,
        false => (local - hit.point) / hit.signed_distance,
    };
    (direction.dot(hit.normal) > LEAST_COSINE).then(|| hit.point + direction * margin_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{cube, point, sphere};
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
        fn what_is_low_goes_to_the_margin_and_what_is_high_stays(
            p in point(0.4), from in point(0.2), to in point(0.2), height in -0.2f32..0.2,
        ) {
            let ground = Collider::ground(height);
            let expected = (p.y < height + MARGIN_M).then(|| p.with_y(height + MARGIN_M));
            let found = ground.way_out(p, MARGIN_M);
            prop_assert_eq!(found.is_some(), expected.is_some());
            prop_assert!(found.unwrap_or(p).distance(expected.unwrap_or(p)) < 1e-6);

            for (collider, core) in [
                (Collider::sphere(0.1, from), [from, from]),
                (Collider::capsule(0.1, [from, to]), [from, to]),
            ] {
                let axis = core[1] - core[0];
                let along = ((p - core[0]).dot(axis) / axis.length_squared().max(1e-12)).clamp(0.0, 1.0);
                let nearest = core[0] + axis * along;
                let low = p.distance(nearest) < 0.1 + MARGIN_M - 1e-5;
                let high = p.distance(nearest) > 0.1 + MARGIN_M + 1e-5;
                match collider.way_out(p, MARGIN_M) {
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
        fn a_mesh_pushes_as_the_sphere_that_it_is(p in point(0.2), axis in point(1.0), angle in -3.0f32..3.0) {
            let at = Vec3::new(3.0, 1.0, -2.0);
            let mesh = Collider::mesh(Arc::new(Surface::build(&sphere(4, 0.15))), placed(axis, angle, at));
            let ball = Collider::sphere(0.15, at);
            let [of_mesh, of_ball] = [&mesh, &ball].map(|c| c.way_out(p + at, MARGIN_M).unwrap_or(p + at));
            // Facets lie this much within the ball; which of them is nearest the distance from the middle decides,
            // by its cosine.
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
            for collider in [Collider::sphere(0.1, to), Collider::capsule(0.1, [Vec3::ZERO, to])] {
                let deepest = collider.way_out_of_face([a, b, c], 0.0).map_or(0.0, |(_, way)| way.length());
                let here = collider.way_out(p, 0.0).map_or(0.0, |out| out.distance(p));
                prop_assert!(here <= deepest + 2e-5, "{} deeper than {}", here, deepest);
            }
        }
    }

    #[test]
    fn a_box_pushes_through_its_nearest_side() {
        let turned = placed(Vec3::Y, std::f32::consts::FRAC_PI_2, Vec3::X * 10.0);
        let collider = Collider::mesh(Arc::new(Surface::build(&cube())), turned);
        let out = collider.way_out(Vec3::new(10.9, 0.1, 0.2), MARGIN_M).unwrap();
        assert!(out.distance(Vec3::new(11.0 + MARGIN_M, 0.1, 0.2)) < 1e-5, "{out}");
    }
}
