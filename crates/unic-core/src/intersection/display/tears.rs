//! Tears: cloth whose neighbours have left a limb on opposite sides.

use super::{CollisionScene, DisplayPass, SkinnedGarment, neighbours::Neighbours, sort_by_slot};
use glam::Vec3;

/// Stretch of a face through the body at which it begins to count as torn, and from which on it
/// counts in full.
const STRETCHES: std::ops::Range<f32> = 1.5..2.5;

/// Fraction of its weight that each vertex gives to its neighbours.
const NEIGHBOUR_FRACTION: f32 = 0.85;

/// Least weight that is given: a tear reaches nine edges far.
const MIN_WEIGHT: f32 = 0.2;

/// Number of sweeps that smooth the cloth around a tear.
const SWEEPS: usize = 40;

/// Largest number of times that the tears of a garment are looked for and closed.
const ROUNDS: usize = 4;

/// Cloth around the tears of a frame.
#[derive(Clone, Debug)]
pub(super) struct Tears {
    /// Share of its offset that a slot takes from its neighbours in a sweep: 1 at a tear, 0 away
    /// from all of them.
    weights: Vec<f32>,
    /// Welded slots with a weight, in the order in which they were found.
    slots: Vec<u32>,
    /// Welded slots whose neighbours have not taken from their weights.
    open: Vec<u32>,
    /// Offsets from the skinned positions by slot, metres. Valid at `slots` and their neighbours.
    offsets: Vec<Vec3>,
    /// Offsets of `slots` after a sweep, metres.
    next: Vec<Vec3>,
}

impl Tears {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            weights: vec![0.0; slots],
            slots: Vec::new(),
            open: Vec::new(),
            offsets: vec![Vec3::ZERO; slots],
            next: Vec::new(),
        }
    }

    /// Weight of a face that is stretched by a factor through the body.
    fn weight_of(stretch: f32) -> f32 {
        ((stretch - STRETCHES.start) / (STRETCHES.end - STRETCHES.start)).clamp(0.0, 1.0)
    }

    fn clear(&mut self) {
        for slot in self.slots.drain(..) {
            self.weights[slot as usize] = 0.0;
        }
    }

    /// Gives a welded slot at least a weight.
    fn mark(&mut self, slot: u32, weight: f32) {
        let current = &mut self.weights[slot as usize];
        if weight > *current {
            if *current == 0.0 {
                self.slots.push(slot);
            }
            *current = weight;
        }
    }

    /// Spreads the weights over neighbours: each takes the largest of what its neighbours give.
    fn spread(&mut self, neighbours: &Neighbours) {
        // A slot whose weight grows later is visited again, so that the result does not depend on
        // the order of the faces.
        self.open.clear();
        self.open.extend_from_slice(&self.slots);
        while let Some(slot) = self.open.pop() {
            let given = NEIGHBOUR_FRACTION * self.weights[slot as usize];
            if given < MIN_WEIGHT {
                continue;
            }
            for &neighbour in neighbours.of_slot(slot as usize) {
                if given > self.weights[neighbour as usize] {
                    self.mark(neighbour, given);
                    self.open.push(neighbour);
                }
            }
        }
    }

    /// Replaces the offsets of weighted slots by means over their neighbours, in sweeps.
    fn smooth(&mut self, neighbours: &Neighbours) {
        for _ in 0..SWEEPS {
            let (weights, offsets) = (&self.weights, &self.offsets);
            let smoothed = |&slot: &u32| {
                let slot = slot as usize;
                offsets[slot].lerp(neighbours.mean(slot, offsets), weights[slot])
            };
            self.next.clear();
            self.next.extend(self.slots.iter().map(smoothed));
            for (&slot, next) in self.slots.iter().zip(&self.next) {
                self.offsets[slot as usize] = *next;
            }
        }
    }
}

impl DisplayPass {
    /// Closes tears in shown positions, metres. Needs the skinned garment.
    ///
    /// Where a prediction is wrong by more than the radius of a limb, its cloth leaves the limb on
    /// all sides, however short each way out is. The skinned garment surrounds the limb. Around a
    /// tear, offsets of the cloth from the skinned garment are smoothed, so that its vertices come
    /// to one side. Then each is pushed out of the body. Large tears close in several rounds.
    pub(super) fn heal_tears(&mut self, scene: CollisionScene, positions: &mut [Vec3]) {
        let Some(skinned) = scene.skinned else {
            return;
        };
        for _ in 0..ROUNDS {
            self.find_stretched_faces(scene, positions);
            let largest = self.find_tears();
            if largest == 0.0 {
                break;
            }
            self.smooth_tears(scene, skinned);
            self.move_to_offsets(scene, skinned, positions);
            if largest < MIN_WEIGHT {
                break;
            }
        }
    }

    /// Finds the stretched faces that cut through the body at shown positions, metres.
    pub(super) fn find_stretched_faces(&mut self, scene: CollisionScene, positions: &[Vec3]) {
        sort_by_slot(scene.body, positions, &mut self.to_recheck);
        (self.face_lifting).find_stretched_faces(scene, &self.to_recheck, &self.contacts);
    }

    /// Finds the weights around the stretched faces that were found. Returns the largest.
    fn find_tears(&mut self) -> f32 {
        self.tears.clear();
        let mut largest: f32 = 0.0;
        for (slots, stretch) in self.face_lifting.stretched_faces() {
            let weight = Tears::weight_of(stretch);
            largest = largest.max(weight);
            for slot in slots {
                let welded = self.neighbours.welded_slot(slot as usize);
                self.tears.mark(welded as u32, weight);
            }
        }
        self.tears.spread(&self.neighbours);
        largest
    }

    /// Smooths the offsets around tears. `to_recheck` has the shown positions by slot.
    fn smooth_tears(&mut self, scene: CollisionScene, skinned: SkinnedGarment) {
        let (neighbours, tears, at) = (&self.neighbours, &mut self.tears, &self.to_recheck);
        let vertices = scene.body.contact_filter().garment_packets().vertices();
        for &slot in &tears.slots {
            for &slot in neighbours.of_slot(slot as usize).iter().chain([&slot]) {
                let slot = slot as usize;
                tears.offsets[slot] = at[slot] - skinned.position(vertices[slot] as usize);
            }
        }
        tears.smooth(neighbours);
    }

    /// Moves the vertices around tears to their smoothed offsets, and out of the body from there.
    fn move_to_offsets(&mut self, scene: CollisionScene, skinned: SkinnedGarment, positions: &mut [Vec3]) {
        let vertices = scene.body.contact_filter().garment_packets().vertices();
        for (slot, &vertex) in vertices.iter().enumerate() {
            let welded = self.neighbours.welded_slot(slot);
            // Empty slots have no vertex.
            let is_moved = self.tears.weights[welded] > 0.0 && (vertex as usize) < positions.len();
            self.to_recheck[slot] = match is_moved {
                true => self.tears.offsets[welded] + skinned.position(vertex as usize),
                false => Vec3::NAN,
            };
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
        tears.spread(&neighbours);
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
