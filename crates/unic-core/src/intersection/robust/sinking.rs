//! Cloth inside body parts that may not push it: it sinks towards the parts that carry it.

use super::{MAX_ITERATIONS, MIN_RIM_COSINE, RobustBody, RobustIntersection};
use crate::surface::SurfacePoint;
use glam::Vec3;

/// Largest distance that cloth sinks, metres; limbs are thinner. Cloth inside a limb that points
/// away from the carrying parts leaves it by the nearest side instead.
const MAX_SINK_M: f32 = 0.1;

/// Height over the part beneath at which a vertex in a sliver of an intruding part ends, as a
/// fraction of its depth in the sliver.
const SLIVER_FRACTION: f32 = 0.8;

/// Height over the margin up to which a vertex counts as lying on the pushing parts, metres.
const TOLERANCE_M: f32 = 1e-5;

/// Closest points to a vertex inside a part that may not push it.
#[derive(Clone, Copy)]
pub(super) struct Surroundings<'a> {
    /// Closest point of the part that may not push the vertex.
    pub(super) intruder: &'a SurfacePoint,
    /// Closest point of the parts that may push the vertex.
    pub(super) beneath: &'a SurfacePoint,
}

impl RobustIntersection {
    /// Moves garment vertex `vertex` at `p` out of a part that may not push it; returns `p` when it
    /// is inside of none. `face` is the closest face of the body, or any.
    ///
    /// A forearm in front of a shirt passes through it. Cloth inside the forearm sinks to the parts
    /// that carry it: along the shortest way to them, until it has left the forearm or lies on
    /// them. There it is hidden, as in a simulation with the same contacts. Its path is continuous
    /// as the forearm comes in from outside.
    pub(super) fn sink(&self, body: &RobustBody, vertex: usize, p: Vec3, face: u32) -> Vec3 {
        let mut at = p;
        let mut hit = body.surface.point_on(face, p);
        for _ in 0..MAX_ITERATIONS {
            let intruder = hit.filter(|hit| {
                hit.signed_distance < 0.0 && !body.contact_filter.face_may_push(hit.face, vertex)
            });
            let Some(intruder) = intruder else {
                break;
            };
            let Some(beneath) = body.closest(vertex, at, u32::MAX) else {
                break;
            };
            let around = Surroundings {
                intruder: &intruder,
                beneath: &beneath,
            };
            let Some(step) = self.sinking_step(body, vertex, at, around) else {
                break;
            };
            at += step;
            hit = body.surface.closest_from(at, intruder.face);
        }
        at
    }

    /// Displacement of a vertex that sinks, metres; none from inside the parts beneath.
    pub(super) fn sinking_step(
        &self,
        body: &RobustBody,
        vertex: usize,
        at: Vec3,
        around: Surroundings,
    ) -> Option<Vec3> {
        let beneath = around.beneath;
        let is_within = beneath.normal.dot(at - beneath.point) < -MIN_RIM_COSINE * beneath.distance;
        (!is_within).then(|| self.step_towards_beneath(body, vertex, at, around))
    }

    fn step_towards_beneath(
        &self,
        body: &RobustBody,
        vertex: usize,
        at: Vec3,
        Surroundings { intruder, beneath }: Surroundings,
    ) -> Vec3 {
        let (depth, height) = (intruder.distance, beneath.distance);
        let direction = (beneath.point - at) / height.max(f32::MIN_POSITIVE);
        // Beyond a rim of the pushing parts the body goes on with other parts, such as a hand after
        // a forearm: there is nothing to sink to.
        if -direction.dot(beneath.normal) < MIN_RIM_COSINE {
            return intruder.normal * (depth + self.margin_m);
        }
        let room = height - self.margin_m;
        if room <= TOLERANCE_M {
            // A sliver of the intruder protrudes from the part into which it has sunk. The vertex
            // sinks below the margin there, to where the part beneath is nearer than the sliver's
            // skin.
            return direction * (height - SLIVER_FRACTION * depth).max(0.0);
        }
        let may_not_push = |face| !body.contact_filter.face_may_push(face, vertex);
        let exit = body
            .surface
            .cast_ray_where(at, direction, room.min(MAX_SINK_M), may_not_push);
        match exit.filter(|exit| exit.cosine > 0.0) {
            // The margin grows with the depth from zero at the skin, so that no vertex jumps there.
            Some(exit) => direction * f32::min(2.0 * exit.distance, exit.distance + self.margin_m).min(room),
            None if room <= MAX_SINK_M => direction * room,
            None => intruder.normal * (depth + self.margin_m),
        }
    }
}
