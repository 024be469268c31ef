//! Lists of slots of a group.

use crate::intersection::packets::Packets;

/// Slots of a group of packets in ascending order.
#[derive(Clone, Copy)]
pub(super) struct Slots {
    slots: [u8; Packets::GROUP],
    count: usize,
}

// Slots fit into a byte.
const _: () = assert!(Packets::GROUP - 1 <= u8::MAX as usize);

impl Slots {
    pub(super) const EMPTY: Self = Self {
        slots: [0; Packets::GROUP],
        count: 0,
    };

    /// Appends a slot.
    pub(super) fn push(&mut self, slot: usize) {
        self.slots[self.count] = slot as u8;
        self.count += 1;
    }

    /// Keeps the slots that the predicate accepts. It is called once for each.
    pub(super) fn retain(&mut self, mut keeps: impl FnMut(usize) -> bool) {
        let mut count = 0;
        for k in 0..self.count {
            let slot = self.slots[k];
            if keeps(slot.into()) {
                self.slots[count] = slot;
                count += 1;
            }
        }
        self.count = count;
    }

    /// Returns the slots that the predicate accepts. It is called once for each.
    pub(super) fn filtered(&self, keeps: impl FnMut(usize) -> bool) -> Self {
        let mut slots = *self;
        slots.retain(keeps);
        slots
    }

    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = usize> {
        self.as_slice().iter().map(|&slot| slot.into())
    }

    pub(super) fn as_slice(&self) -> &[u8] {
        &self.slots[..self.count]
    }
}
