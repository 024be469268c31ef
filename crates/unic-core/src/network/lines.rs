//! Buffers that start on a cache line, so that no register of theirs straddles two.

use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};

/// 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Line([u32; LINE]);

/// 32-bit numbers in a line.
pub(super) const LINE: usize = 16;

/// Numbers of 32 bits, in whole lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Lines(Vec<Line>);

impl Lines {
    /// Room for `count` numbers at least; what was there stays.
    pub(super) fn make_room(&mut self, count: usize) {
        let lines = count.div_ceil(LINE).max(self.0.len());
        self.0.resize(lines, Line::default());
    }

    pub(super) fn zeroed(count: usize) -> Self {
        Self(vec![Line::default(); count.div_ceil(LINE)])
    }

    pub(super) fn of<T: AnyBitPattern>(&self) -> &[T] {
        bytemuck::cast_slice(&self.0)
    }

    pub(super) fn of_mut<T: Pod + NoUninit>(&mut self) -> &mut [T] {
        bytemuck::cast_slice_mut(&mut self.0)
    }
}
