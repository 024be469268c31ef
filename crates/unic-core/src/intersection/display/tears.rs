//! Tears: cloth whose neighbours have left a limb on opposite sides.

use super::{
    CollisionScene, DisplayPass, SkinnedGarment, collider_lifts, face_lifting::MIN_STRETCH_AGAIN,
    neighbours::Neighbours, sort_by_slot,
};
use glam::Vec3;
use std::ops::Range;

/// Least weight that a vertex gives to its neighbours.
const MIN_WEIGHT: f32 = 0.2;

/// Rounds for all tears.
///
/// Most tears close in the first two rounds. The others reach farther, for faces that are stretched
/// farther: a wide reach around small tears, such as those under hanging arms, costs accuracy.
pub(super) const ALL_TEARS: [Round; 5] = [Round::NEAR, Round::NEAR, Round::FAR, Round::FAR, Round::FAR];

/// Rounds for large tears alone.
///
/// Sweeps over the edges tidy the cloth around them. Small tears that are closed before sweeps come
/// and go, and pop.
pub(super) const LARGE_TEARS: [Round; 3] = [Round::FAR; 3];

/// Extent of the smoothing in a round.
#[derive(Clone, Debug)]
pub(super) struct Round {
    /// Stretch of a face through the body at which it begins to count as torn, and from which on it
    /// counts in full.
    stretches: Range<f32>,
    /// Fraction of its weight that each vertex gives to its neighbours.
    neighbour_fraction: f32,
    /// Number of sweeps that smooth the cloth.
    sweeps: usize,
}

impl Round {
    /// Weight of a face that is stretched by a factor through the body.
    fn weight_of(&self, stretch: f32) -> f32 {
        let Range { start, end } = self.stretches;
        ((stretch - start) / (end - start)).clamp(0.0, 1.0)
    }

    /// Reaches four edges far.
    const NEAR: Self = Self {
        stretches: MIN_STRETCH_AGAIN..2.5,
        neighbour_fraction: 0.7,
        sweeps: 20,
    };

    /// Reaches nine edges far.
    const FAR: Self = Self {
        stretches: 2.5..3.5,
        neighbour_fraction: 0.85,
        sweeps: 40,
    };
}

/// Cloth around the tears of a frame.
#[derive(Clone, Debug)]
pub(super) struct Tears {
    /// Share of the smoothing that a slot takes part in: 1 at a tear, 0 away from all of them.
    weights: Vec<f32>,
    /// Welded slots with a weight, in the order in which they were found.
    slots: Vec<u32>,
    /// Offsets from the skinned positions by slot, metres, valid at `slots` and their neighbours.
    /// After the smoothing, displacements of `slots`.
    offsets: Vec<Vec3>,
    /// Offsets of `slots` before the smoothing, metres.
    before: Vec<Vec3>,
    /// Offsets of `slots` after a sweep, metres.
    next: Vec<Vec3>,
}

impl Tears {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            weights: vec![0.0; slots],
            slots: Vec::with_capacity(slots),
            offsets: vec![Vec3::ZERO; slots],
            before: Vec::with_capacity(slots),
            next: Vec::with_capacity(slots),
        }
    }

    fn clear(&mut self) {
        for slot in self.slots.drain(..) {
            self.weights[slot as usize] = 0.0;
        }
    }

    /// Gives a welded slot at least a weight. Returns whether it had less.
    fn mark(&mut self, slot: u32, weight: f32) -> bool {
        let current = &mut self.weights[slot as usize];
        let is_more = weight > *current;
        if is_more {
            if *current == 0.0 {
                self.slots.push(slot);
            }
            *current = weight;
        }
        is_more
    }

    /// Spreads the weights over neighbours: each takes the largest of what its neighbours give.
    fn spread(&mut self, neighbours: &Neighbours, fraction: f32) {
        // Until nothing changes, so that the weights do not depend on the order of the faces.
        let mut has_changed = true;
        while std::mem::take(&mut has_changed) {
            for k in 0..self.slots.len() {
                let slot = self.slots[k] as usize;
                let given = fraction * self.weights[slot];
                if given < MIN_WEIGHT {
                    continue;
                }
                for &neighbour in neighbours.of_slot(slot) {
                    has_changed |= self.mark(neighbour, given);
                }
            }
        }
    }

    /// Replaces the offsets of the slots by means over their neighbours, in sweeps, and stores what
    /// that moves each of them by, times its weight.
    fn smooth(&mut self, neighbours: &Neighbours, sweeps: usize) {
        let Self {
            weights,
            slots,
            offsets,
            before,
            next,
        } = self;
        before.clear();
        before.extend(slots.iter().map(|&slot| offsets[slot as usize]));
        for _ in 0..sweeps {
            next.clear();
            next.extend((slots.iter()).map(|&slot| neighbours.mean(slot as usize, offsets)));
            for (&slot, next) in slots.iter().zip(&*next) {
                offsets[slot as usize] = *next;
            }
        }
        for (&slot, before) in slots.iter().zip(&*before) {
            let offset = &mut offsets[slot as usize];
            *offset = (*offset - *before) * weights[slot as usize];
        }
    }
}

