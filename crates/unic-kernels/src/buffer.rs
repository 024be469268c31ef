//! Buffers of f32 that are aligned to cache lines.

use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable};

/// One cache line. Its alignment keeps 64-byte vector loads from straddling two lines.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([f32; Line::FLOATS]);

impl Line {
    const FLOATS: usize = 16;
}

/// A growable slice of f32 that begins at a cache line. Its length is a multiple of 16.
#[derive(Clone, Default)]
pub(crate) struct Buffer {
    lines: Vec<Line>,
}

impl Buffer {
    /// Creates a buffer of zeros, rounded up to whole cache lines.
    pub(crate) fn zeros(floats: usize) -> Self {
        let lines = vec![Line::zeroed(); floats.div_ceil(Line::FLOATS)];
        Self { lines }
    }

    /// Changes the length to `floats`, rounded up to whole cache lines. The contents afterwards are
    /// old values or zeros.
    pub(crate) fn resize(&mut self, floats: usize) {
        let lines = floats.div_ceil(Line::FLOATS);
        // A new allocation instead of a reallocation, which would copy values that nobody needs.
        if lines > self.lines.capacity() {
            *self = Self::zeros(floats);
        }
        self.lines.resize(lines, Line::zeroed());
    }

    /// Changes the length to `floats`, as [`Buffer::resize`] does, and sets all values to zero.
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
