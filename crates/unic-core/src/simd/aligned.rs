//! Buffers that start on a cache line.

use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};

/// One cache line: 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
struct CacheLine([u32; WORDS_PER_LINE]);

/// Words of 32 bits in a cache line.
const WORDS_PER_LINE: usize = 16;

/// Buffer of 32-bit words, aligned to cache lines and as long as a whole number of them.
///
/// The alignment keeps a vector register, at most 64 bytes, from straddling two cache lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct AlignedWords(Vec<CacheLine>);

impl AlignedWords {
    /// Grows the buffer to at least `count` words; keeps the words that it holds.
    pub(crate) fn grow_to(&mut self, count: usize) {
        let lines = count.div_ceil(WORDS_PER_LINE).max(self.0.len());
        self.0.resize(lines, CacheLine::default());
    }

    /// Returns a buffer of at least `count` words of zero.
    pub(crate) fn zeroed(count: usize) -> Self {
        Self(vec![CacheLine::default(); count.div_ceil(WORDS_PER_LINE)])
    }

    /// The whole buffer as numbers of type `T`.
    pub(crate) fn as_slice<T: AnyBitPattern>(&self) -> &[T] {
        bytemuck::cast_slice(&self.0)
    }

    /// The whole buffer as numbers of type `T`, mutable.
    pub(crate) fn as_mut_slice<T: Pod + NoUninit>(&mut self) -> &mut [T] {
        bytemuck::cast_slice_mut(&mut self.0)
    }
}
