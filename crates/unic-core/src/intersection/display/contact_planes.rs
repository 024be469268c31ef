//! Planes that keep vertices outside of the body while their edges get their lengths back.

use super::{CHUNK, CollisionScene, DisplayPass, LIMB_RADIUS_M, collider_lifts};
use crate::{aabb_tree::LANES, parallel::for_each_chunk, projection::ContactPlane};
use glam::Vec3;

/// Height over the body above which a vertex needs no plane, metres. The sweeps that follow move
/// most vertices by millimetres.
const REACH_M: f32 = 0.02;

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

    /// Pushes vertices off the body once more, each by itself: those with a plane, and those that
    /// have moved since the last pass by more than their height over the margin. All are pushed out
    /// of the colliders, and faces are lifted again.
    pub(crate) fn push_out_again(
        &mut self,
        scene: CollisionScene,
        planes: &[ContactPlane],
        positions: &mut [Vec3],
    ) {
        let packets = scene.body.contact_filter().garment_packets();
        for (packet, vertices) in packets.vertices().chunks(LANES).enumerate() {
            let slots = packet * LANES..packet * LANES + vertices.len();
            for (slot, &vertex) in slots.clone().zip(vertices) {
                // Empty slots have no vertex.
                let moved = positions.get(vertex as usize).zip(planes.get(vertex as usize));
                let at = moved
                    .filter(|(now, plane)| **plane != ContactPlane::NONE || self.may_be_low(slot, **now));
                self.to_recheck[slot] = at.map_or(Vec3::NAN, |(now, _)| *now);
            }
            self.summaries[packet].is_moving = self.to_recheck[slots].iter().any(|at| at.is_finite());
        }
        let is_moving = |packet: usize| self.summaries[packet].is_moving;
        (self.rule).find_contacts(scene.body, &self.to_recheck, is_moving, &mut self.contacts);
        let slots = packets.slots();
        for (position, &slot) in positions.iter_mut().zip(slots) {
            let slot = slot as usize;
            if self.to_recheck[slot].is_finite() {
                *position = self.contacts[slot].corrected.unwrap_or(*position);
            }
            let out = collider_lifts::push_out_of_all(scene.colliders, *position, self.rule.margin_m);
            *position = out.unwrap_or(*position);
        }
        self.lift_faces_again(scene, positions);
    }

    /// Lifts stretched faces through which the body has come since the last pass, and their
    /// neighbours.
    fn lift_faces_again(&mut self, scene: CollisionScene, positions: &mut [Vec3]) {
        if !self.face_lifting.has_lifted() {
            return;
        }
        let slots = scene.body.contact_filter().garment_packets().slots();
        for (position, &slot) in positions.iter().zip(slots) {
            // Heights stay lower bounds at the new positions.
            let (contact, at) = (&mut self.contacts[slot as usize], self.at[slot as usize]);
            contact.height_m -= position.distance(at);
        }
        self.load_positions(scene.body, positions);
        self.corrections.clear();
        let (neighbours, corrections) = (&self.neighbours, &mut self.corrections);
        (self.face_lifting).lift_again(scene, neighbours, &self.at, &self.contacts, corrections);
        self.spread_corrections(scene, positions);
    }

    /// Returns whether a vertex may be below the margin at `now`, after the last pass has shown it
    /// elsewhere.
    fn may_be_low(&self, slot: usize, now: Vec3) -> bool {
        let height_m = match self.contacts[slot].height_m {
            // The vertex was too high to be searched for where it was shown.
            height_m if height_m.is_nan() => LIMB_RADIUS_M,
            height_m => height_m,
        };
        // The height belongs to one of these places. `shown` is valid in packets that have moved.
        let is_moving = self.summaries[slot / LANES].is_moving;
        let places = [Some(self.at[slot]), is_moving.then(|| self.shown[slot])];
        let mut distances = places.into_iter().flatten().map(|place| now.distance(place));
        distances.any(|moved_m| moved_m > height_m - self.rule.margin_m)
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
