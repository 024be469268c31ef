//! Corrections of a garment's positions, most of which are zero.

use crate::aabb_tree::LANES;
use glam::Vec3;

/// Displacement of each slot, metres, with the packets in which any is not zero. Passes skip all
/// other packets.
#[derive(Clone, Debug)]
pub(super) struct Corrections {
    by_slot: Vec<Vec3>,
    /// Flags of the packets that may have a displacement that is not zero.
    is_active: Vec<bool>,
}

impl Corrections {
    /// Zeros for a number of slots that fill their packets.
    pub(super) fn new(slots: usize) -> Self {
        Self {
            by_slot: vec![Vec3::ZERO; slots],
            is_active: vec![false; slots / LANES],
        }
    }

    #[inline(always)]
    pub(super) fn at(&self, slot: usize) -> Vec3 {
        self.by_slot[slot]
    }

    pub(super) fn by_slot(&self) -> &[Vec3] {
        &self.by_slot
    }

    /// Returns whether a packet may have a displacement that is not zero.
    pub(super) fn is_active(&self, packet: u32) -> bool {
        self.is_active[packet as usize]
    }

    /// Returns whether all displacements are zero.
    pub(super) fn is_empty(&self) -> bool {
        !self.is_active.contains(&true)
    }

    /// Iterates over packets: number, displacements, and whether the packet is active.
    pub(super) fn packets_mut(&mut self) -> impl ExactSizeIterator<Item = (usize, (&mut [Vec3], &mut bool))> {
        self.by_slot
            .chunks_mut(LANES)
            .zip(&mut self.is_active)
            .enumerate()
    }

    /// Iterates over groups of packets: number of the first packet, displacements, and active
    /// packets.
    pub(super) fn groups_mut(
        &mut self,
        packets: usize,
    ) -> impl ExactSizeIterator<Item = (usize, (&mut [Vec3], &mut [bool]))> + Send {
        let groups = self.by_slot.chunks_mut(packets * LANES);
        let groups = groups.zip(self.is_active.chunks_mut(packets)).enumerate();
        groups.map(move |(group, slices)| (group * packets, slices))
    }

    pub(super) fn clear(&mut self) {
        for (_, (values, is_active)) in self.packets_mut() {
            clear_packet(values, is_active);
        }
    }

    // Packets that are inactive in both are not touched: their zeros are already there.
    pub(super) fn copy_from(&mut self, other: &Self) {
        for (packet, (values, is_active)) in self.packets_mut() {
            if other.is_active[packet] {
                values.copy_from_slice(&other.by_slot[packet * LANES..][..LANES]);
                *is_active = true;
            } else {
                clear_packet(values, is_active);
            }
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        let active = self.packets_mut().filter(|&(packet, _)| other.is_active[packet]);
        for (packet, (values, is_active)) in active {
            let added = &other.by_slot[packet * LANES..][..LANES];
            values
                .iter_mut()
                .zip(added)
                .for_each(|(sum, value)| *sum += *value);
            *is_active = true;
        }
    }

    /// Replaces the displacement of a slot by a longer one.
    // The first of equally long ones stays, so that the result is unique for a given order.
    pub(super) fn keep_longer(&mut self, slot: usize, value: Vec3) {
        let current = &mut self.by_slot[slot];
        if value.length_squared() > current.length_squared() {
            *current = value;
            self.is_active[slot / LANES] = true;
        }
    }
}

/// Sets all displacements of a packet to zero.
pub(super) fn clear_packet(values: &mut [Vec3], is_active: &mut bool) {
    if *is_active {
        values.fill(Vec3::ZERO);
        *is_active = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::point;
    use proptest::{collection::vec, prelude::*};

    const SLOTS: usize = 8 * LANES;

    fn corrections(values: &[(usize, Vec3)]) -> Corrections {
        let mut corrections = Corrections::new(SLOTS);
        (values.iter()).for_each(|&(slot, value)| corrections.keep_longer(slot, value));
        corrections
    }

    proptest! {
        #[test]
        fn corrections_of_inactive_packets_are_zero(
            first in vec((0..SLOTS, point(1.0)), 0..4), second in vec((0..SLOTS, point(1.0)), 0..4),
        ) {
            let (mut sum, other) = (corrections(&first), corrections(&second));
            let expected: Vec<Vec3> = sum.by_slot.iter().zip(&other.by_slot).map(|(a, b)| *a + *b).collect();
            let mut copy = sum.clone();
            copy.copy_from(&other);
            sum.add(&other);
            prop_assert_eq!(&copy.by_slot, &other.by_slot);
            prop_assert_eq!(sum.by_slot(), &expected[..]);
            for corrections in [&sum, &copy] {
                for slot in (0..SLOTS).filter(|&slot| !corrections.is_active((slot / LANES) as u32)) {
                    prop_assert_eq!(corrections.at(slot), Vec3::ZERO);
                }
            }
            sum.clear();
            prop_assert!(sum.is_empty() && sum.by_slot().iter().all(|value| *value == Vec3::ZERO));
        }
    }
}
