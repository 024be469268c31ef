//! The field's backward pass.
//!
//! Points are cut into chunks whose number depends on the batch alone. A chunk walks its tiles in order and sums the
//! parameters' gradients in a buffer of its own; the buffers are then summed in order. So the result has the same
//! bytes for any number of threads.
//!
//! The latent never reaches a point: the gradient of a group's folded bias is the sum of its points' gradients, and
//! from that sum follow, once a group, the gradients of the latent and of its columns of the weights.

use std::ops::Range;

use rayon::prelude::*;

use crate::batch::{Batch, Extent};
use crate::buffer::Buffer;
use crate::error::expect_length;
use crate::field::ForwardTile;
use crate::layer::Layer;
use crate::panels::{PANEL, gather, scatter};
use crate::product::{Affine, Finish, Start, Tile, affine, column_sums, nothing, outer};
use crate::saved::{Retention, Saved, TileLayout};
use crate::{Field, KernelError};

/// Where backward puts the loss's gradients.
#[derive(Debug)]
pub struct Gradients<'a> {
    /// By the points' inputs, `[points, P]`; overwritten.
    pub points: &'a mut [f32],
    /// By the latents, `[groups, L]`; overwritten.
    pub latents: &'a mut [f32],
    /// By the parameters, `[parameter_count]`; **added to**, since the steps of an unrolled training share them.
    pub parameters: &'a mut [f32],
}

/// Buffers of backward, to reuse from call to call. Holds nothing between calls.
#[derive(Default)]
pub struct BackwardScratch {
    pub(crate) chunks: Vec<ChunkSums>,
    /// Sums over each group of the folded biases' gradients, `[groups, slots, width]`.
    pub(crate) groups: Buffer,
}

/// Gradients summed over one chunk.
#[derive(Default)]
pub(crate) struct ChunkSums {
    /// For each map, for each input panel, for each output, 32 inputs.
    pub(crate) weights: Buffer,
    /// For each map without latent, one number an output, in panels.
    pub(crate) biases: Buffer,
    /// The same for maps with latent, for each group of the chunk, `[groups, slots, width]`.
    pub(crate) groups: Buffer,
    pub(crate) first_group: usize,
}

/// What all tiles of a call share.
pub(crate) struct Call<'a> {
    pub(crate) field: &'a Field,
    pub(crate) batch: &'a Batch<'a>,
    pub(crate) extent: Extent,
    saved: &'a Saved,
    layout: TileLayout,
    /// Where each map's sums lie in [`ChunkSums::weights`] and [`ChunkSums::biases`].
    pub(crate) places: Vec<Place>,
}

pub(crate) struct Place {
    pub(crate) weight: Range<usize>,
    pub(crate) bias: Range<usize>,
}

/// Buffers of one thread.
struct TileScratch {
    /// Gradient by a map's output, in panels.
    outer: Buffer,
    /// Gradient by its input, in panels.
    inner: Buffer,
    /// Gradient by the points' inputs, in panels.
    points: Buffer,
    /// Activations of one tile where forward has kept none.
    activations: Buffer,
}

impl Field {
    /// Propagates `output_gradients`, `[points, O]` row-major, through the last [`Field::forward`] into `saved`.
    ///
    /// `batch` and the parameters must be those of that forward.
    ///
    /// # Errors
    /// [`KernelError::Length`] when a slice does not fit, [`KernelError::Saved`] when `saved` was made for another
    /// field or other sizes.
    pub fn backward(
        &self,
        batch: &Batch,
        saved: &Saved,
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
        let call = Call {
            field: self,
            batch,
            extent,
            saved,
            layout,
            places: self.places(),
        };
        scratch.chunks.resize_with(extent.chunks(), ChunkSums::default);
        call.run_chunks(output_gradients, gradients.points, &mut scratch.chunks);
        self.sum_groups(&extent, scratch);
        self.latent_gradients(&scratch.groups, gradients.latents);
        call.add_parameter_gradients(scratch, gradients.parameters);
        Ok(())
    }

