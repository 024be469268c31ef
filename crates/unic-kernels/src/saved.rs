//! Activations that a forward pass keeps for its backward pass.

use std::ops::Range;

use crate::batch::{Batch, BatchExtent};
use crate::buffer::Buffer;
use crate::panels::PANEL;
use crate::{Field, FieldShape, KernelError};

/// Source of the activations in a backward pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Retention {
    /// Stored by the forward pass: 4·H·N bytes per point, which is 8 KB for the published field.
    #[default]
    Activations,
    /// Recomputed by the backward pass, tile by tile, which takes a third more work. For batches
    /// whose activations do not fit into memory.
    Recompute,
}

/// Activations and folded biases that one forward pass keeps; a buffer to reuse from step to step.
///
/// An unrolled training needs one buffer per time step.
#[derive(Default)]
pub struct SavedActivations {
    pub(crate) retention: Retention,
    /// Activations of all tiles, empty for [`Retention::Recompute`].
    pub(crate) activations: Buffer,
    /// Biases with the latents folded in, `[groups, slots, width]`.
    pub(crate) biases: Buffer,
    /// Field and batch of the last forward pass.
    made_for: Option<(FieldShape, BatchExtent)>,
}

impl SavedActivations {
    /// An empty buffer; [`SavedActivations::default`] stores activations.
    pub fn new(retention: Retention) -> Self {
        Self {
            retention,
            ..Self::default()
        }
    }

    /// Returns the source of the activations in the backward pass.
    pub fn retention(&self) -> Retention {
        self.retention
    }

    /// Returns the number of bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.activations) + size_of_val(&*self.biases)
    }

    /// Sizes the buffers for a batch and folds its latents into the biases.
    pub(crate) fn prepare(&mut self, field: &Field, batch: &Batch, extent: BatchExtent, activations: usize) {
        self.activations.resize(activations);
        field.fold_latents(batch, &extent, &mut self.biases);
        self.made_for = Some((field.shape, extent));
    }

    /// Returns an error unless the activations belong to this field shape and batch size.
    pub(crate) fn check(&self, shape: FieldShape, extent: BatchExtent) -> Result<(), KernelError> {
        if self.made_for == Some((shape, extent)) {
            return Ok(());
        }
        let found = self
            .made_for
            .map_or("no batch".to_owned(), |made_for| format!("{made_for:?}"));
        Err(KernelError::Saved {
            expected: format!("{:?}", (shape, extent)),
            found,
        })
    }
}

/// Layout of a tile's buffer of activations.
pub(crate) struct TileLayout {
    /// Range of each map's input, then of the head's output.
    pub(crate) inputs: Vec<Range<usize>>,
    /// Number of floats from one panel to the next.
    pub(crate) stride: usize,
    /// Length of the buffer in floats.
    pub(crate) length: usize,
}

impl TileLayout {
    /// Makes a layout in which every input has its own range, for activations that are kept.
    pub(crate) fn separate(field: &Field, extent: &BatchExtent) -> Self {
        let stride = extent.tile_points() * PANEL;
        let mut length = 0;
        let place = |panels: usize| {
            let start = length;
            length += panels * stride;
            start..length
        };
        let inputs = panel_counts(field).map(place).collect();
        Self {
            inputs,
            stride,
            length,
        }
    }

    /// Makes a layout of two ranges that are used in turn, for activations that are not kept.
    pub(crate) fn alternating(field: &Field, extent: &BatchExtent) -> Self {
        let stride = extent.tile_points() * PANEL;
        // Each map reads one half of the buffer and writes the other.
        let largest = panel_counts(field).max().unwrap_or(0) * stride;
        let place = |(index, panels): (usize, usize)| {
            let start = index % 2 * largest;
            start..start + panels * stride
        };
        let inputs = panel_counts(field).enumerate().map(place).collect();
        Self {
            inputs,
            stride,
            length: 2 * largest,
        }
    }
}

/// Lists the number of panels of every map's input, then of the head's output.
fn panel_counts(field: &Field) -> impl Iterator<Item = usize> {
    let head = field.shape.outputs.div_ceil(PANEL);
    field.layers.iter().map(|layer| layer.input.count()).chain([head])
}
