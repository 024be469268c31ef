//! The field's backward pass.
//!
//! Points are split into chunks, whose number depends on the batch only. Each chunk processes its
//! tiles in order and sums the parameter gradients in its own buffer. The buffers are then added in
//! order, so that the result has the same bytes for any number of threads.
//!
//! The latent enters a layer through a bias per group. The gradient of that bias is the sum of the
//! gradients at the group's points. The gradients of the latent and of its weight columns follow
//! from that sum, once per group.

use std::ops::Range;

use rayon::prelude::*;

use crate::batch::{Batch, BatchExtent};
use crate::buffer::Buffer;
use crate::error::expect_length;
use crate::field::ForwardTile;
use crate::layer::Layer;
use crate::panels::{PANEL, pack_rows, unpack_rows};
use crate::product::{AffineProduct, Epilogue, InitialSum, Tile, affine, column_sums, no_prefetch, outer};
use crate::saved::{Retention, SavedActivations, TileLayout};
use crate::{Field, KernelError};

/// Slices that receive the gradients of the loss in a backward pass.
#[derive(Debug)]
pub struct Gradients<'a> {
    /// Gradient with respect to the points' inputs, `[points, P]`; overwritten.
    pub points: &'a mut [f32],
    /// Gradient with respect to the latents, `[groups, L]`; overwritten.
    pub latents: &'a mut [f32],
    /// Gradient with respect to the parameters, `[parameter_count]`. The pass **adds** to it,
    /// because the steps of an unrolled training share parameters.
    pub parameters: &'a mut [f32],
}

/// Buffers of the backward pass, reused from call to call. Their contents are irrelevant between
/// calls.
#[derive(Default)]
pub struct BackwardScratch {
    pub(crate) chunks: Vec<ChunkSums>,
    /// Gradients of the folded biases, summed over each group, `[groups, slots, width]`.
    pub(crate) groups: Buffer,
}

/// Parameter gradients summed over one chunk of points.
#[derive(Default)]
pub(crate) struct ChunkSums {
    /// Gradients of the weights: for each map, for each input panel, for each output, 32 inputs.
    pub(crate) weights: Buffer,
    /// Gradients of the biases of maps without latent: for each map, one value per output, in
    /// panels.
    pub(crate) biases: Buffer,
    /// Gradients of the biases of maps with latent, for each group of the chunk,
    /// `[groups, slots, width]`.
    pub(crate) groups: Buffer,
    /// Index of the chunk's first group.
    pub(crate) first_group: usize,
}

/// Inputs of a backward pass that all tiles share.
pub(crate) struct BackwardCall<'a> {
    pub(crate) field: &'a Field,
    pub(crate) batch: &'a Batch<'a>,
    pub(crate) extent: BatchExtent,
    saved: &'a SavedActivations,
    layout: TileLayout,
    /// Ranges of each map's sums in [`ChunkSums`].
    pub(crate) ranges: Vec<GradientRange>,
}

/// Ranges of one map's sums in a [`ChunkSums`].
pub(crate) struct GradientRange {
    /// Range in [`ChunkSums::weights`].
    pub(crate) weight: Range<usize>,
    /// Range in [`ChunkSums::biases`].
    pub(crate) bias: Range<usize>,
}

/// Buffers of one thread.
struct TileScratch {
    /// Gradient with respect to the current map's output, in panels.
    outer: Buffer,
    /// Gradient with respect to the current map's input, in panels.
    inner: Buffer,
    /// Gradient with respect to the points' inputs, in panels.
    points: Buffer,
    /// Activations of one tile, where the forward pass has kept none.
    activations: Buffer,
}

