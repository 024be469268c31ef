//! Buffers whose start is aligned to a cache line.

use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable};

/// One cache line, so that no 64-byte vector load straddles two of them.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([f32; Line::FLOATS]);

impl Line {
    const FLOATS: usize = 16;
}

/// A growable slice of f32 that starts on a cache line; its length is a multiple of 16.
#[derive(Clone, Default)]
pub(crate) struct Buffer {
    lines: Vec<Line>,
}

impl Buffer {
    /// Zeros, rounded up to whole cache lines.
    pub(crate) fn zeros(floats: usize) -> Self {
        let lines = vec![Line::zeroed(); floats.div_ceil(Line::FLOATS)];
        Self { lines }
    }

    /// Makes the length fit `floats` and keeps whatever the buffer holds; new space is zero.
    pub(crate) fn resize(&mut self, floats: usize) {
        let lines = floats.div_ceil(Line::FLOATS);
        if lines > self.lines.capacity() {
            *self = Self::zeros(floats);
        }
        self.lines.resize(lines, Line::zeroed());
    }

    /// The same with every number set to zero.
    pub(crate) fn reset(&mut self, floats: usize) {
        self.resize(floats);
        self.fill(0.0);
    }
}

impl Deref for Buffer {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        bytemuck::cast_slice(&self.lines)
    }
}

impl DerefMut for Buffer {
    fn deref_mut(&mut self) -> &mut [f32] {
        bytemuck::cast_slice_mut(&mut self.lines)
    }
}
