//! Retraction of vertices that are deep inside the body.

use super::{CHUNK, Contact, DisplayPass, RobustBody, RobustIntersection, SkinnedGarment};
use crate::{aabb_tree::LANES, parallel::for_each_chunk};
use glam::Vec3;

impl DisplayPass {
    /// Draws vertices deep inside the body towards their skinned positions, and finds their contacts
    /// anew. Most frames have no such vertices.
    pub(super) fn retract_deep(
        &mut self,
        body: &RobustBody,
        skinned: SkinnedGarment,
        positions: &mut [Vec3],
    ) {
        if !self.contacts.iter().any(is_deep) {
            return;
        }
        self.find_retracted(body, skinned);
        let (retracted, vertices) = (
            &self.to_recheck,
            body.contact_filter().garment_packets().vertices(),
        );
        let moved = self.at.iter_mut().zip(vertices).zip(retracted).enumerate();
        let moved = moved.filter(|(_, (_, retracted))| retracted.is_finite());
        for (slot, ((at, &vertex), retracted)) in moved {
            // Empty slots have no vertex.
            if let Some(position) = positions.get_mut(vertex as usize) {
                (*at, *position) = (*retracted, *retracted);
                self.has_retracted = true;
                if let Some(depths) = &mut self.depths {
                    let height_m = self.contacts[self.neighbours.welded_slot(slot)].height_m;
                    depths.store_retraction(slot, self.rule.margin_m - height_m);
                }
            }
        }
        let has_moved = |packet: usize| {
            let slots = packet * LANES..(packet + 1) * LANES;
            retracted[slots].iter().any(|p| p.is_finite())
        };
        (self.rule).find_contacts(body, &self.at, has_moved, &mut self.contacts);
    }

    /// Stores the retracted position of each slot in `to_recheck`; NaN for vertices that stay.
    fn find_retracted(&mut self, body: &RobustBody, skinned: SkinnedGarment) {
        let packets = body.contact_filter().garment_packets();
        let (rule, at, contacts, neighbours) = (self.rule, &self.at, &self.contacts, &self.neighbours);
        let displacement = |welded: usize| {
            // The position of an empty slot, which has no vertex, is NaN.
            if !is_deep(&contacts[welded]) || at[welded].is_nan() {
                return None;
            }
            let vertex = packets.vertices()[welded] as usize;
            let (to, seed) = (skinned.position(vertex), contacts[welded].face);
            let retracted = rule.retract(body, vertex, at[welded], to, seed)?;
            Some(retracted - at[welded])
        };
        for_each_chunk(&mut self.to_recheck, CHUNK, |first, retracted| {
            for (slot, retracted) in (first..).zip(retracted) {
                // The vertices of a seam share one displacement, so that the seam stays closed.
                let moved = displacement(neighbours.welded_slot(slot)).map(|by| at[slot] + by);
                *retracted = moved.unwrap_or(Vec3::NAN);
            }
        });
    }
}

/// Returns whether a vertex is so deep that retraction moves it.
fn is_deep(contact: &Contact) -> bool {
    contact.height_m < -RobustIntersection::MIN_RETRACTED_DEPTH_M
}