impl Field {
    /// Runs the backward pass that belongs to the last [`Field::forward`] into `saved`.
    ///
    /// `output_gradients` are `[points, O]`, row-major. `batch` and the parameters must be those of
    /// the forward pass.
    ///
    /// # Errors
    /// Returns [`KernelError::Length`] when a slice has the wrong length, and
    /// [`KernelError::Saved`] when `saved` belongs to another field or to a batch of another size.
    pub fn backward(
        &self,
        batch: &Batch,
        saved: &SavedActivations,
        output_gradients: &[f32],
        gradients: Gradients,
        scratch: &mut BackwardScratch,
    ) -> Result<(), KernelError> {
        let extent = batch.extent(&self.shape)?;
        saved.check(self.shape, extent)?;
        expect_length(
            "output gradients",
            extent.points * self.shape.outputs,
            output_gradients.len(),
        )?;
        expect_length(
            "point gradients",
            extent.points * self.shape.point_inputs,
            gradients.points.len(),
        )?;
        expect_length(
            "latent gradients",
            extent.groups * self.shape.latent,
            gradients.latents.len(),
        )?;
        expect_length(
            "parameter gradients",
            self.parameters.len(),
            gradients.parameters.len(),
        )?;
        let layout = TileLayout::separate(self, &extent);
        let call = BackwardCall {
            field: self,
            batch,
            extent,
            saved,
            layout,
            ranges: self.gradient_ranges(),
        };
        scratch.chunks.resize_with(extent.chunks(), ChunkSums::default);
        // Three phases: chunks in parallel, then sums per group, then sums over chunks in order.
        call.run_chunks(output_gradients, gradients.points, &mut scratch.chunks);
        self.sum_groups(&extent, scratch);
        self.latent_gradients(&scratch.groups, gradients.latents);
        call.add_parameter_gradients(scratch, gradients.parameters);
        Ok(())
    }

    /// Returns the ranges of all maps in a [`ChunkSums`].
    fn gradient_ranges(&self) -> Vec<GradientRange> {
        let (mut weights, mut biases) = (0, 0);
        let range = |layer: &Layer| {
            let weight = weights..weights + layer.input.count() * PANEL * layer.map.outputs;
            let bias = biases..biases + layer.padded_outputs();
            (weights, biases) = (weight.end, bias.end);
            GradientRange { weight, bias }
        };
        self.layers.iter().map(range).collect()
    }
}

