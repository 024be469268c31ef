//! Parts of the body that pass through the cloth, and the cloth inside them.

use super::{LEAST_COSINE, MOST_LOOKS, RobustBody, RobustIntersection};
use crate::surface::SurfacePoint;
use glam::Vec3;

/// Farthest that cloth sinks, metres: limbs are thinner. Out of one that points away from what carries
/// the cloth it goes by the nearest side.
const SINK_REACH_M: f32 = 0.1;

/// Of the depth in a sliver of a visitor, the height over what it has sunk into.
const SLIVER_SHARE: f32 = 0.8;

/// A place this close to where cloth may lie counts as there, metres.
const TOLERANCE_M: f32 = 1e-5;

impl RobustIntersection {
    /// Where garment vertex `vertex` at `p` goes from inside a part that may not push it; `p` when it
    /// is inside of none. `face` is the closest of the body, or any.
    ///
    /// A forearm in front of a shirt passes through it. What of the cloth is inside the forearm sinks to
    /// the parts that carry it: along the shortest way to them, until it has left the forearm or lies
    /// on them. There it is hidden, as in a simulation with the same contact, and it goes there
    /// continuously as the forearm comes in from outside.
    pub(super) fn sink(&self, body: &RobustBody, vertex: usize, p: Vec3, face: u32) -> Vec3 {
        let mut at = p;
        let mut hit = body.surface.point_on(face, p);
        for _ in 0..MOST_LOOKS {
            let visitor =
                hit.filter(|hit| hit.signed_distance < 0.0 && !body.parts.face_pushes(hit.face, vertex));
            let Some(visitor) = visitor else {
                break;
            };
            let Some(beneath) = body.closest(vertex, at, u32::MAX) else {
                break;
            };
            let Some(way) = self.way_down(body, vertex, at, (&visitor, &beneath)) else {
                break;
            };
            at += way;
            hit = body.surface.closest_from(at, visitor.face);
        }
        at
    }

    /// The way of a vertex inside a visitor towards what lies beneath, by their closest points to it; none
    /// from within what lies beneath.
    pub(super) fn way_down(
        &self,
        body: &RobustBody,
        vertex: usize,
        at: Vec3,
        (visitor, beneath): (&SurfacePoint, &SurfacePoint),
    ) -> Option<Vec3> {
        let is_within = beneath.normal.dot(at - beneath.point) < -LEAST_COSINE * beneath.distance;
        (!is_within).then(|| self.way_towards(body, vertex, at, (visitor, beneath)))
    }

    fn way_towards(
        &self,
        body: &RobustBody,
        vertex: usize,
        at: Vec3,
        (visitor, beneath): (&SurfacePoint, &SurfacePoint),
    ) -> Vec3 {
        let (depth, height) = (visitor.distance, beneath.distance);
        let direction = (beneath.point - at) / height.max(f32::MIN_POSITIVE);
        // Beyond a rim of the parts that push lies what they go on into, as a hand after a forearm.
        if -direction.dot(beneath.normal) < LEAST_COSINE {
            return visitor.normal * (depth + self.margin_m);
        }
        let room = height - self.margin_m;
        if room <= TOLERANCE_M {
            // A sliver of the visitor stands out of what it has sunk into: down to where that is closer.
            return direction * (height - SLIVER_SHARE * depth).max(0.0);
        }
        let passes = |face| !body.parts.face_pushes(face, vertex);
        let exit = body
            .surface
            .first_among(at, direction, room.min(SINK_REACH_M), passes);
        match exit.filter(|exit| exit.cosine > 0.0) {
            // The margin grows from nothing, so that nothing jumps at the skin.
            Some(exit) => direction * f32::min(2.0 * exit.distance, exit.distance + self.margin_m).min(room),
            None if room <= SINK_REACH_M => direction * room,
            None => visitor.normal * (depth + self.margin_m),
        }
    }
}
