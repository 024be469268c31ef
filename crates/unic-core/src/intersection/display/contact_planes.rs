//! Planes that keep vertices outside of the body while their edges get their lengths back.

use super::{CHUNK, CollisionScene, DisplayPass};
use crate::{aabb_tree::LANES, parallel::for_each_chunk, projection::ContactPlane};
use glam::Vec3;

/// Height over the body above which a vertex needs no plane, metres. The sweeps that follow move
/// most vertices by millimetres.
const REACH_M: f32 = 0.02;

impl DisplayPass {
    /// Returns whether the last pass has moved any vertex.
    pub(crate) fn has_moved(&self) -> bool {
        self.has_retracted || self.summaries.iter().any(|summary| summary.is_moving)
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