impl BackwardCall<'_> {
    /// Runs all chunks in parallel.
    fn run_chunks(&self, output_gradients: &[f32], point_gradients: &mut [f32], chunks: &mut [ChunkSums]) {
        let points = self.extent.chunk_points();
        let outputs = output_gradients.par_chunks(points * self.field.shape.outputs);
        let inputs = point_gradients.par_chunks_mut(points * self.field.shape.point_inputs);
        chunks
            .par_iter_mut()
            .zip(outputs)
            .zip(inputs)
            .enumerate()
            .for_each_init(
                || self.tile_scratch(),
                |tile, (index, ((sums, outputs), inputs))| {
                    self.run_chunk(index * points, outputs, inputs, sums, tile)
                },
            );
    }

    /// Runs the tiles of the chunk that begins at point `first`, in order.
    fn run_chunk(
        &self,
        first: usize,
        output_gradients: &[f32],
        point_gradients: &mut [f32],
        sums: &mut ChunkSums,
        scratch: &mut TileScratch,
    ) {
        let shape = &self.field.shape;
        let tile_points = self.extent.tile_points();
        self.clear(first..first + output_gradients.len() / shape.outputs, sums);
        let outputs = output_gradients.chunks(tile_points * shape.outputs);
        let inputs = point_gradients.chunks_mut(tile_points * shape.point_inputs);
        // In order, on one thread: the sums of a chunk depend on the order of its tiles.
        for (index, (outputs, inputs)) in outputs.zip(inputs).enumerate() {
            pack_rows(outputs, shape.outputs, &mut scratch.outer, self.layout.stride);
            self.run_tile(first + index * tile_points, sums, scratch);
            unpack_rows(&scratch.points, self.layout.stride, inputs, shape.point_inputs);
        }
    }

    /// Sets the sums of a chunk to zero.
    fn clear(&self, points: Range<usize>, sums: &mut ChunkSums) {
        let field = self.field;
        let groups = self.extent.groups_of(&points);
        sums.first_group = groups.start;
        sums.weights
            .reset(self.ranges.last().map_or(0, |range| range.weight.end));
        sums.biases
            .reset(self.ranges.last().map_or(0, |range| range.bias.end));
        sums.groups
            .reset(groups.len() * field.slot_count() * field.slot_width());
    }

    /// Propagates the gradient of one tile from the head's output to the points' inputs.
    fn run_tile(&self, first: usize, sums: &mut ChunkSums, scratch: &mut TileScratch) {
        let recomputed = &mut scratch.activations;
        let activations = match self.saved.retention {
            Retention::Activations => {
                let start = first / self.extent.tile_points() * self.layout.length;
                &self.saved.activations[start..start + self.layout.length]
            }
            Retention::Recompute => {
                let Self {
                    batch,
                    extent,
                    layout,
                    ..
                } = self;
                let tile = ForwardTile {
                    batch,
                    extent,
                    layout,
                    biases: &self.saved.biases,
                    first,
                };
                self.field.forward_tile(&tile, recomputed);
                recomputed
            }
        };
        let points = self.extent.tile_at(first);
        for (index, layer) in self.field.layers.iter().enumerate().rev() {
            let input = &activations[self.layout.inputs[index].clone()];
            let gradient = Tile {
                data: &scratch.outer,
                widths: &layer.output.widths,
                stride: self.layout.stride,
            };
            self.sum_parameters(index, gradient, input, &points, sums);
            self.point_gradient(index, gradient, points.len(), &mut scratch.points);
            // Map 0 has no hidden input. The gradient by this map's input is that by the output of
            // the map before.
            if index > 0 {
                self.hidden_gradient(index, gradient, points.len(), activations, &mut scratch.inner);
                std::mem::swap(&mut scratch.outer, &mut scratch.inner);
            }
        }
    }

    /// Adds the gradients of a map's weight and bias in one tile to the sums of the chunk.
    fn sum_parameters(
        &self,
        index: usize,
        gradient: Tile,
        input: &[f32],
        points: &Range<usize>,
        sums: &mut ChunkSums,
    ) {
        let (field, range) = (self.field, &self.ranges[index]);
        let layer = &field.layers[index];
        let input = Tile {
            data: input,
            widths: &layer.input.widths,
            stride: self.layout.stride,
        };
        outer(
            field.set,
            gradient,
            input,
            points.len(),
            &mut sums.weights[range.weight.clone()],
        );
        match layer.slot {
            None => column_sums(
                field.set,
                gradient,
                0..points.len(),
                &mut sums.biases[range.bias.clone()],
            ),
            // A tile may span several groups, whose biases differ.
            Some(slot) => {
                for segment in self.extent.segments(points.clone()) {
                    let range = field.slot_range(segment.group - sums.first_group, slot);
                    column_sums(field.set, gradient, segment.rows, &mut sums.groups[range]);
                }
            }
        }
    }

    /// Computes the gradient with respect to a map's hidden input, through the ReLU before it.
    fn hidden_gradient(
        &self,
        index: usize,
        gradient: Tile,
        rows: usize,
        activations: &[f32],
        target: &mut Buffer,
    ) {
        let layer = &self.field.layers[index];
        let job = AffineProduct {
            input: gradient,
            weights: &layer.backward,
            // Without bias: sums begin at zero.
            initial: InitialSum::Bias(&ZEROS[..layer.hidden_panels * PANEL]),
            epilogue: Epilogue::ReluGradient(&activations[self.layout.inputs[index].clone()]),
            rows: 0..rows,
            output_widths: &layer.input.widths[..layer.hidden_panels],
            // The next product is that of the map before: its weights, and its input for the mask.
            prefetch: [
                self.field.layers[index - 1].backward.as_ptr_range(),
                activations[self.layout.inputs[index - 1].clone()].as_ptr_range(),
            ],
        };
        affine(self.field.set, &job, target);
    }

    /// Computes the gradient with respect to the points' inputs, if the map takes them. Maps run
    /// backwards: the skip map comes first and overwrites, map 0 adds to it.
    fn point_gradient(&self, index: usize, gradient: Tile, rows: usize, target: &mut Buffer) {
        let layer = &self.field.layers[index];
        if layer.slot.is_none() {
            return;
        }
        let is_first = self.field.shape.skip.is_none_or(|skip| skip == index);
        let job = AffineProduct {
            input: gradient,
            weights: &layer.backward[layer.hidden_panels * PANEL * layer.map.outputs..],
            initial: if is_first {
                InitialSum::Bias(&ZEROS)
            } else {
                InitialSum::Output
            },
            epilogue: Epilogue::Identity,
            rows: 0..rows,
            output_widths: &layer.input.widths[layer.hidden_panels..],
            prefetch: [no_prefetch(), no_prefetch()],
        };
        affine(self.field.set, &job, target);
    }

    fn tile_scratch(&self) -> TileScratch {
        // No map has more outputs than a slot is wide.
        let widest = self.field.slot_width() / PANEL * self.layout.stride;
        let activations = match self.saved.retention {
            Retention::Activations => 0,
            Retention::Recompute => self.layout.length,
        };
        TileScratch {
            outer: Buffer::zeros(widest),
            inner: Buffer::zeros(widest),
            points: Buffer::zeros(self.field.shape.point_inputs.div_ceil(PANEL) * self.layout.stride),
            activations: Buffer::zeros(activations),
        }
    }
}

/// The bias of products without bias.
static ZEROS: [f32; crate::FieldShape::MAX_WIDTH] = [0.0; crate::FieldShape::MAX_WIDTH];
