//! How far places of a garment move, where most do not.

use crate::bvh::LANES;
use glam::Vec3;

/// Movements of places by slot, metres, with the packets that have some: all others are left out of all
/// work.
#[derive(Clone, Debug)]
pub(super) struct Movements {
    by_slot: Vec<Vec3>,
    /// By packet: may anything in it move? What may not is zero.
    moves: Vec<bool>,
}

impl Movements {
    /// None, in whole packets.
    pub(super) fn new(slots: usize) -> Self {
        Self {
            by_slot: vec![Vec3::ZERO; slots],
            moves: vec![false; slots / LANES],
        }
    }

    #[inline(always)]
    pub(super) fn of(&self, slot: usize) -> Vec3 {
        self.by_slot[slot]
    }

    pub(super) fn by_slot(&self) -> &[Vec3] {
        &self.by_slot
    }

    /// May anything in a packet move?
    pub(super) fn moves(&self, packet: u32) -> bool {
        self.moves[packet as usize]
    }

    pub(super) fn are_none(&self) -> bool {
        !self.moves.contains(&true)
    }

    /// Packets with their numbers.
    pub(super) fn packets_mut(&mut self) -> impl ExactSizeIterator<Item = (usize, (&mut [Vec3], &mut bool))> {
        self.by_slot.chunks_mut(LANES).zip(&mut self.moves).enumerate()
    }

    /// The same in groups of so many packets: the first one's number, movements, and what moves.
    pub(super) fn groups_mut(
        &mut self,
        packets: usize,
    ) -> impl ExactSizeIterator<Item = (usize, (&mut [Vec3], &mut [bool]))> + Send {
        let groups = self.by_slot.chunks_mut(packets * LANES);
        let groups = groups.zip(self.moves.chunks_mut(packets)).enumerate();
        groups.map(move |(group, parts)| (group * packets, parts))
    }

    pub(super) fn clear(&mut self) {
        for (_, (movements, moves)) in self.packets_mut() {
            clear(movements, moves);
        }
    }

    pub(super) fn copy_from(&mut self, other: &Self) {
        for (packet, (movements, moves)) in self.packets_mut() {
            if other.moves[packet] {
                movements.copy_from_slice(&other.by_slot[packet * LANES..][..LANES]);
                *moves = true;
            } else {
                clear(movements, moves);
            }
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        for (packet, (movements, moves)) in self.packets_mut().filter(|&(packet, _)| other.moves[packet]) {
            let added = &other.by_slot[packet * LANES..][..LANES];
            movements
                .iter_mut()
                .zip(added)
                .for_each(|(sum, way)| *sum += *way);
            *moves = true;
        }
    }

    /// A place moves by the longer of two ways; the first where they are as long.
    pub(super) fn lengthen(&mut self, slot: usize, way: Vec3) {
        let now = &mut self.by_slot[slot];
        if way.length_squared() > now.length_squared() {
            *now = way;
            self.moves[slot / LANES] = true;
        }
    }
}

/// Nothing in a packet moves.
pub(super) fn clear(movements: &mut [Vec3], moves: &mut bool) {
    if *moves {
        movements.fill(Vec3::ZERO);
        *moves = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::point;
    use proptest::{collection::vec, prelude::*};

    const SLOTS: usize = 8 * LANES;

    fn movements(ways: &[(usize, Vec3)]) -> Movements {
        let mut movements = Movements::new(SLOTS);
        ways.iter().for_each(|&(slot, way)| movements.lengthen(slot, way));
        movements
    }

    proptest! {
        #[test]
        fn what_is_left_out_does_not_move(
            first in vec((0..SLOTS, point(1.0)), 0..4), second in vec((0..SLOTS, point(1.0)), 0..4),
        ) {
            let (mut sum, other) = (movements(&first), movements(&second));
            let expected: Vec<Vec3> = sum.by_slot.iter().zip(&other.by_slot).map(|(a, b)| *a + *b).collect();
            let mut copy = sum.clone();
            copy.copy_from(&other);
            sum.add(&other);
            prop_assert_eq!(&copy.by_slot, &other.by_slot);
            prop_assert_eq!(sum.by_slot(), &expected[..]);
            for movements in [&sum, &copy] {
                for slot in (0..SLOTS).filter(|&slot| !movements.moves((slot / LANES) as u32)) {
                    prop_assert_eq!(movements.of(slot), Vec3::ZERO);
                }
            }
            sum.clear();
            prop_assert!(sum.are_none() && sum.by_slot().iter().all(|way| *way == Vec3::ZERO));
        }
    }
}