    fn places(&self) -> Vec<Place> {
        let (mut weights, mut biases) = (0, 0);
        let place = |layer: &Layer| {
            let weight = weights..weights + layer.input.count() * PANEL * layer.map.outputs;
            let bias = biases..biases + layer.padded_outputs();
            (weights, biases) = (weight.end, bias.end);
            Place { weight, bias }
        };
        self.layers.iter().map(place).collect()
    }
}

impl Call<'_> {
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

    /// All tiles of the chunk that starts at point `first`.
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
        for (index, (outputs, inputs)) in outputs.zip(inputs).enumerate() {
            scatter(outputs, shape.outputs, &mut scratch.outer, self.layout.stride);
            self.run_tile(first + index * tile_points, sums, scratch);
            gather(&scratch.points, self.layout.stride, inputs, shape.point_inputs);
        }
    }

    fn clear(&self, points: Range<usize>, sums: &mut ChunkSums) {
        let field = self.field;
        let groups = self.extent.groups_of(&points);
        sums.first_group = groups.start;
        sums.weights
            .reset(self.places.last().map_or(0, |place| place.weight.end));
        sums.biases
            .reset(self.places.last().map_or(0, |place| place.bias.end));
        sums.groups
            .reset(groups.len() * field.slots() * field.slot_width());
    }

    /// Takes one tile from the gradient by the head's output to that by the points' inputs.
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
            if index > 0 {
                self.hidden_gradient(index, gradient, points.len(), activations, &mut scratch.inner);
                std::mem::swap(&mut scratch.outer, &mut scratch.inner);
            }
        }
    }

    /// Adds the tile's share to the gradients of a map's weight and bias.
    fn sum_parameters(
        &self,
        index: usize,
        gradient: Tile,
        input: &[f32],
        points: &Range<usize>,
        sums: &mut ChunkSums,
    ) {
        let (field, place) = (self.field, &self.places[index]);
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
            &mut sums.weights[place.weight.clone()],
        );
        match layer.slot {
            None => column_sums(
                field.set,
                gradient,
                0..points.len(),
                &mut sums.biases[place.bias.clone()],
            ),
            Some(slot) => {
                for segment in self.extent.segments(points.clone()) {
                    let range = field.slot_range(segment.group - sums.first_group, slot);
                    column_sums(field.set, gradient, segment.rows, &mut sums.groups[range]);
                }
            }
        }
    }

    /// Gradient by a map's hidden input, through the ReLU that made it.
    fn hidden_gradient(
        &self,
        index: usize,
        gradient: Tile,
        rows: usize,
        activations: &[f32],
        target: &mut Buffer,
    ) {
        let layer = &self.field.layers[index];
        let job = Affine {
            input: gradient,
            weights: &layer.backward,
            start: Start::Bias(&ZEROS[..layer.hidden_panels * PANEL]),
            finish: Finish::Gate(&activations[self.layout.inputs[index].clone()]),
            rows: 0..rows,
            output_widths: &layer.input.widths[..layer.hidden_panels],
            ahead: [
                self.field.layers[index - 1].backward.as_ptr_range(),
                activations[self.layout.inputs[index - 1].clone()].as_ptr_range(),
            ],
        };
        affine(self.field.set, &job, target);
    }

    /// Share of a map that takes the points' inputs; the skip comes first and map 0 adds to it.
    fn point_gradient(&self, index: usize, gradient: Tile, rows: usize, target: &mut Buffer) {
        let layer = &self.field.layers[index];
        if layer.slot.is_none() {
            return;
        }
        let is_first = self.field.shape.skip.is_none_or(|skip| skip == index);
        let job = Affine {
            input: gradient,
            weights: &layer.backward[layer.hidden_panels * PANEL * layer.map.outputs..],
            start: if is_first {
                Start::Bias(&ZEROS)
            } else {
                Start::Output
            },
            finish: Finish::Keep,
            rows: 0..rows,
            output_widths: &layer.input.widths[layer.hidden_panels..],
            ahead: [nothing(), nothing()],
        };
        affine(self.field.set, &job, target);
    }

    fn tile_scratch(&self) -> TileScratch {
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

/// Sums of the input gradients start here.
static ZEROS: [f32; crate::FieldShape::MAX_WIDTH] = [0.0; crate::FieldShape::MAX_WIDTH];
