//! What a forward pass keeps for its backward pass.

use std::ops::Range;

use crate::batch::{Batch, Extent};
use crate::buffer::Buffer;
use crate::panels::PANEL;
use crate::{Field, FieldShape, KernelError};

/// How backward comes by the activations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Retention {
    /// Forward stores them: 4·H·N bytes a point (8 KB for the published field).
    #[default]
    Activations,
    /// Backward computes them again, tile by tile, for a third more work: for batches that memory cannot hold.
    Recompute,
}

/// What one forward pass keeps; a buffer to reuse from step to step. An unrolled training needs one a step.
#[derive(Default)]
pub struct Saved {
    pub(crate) retention: Retention,
    pub(crate) activations: Buffer,
    /// Latents folded into biases, `[groups, slots, width]`.
    pub(crate) biases: Buffer,
    made_for: Option<(FieldShape, Extent)>,
}

impl Saved {
    /// An empty buffer; [`Saved::default`] stores activations.
    pub fn new(retention: Retention) -> Self {
        Self {
            retention,
            ..Self::default()
        }
    }

    /// How backward will come by the activations.
    pub fn retention(&self) -> Retention {
        self.retention
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.activations) + size_of_val(&*self.biases)
    }

    pub(crate) fn prepare(&mut self, field: &Field, batch: &Batch, extent: Extent, activations: usize) {
        self.activations.resize(activations);
        field.fold_latents(batch, &extent, &mut self.biases);
        self.made_for = Some((field.shape, extent));
    }

    /// Refuses activations of another field or of a batch of other sizes.
    pub(crate) fn check(&self, shape: FieldShape, extent: Extent) -> Result<(), KernelError> {
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

/// Where in a tile's buffer the input of each map lies; one more entry for the head's output.
pub(crate) struct TileLayout {
    pub(crate) inputs: Vec<Range<usize>>,
    /// Floats from one panel to the next.
    pub(crate) stride: usize,
    pub(crate) length: usize,
}

impl TileLayout {
    /// Every input has a place of its own.
    pub(crate) fn separate(field: &Field, extent: &Extent) -> Self {
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

    /// Two places, used in turn.
    pub(crate) fn alternating(field: &Field, extent: &Extent) -> Self {
        let stride = extent.tile_points() * PANEL;
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

/// Panels of every map's input, then of the head's output.
fn panel_counts(field: &Field) -> impl Iterator<Item = usize> {
    let head = field.shape.outputs.div_ceil(PANEL);
    field.layers.iter().map(|layer| layer.input.count()).chain([head])
}
