//! Planes that keep vertices outside of the body while their edges get their lengths back.

use super::{CHUNK, CollisionScene, DisplayPass};
use crate::{aabb_tree::LANES, parallel::for_each_chunk, projection::ContactPlane};
use glam::Vec3;

/// Height over the body above which a vertex needs no plane, metres. The sweeps that follow move
/// most vertices by millimetres.
const REACH_M: f32 = 0.02;

/// Length of a move after which a vertex without a plane may have come into the body, metres.
const LONG_MOVE_M: f32 = 0.5 * REACH_M;

impl DisplayPass {
    /// Returns whether the last pass has moved any vertex.
    pub(crate) fn has_moved(&self) -> bool {
        self.summaries.iter().any(|summary| summary.is_moving)
    }

    /// Writes the plane of each vertex that is close to the body, at its shown position in metres.
    /// Vertices that are too low are kept where they are.
    pub(crate) fn contact_planes(
        &self,
        scene: CollisionScene,
        positions: &[Vec3],
        planes: &mut Vec<ContactPlane>,
    ) {
        planes.resize(positions.len(), ContactPlane::NONE);
        let packets = scene.body.contact_filter().garment_packets();
        let slots = packets.slots();
        for_each_chunk(planes, CHUNK, |first, planes| {
            for (vertex, plane) in (first..).zip(planes) {
                *plane = self.plane(scene, slots[vertex] as usize, positions[vertex]);
            }
        });
    }

    /// Corrects each vertex with a plane by itself, after it was moved along the body, and each that
    /// was moved far.
    pub(crate) fn push_out_again(
        &mut self,
        scene: CollisionScene,
        planes: &[ContactPlane],
        positions: &mut [Vec3],
    ) {
        let packets = scene.body.contact_filter().garment_packets();
        for (packet, vertices) in packets.vertices().chunks(LANES).enumerate() {
            let slots = packet * LANES..packet * LANES + vertices.len();
            let summary = &mut self.summaries[packet];
            let before = match summary.is_moving {
                true => &self.shown[slots.clone()],
                false => &self.at[slots.clone()],
            };
            let to_recheck = &mut self.to_recheck[slots];
            for ((at, &vertex), before) in to_recheck.iter_mut().zip(vertices).zip(before) {
                // Empty slots have no vertex.
                let moved = positions.get(vertex as usize).zip(planes.get(vertex as usize));
                let moved = moved.filter(|(now, plane)| {
                    **plane != ContactPlane::NONE || now.distance(*before) > LONG_MOVE_M
                });
                *at = moved.map_or(Vec3::NAN, |(now, _)| *now);
            }
            summary.is_moving = to_recheck.iter().any(|at| at.is_finite());
        }
        let is_moving = |packet: usize| self.summaries[packet].is_moving;
        (self.rule).find_contacts(scene.body, &self.to_recheck, is_moving, &mut self.contacts);
        let slots = packets.slots();
        for (position, &slot) in positions.iter_mut().zip(slots) {
            let slot = slot as usize;
            if self.to_recheck[slot].is_finite() {
                *position = self.contacts[slot].corrected.unwrap_or(*position);
            }
        }
    }

    fn plane(&self, scene: CollisionScene, slot: usize, at: Vec3) -> ContactPlane {
        let contact = &self.contacts[slot];
        let moved = match self.summaries[slot / LANES].is_moving {
            true => at.distance(self.at[slot]),
            false => 0.0,
        };
        if contact.height_m - moved > REACH_M {
            return ContactPlane::NONE;
        }
        let hit = scene.body.surface().point_on(contact.face, at);
        let Some(hit) = hit.filter(|hit| hit.distance < REACH_M && hit.normal != Vec3::ZERO) else {
            return ContactPlane::NONE;
        };
        let height = (at - hit.point).dot(hit.normal).min(self.rule.margin_m);
        ContactPlane {
            normal: hit.normal,
            height: hit.point.dot(hit.normal) + height,
        }
    }
}
