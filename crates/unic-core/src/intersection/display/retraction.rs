//! Retraction of vertices that are deep inside the body.

use super::{CHUNK, DisplayPass, RobustBody, RobustIntersection, SkinnedGarment};
use crate::{aabb_tree::LANES, parallel::for_each_chunk};
use glam::Vec3;

impl DisplayPass {
    /// Draws vertices deep inside the body towards their skinned positions, and finds their contacts
    /// anew. Few frames have such vertices.
    pub(super) fn retract_deep(
        &mut self,
        body: &RobustBody,
        skinned: SkinnedGarment,
        positions: &mut [Vec3],
    ) {
        let is_deep = |height_m: f32| height_m < -RobustIntersection::MIN_RETRACTED_DEPTH_M;
        if !self.contacts.iter().any(|contact| is_deep(contact.height_m)) {
            return;
        }
        let packets = body.contact_filter().garment_packets();
        let (rule, at, contacts, neighbours) = (self.rule, &self.at, &self.contacts, &self.neighbours);
        for_each_chunk(&mut self.to_recheck, CHUNK, |first, retracted| {
            for (slot, retracted) in (first..).zip(retracted) {
                // The vertices of a seam move as one, so that the seam stays closed.
                let welded = neighbours.welded_slot(slot);
                let vertex = packets.vertices()[welded] as usize;
                let contact = contacts[welded];
                let moved = (at[welded].is_finite() && is_deep(contact.height_m)).then(|| {
                    let (p, skinned) = (at[welded], skinned.position(vertex));
                    rule.retract(body, vertex, p, skinned, contact.face)
                });
                *retracted = moved.flatten().unwrap_or(Vec3::NAN);
            }
        });
        let retracted = &self.to_recheck;
        let moved = self.at.iter_mut().zip(packets.vertices()).zip(retracted);
        for ((at, &vertex), retracted) in moved.filter(|(_, retracted)| retracted.is_finite()) {
            // Empty slots have no vertex.
            if let Some(position) = positions.get_mut(vertex as usize) {
                (*at, *position) = (*retracted, *retracted);
            }
        }
        let has_moved = |packet: usize| {
            let slots = packet * LANES..(packet + 1) * LANES;
            retracted[slots].iter().any(|p| p.is_finite())
        };
        (self.rule).find_contacts(body, &self.at, has_moved, &mut self.contacts);
    }
}