impl DisplayPass {
    /// Closes tears in shown positions, metres, where the skinned garment is known. Finds the
    /// stretched faces that cut through the body at the positions that result.
    ///
    /// Where a prediction is wrong by more than the radius of a limb, its cloth leaves the limb on
    /// all sides, however short each way out is. The skinned garment surrounds the limb. Around a
    /// tear, offsets of the cloth from the skinned garment are smoothed, so that its vertices come
    /// to one side. Then each is pushed out of the body. Tears of fine meshes, whose faces stay small
    /// when they are stretched, are not found.
    pub(super) fn close_tears(&mut self, scene: CollisionScene, rounds: &[Round], positions: &mut [Vec3]) {
        self.find_stretched_faces(scene, positions);
        let Some(skinned) = scene.skinned else {
            return;
        };
        for round in rounds {
            self.find_tears(scene, skinned.closing_share, round);
            if self.tears.slots.is_empty() {
                // Later rounds look for larger tears.
                break;
            }
            self.smooth_tears(scene, skinned, round);
            self.move_around_tears(scene, positions);
            self.find_stretched_faces(scene, positions);
        }
    }

    /// Finds the stretched faces that cut through the body at shown positions, metres.
    fn find_stretched_faces(&mut self, scene: CollisionScene, positions: &[Vec3]) {
        sort_by_slot(scene.body, positions, &mut self.to_recheck);
        (self.face_lifting).find_stretched_faces(scene, &self.to_recheck, &self.contacts);
    }

    /// Finds the weights around the stretched faces that were found.
    fn find_tears(&mut self, scene: CollisionScene, share: f32, round: &Round) {
        let vertices = scene.body.contact_filter().garment_packets().vertices();
        // In folds of the body there is no room for cloth, and tears are hidden.
        let is_folded = |&slot: &u32| {
            let (skin, vertex) = (self.contacts[slot as usize].face, vertices[slot as usize]);
            scene.body.is_folded(skin, vertex as usize)
        };
        self.tears.clear();
        for (slots, stretch) in self.face_lifting.stretched_faces() {
            let weight = share * round.weight_of(stretch);
            if weight == 0.0 || slots.iter().any(is_folded) {
                continue;
            }
            for slot in slots {
                let welded = self.neighbours.welded_slot(slot as usize);
                self.tears.mark(welded as u32, weight);
            }
        }
        self.tears.spread(&self.neighbours, round.neighbour_fraction);
    }

    /// Smooths the offsets around tears. `to_recheck` has the shown positions by slot.
    fn smooth_tears(&mut self, scene: CollisionScene, skinned: SkinnedGarment, round: &Round) {
        let (neighbours, tears, at) = (&self.neighbours, &mut self.tears, &self.to_recheck);
        let vertices = scene.body.contact_filter().garment_packets().vertices();
        for &slot in &tears.slots {
            for &slot in neighbours.of_slot(slot as usize).iter().chain([&slot]) {
                let slot = slot as usize;
                tears.offsets[slot] = at[slot] - skinned.position(vertices[slot] as usize);
            }
        }
        tears.smooth(neighbours, round.sweeps);
    }

    /// Moves the vertices around tears by their displacements, and out of the body and the colliders
    /// from there.
    fn move_around_tears(&mut self, scene: CollisionScene, positions: &mut [Vec3]) {
        let vertices = scene.body.contact_filter().garment_packets().vertices();
        for (slot, at) in self.to_recheck.iter_mut().enumerate() {
            // The vertices of a seam share one displacement, so that the seam stays closed.
            let welded = self.neighbours.welded_slot(slot);
            if self.tears.weights[welded] > 0.0 {
                let moved = *at + self.tears.offsets[welded];
                let out = collider_lifts::push_out_of_all(scene.colliders, moved, self.rule.margin_m);
                *at = out.unwrap_or(moved);
            } else {
                *at = Vec3::NAN;
            }
        }
        (self.rule).find_contacts(scene.body, &self.to_recheck, |_| true, &mut self.contacts);
        for (slot, &vertex) in vertices.iter().enumerate() {
            let moved = self.to_recheck[slot];
            if moved.is_finite() {
                let shown = self.contacts[slot].corrected.unwrap_or(moved);
                // The contact belongs to this place from now on.
                (self.at[slot], positions[vertex as usize]) = (shown, shown);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{intersection::packets::Packets, test_meshes::sheet};
    use proptest::{collection::vec, prelude::*};

    /// Weights around marked slots of a sheet, as bits.
    fn spread(marks: &[(u32, f32)]) -> Vec<u32> {
        let rest = sheet(8, 8, 0.01);
        let packets = Packets::partition(0..rest.vertices.len(), &rest.vertices, |_| 0);
        let neighbours = Neighbours::new(&rest, &packets);
        let mut tears = Tears::new(packets.len());
        for &(slot, weight) in marks {
            tears.mark(packets.slots()[slot as usize], weight);
        }
        tears.spread(&neighbours, Round::FAR.neighbour_fraction);
        let weights = tears.weights.iter().map(|w| w.to_bits()).collect();
        tears.clear();
        assert!(tears.weights.iter().all(|weight| *weight == 0.0));
        weights
    }

    proptest! {
        #[test]
        fn weights_do_not_depend_on_the_order_of_the_faces(marks in vec((0u32..81, 0.01f32..1.0), 1..6)) {
            let mut backwards = marks.clone();
            backwards.reverse();
            prop_assert_eq!(spread(&marks), spread(&backwards));
        }
    }
}
