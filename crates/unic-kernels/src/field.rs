//! The field: loading of parameters, forward pass and inference.

use std::ops::Range;

use rayon::prelude::*;

use crate::batch::{Batch, BatchExtent};
use crate::buffer::Buffer;
use crate::error::expect_length;
use crate::layer::Layer;
use crate::panels::{PANEL, pack_rows, unpack_rows};
use crate::product::{AffineProduct, Epilogue, InitialSum, Tile, affine, no_prefetch};
use crate::saved::{Retention, SavedActivations, TileLayout};
use crate::{FieldShape, InstructionSet, KernelError};

/// A garment field with its parameters packed for this processor.
///
/// Parameters are one flat vector, whose layout [`FieldShape::layout`] defines. They have to be
/// loaded with [`Field::load`] after every optimiser step, which costs about as much as the forward
/// pass of two hundred points.
pub struct Field {
    pub(crate) shape: FieldShape,
    pub(crate) layers: Vec<Layer>,
    /// Parameters as loaded.
    pub(crate) parameters: Vec<f32>,
    /// Instructions that the products run on.
    pub(crate) set: InstructionSet,
}

impl Field {
    /// Creates a field with parameters of zero that runs on the widest exact instruction set of
    /// this processor.
    ///
    /// # Errors
    /// Returns [`KernelError::Size`] when a size is out of range.
    pub fn new(shape: FieldShape) -> Result<Self, KernelError> {
        Self::with_instructions(shape, InstructionSet::detect())
    }

    /// Creates a field with parameters of zero that runs on the given instruction set.
    ///
    /// # Errors
    /// Returns [`KernelError::Instructions`] when this processor does not have the set, and the
    /// errors of [`Field::new`].
    pub fn with_instructions(shape: FieldShape, set: InstructionSet) -> Result<Self, KernelError> {
        shape.validate()?;
        if !set.is_available() {
            return Err(KernelError::Instructions(set));
        }
        let slots = &mut (0..);
        let layers = shape.layout().into_iter().map(|map| {
            let slot = if map.point_inputs > 0 { slots.next() } else { None };
            Layer::new(map, slot)
        });
        Ok(Self {
            layers: layers.collect(),
            parameters: vec![0.0; shape.parameter_count()],
            shape,
            set,
        })
    }

    /// Returns the field's sizes.
    pub fn shape(&self) -> &FieldShape {
        &self.shape
    }

    /// Loads and packs new parameters, `[parameter_count]`.
    ///
    /// # Errors
    /// Returns [`KernelError::Length`] when there are too few or too many.
    pub fn load(&mut self, parameters: &[f32]) -> Result<(), KernelError> {
        expect_length("parameters", self.parameters.len(), parameters.len())?;
        self.parameters.copy_from_slice(parameters);
        self.layers
            .par_iter_mut()
            .for_each(|layer| layer.load(parameters));
        Ok(())
    }

    /// Runs the forward pass into `outputs`, `[points, O]`, row-major. What the backward pass needs
    /// is kept in `saved`.
    ///
    /// # Errors
    /// Returns [`KernelError::Length`] when a slice does not fit the field or the batch.
    pub fn forward(
        &self,
        batch: &Batch,
        outputs: &mut [f32],
        saved: &mut SavedActivations,
    ) -> Result<(), KernelError> {
        let extent = batch.extent(&self.shape)?;
        expect_length("outputs", extent.points * self.shape.outputs, outputs.len())?;
        match saved.retention {
            Retention::Activations => {
                let layout = TileLayout::separate(self, &extent);
                saved.prepare(self, batch, extent, layout.length * extent.tiles());
                let activations = saved.activations.par_chunks_mut(layout.length);
                self.tile_outputs(&extent, outputs).zip(activations).for_each(
                    |((first, outputs), activations)| {
                        let tile = ForwardTile {
                            batch,
                            extent: &extent,
                            layout: &layout,
                            biases: &saved.biases,
                            first,
                        };
                        self.forward_tile(&tile, activations);
                        self.unpack_outputs(&layout, activations, outputs);
                    },
                );
            }
            Retention::Recompute => {
                saved.prepare(self, batch, extent, 0);
                self.evaluate(batch, &extent, &saved.biases, outputs);
            }
        }
        Ok(())
    }

    /// Evaluates the field into `outputs`, `[points, O]`, row-major, without keeping activations.
    ///
    /// # Errors
    /// Returns [`KernelError::Length`] when a slice does not fit the field or the batch.
    pub fn infer(&self, batch: &Batch, outputs: &mut [f32]) -> Result<(), KernelError> {
        let extent = batch.extent(&self.shape)?;
        expect_length("outputs", extent.points * self.shape.outputs, outputs.len())?;
        let mut biases = Buffer::default();
        self.fold_latents(batch, &extent, &mut biases);
        self.evaluate(batch, &extent, &biases, outputs);
        Ok(())
    }

    /// Runs all tiles through two alternating buffers of activations, which stay in cache.
    fn evaluate(&self, batch: &Batch, extent: &BatchExtent, biases: &Buffer, outputs: &mut [f32]) {
        let layout = TileLayout::alternating(self, extent);
        self.tile_outputs(extent, outputs).for_each_init(
            || Buffer::zeros(layout.length),
            |activations, (first, outputs)| {
                let tile = ForwardTile {
                    batch,
                    extent,
                    layout: &layout,
                    biases,
                    first,
                };
                self.forward_tile(&tile, activations);
                self.unpack_outputs(&layout, activations, outputs);
            },
        );
    }

    /// Lists the first point of each tile with its part of the outputs.
    fn tile_outputs<'a>(
        &self,
        extent: &BatchExtent,
        outputs: &'a mut [f32],
    ) -> impl IndexedParallelIterator<Item = (usize, &'a mut [f32])> + use<'a> {
        let points = extent.tile_points();
        let tiles = outputs.par_chunks_mut(points * self.shape.outputs).enumerate();
        tiles.map(move |(tile, outputs)| (tile * points, outputs))
    }

    /// Computes the biases of the maps that take the latent, with the latent folded in:
    /// `[groups, slots, width]`.
    pub(crate) fn fold_latents(&self, batch: &Batch, extent: &BatchExtent, biases: &mut Buffer) {
        let width = self.slot_width();
        biases.resize(extent.groups * self.slot_count() * width);
        // On one thread: per group this is usually less work than one point.
        for (layer, slot) in self.latent_layers() {
            for group in 0..extent.groups {
                let latent = &batch.latents[group * self.shape.latent..(group + 1) * self.shape.latent];
                let bias = &mut biases[self.slot_range(group, slot)];
                layer.fold_latent(latent, &mut bias[..layer.padded_outputs()]);
            }
        }
    }

    /// Runs one tile through all maps. The layout defines the place of each map's input in
    /// `activations`.
    pub(crate) fn forward_tile(&self, tile: &ForwardTile, activations: &mut [f32]) {
        let stride = tile.layout.stride;
        let points = tile.extent.tile_at(tile.first);
        let inputs = self.shape.point_inputs;
        let x = &tile.batch.points[points.start * inputs..points.end * inputs];
        for (index, layer) in self.layers.iter().enumerate() {
            let source = tile.layout.inputs[index].clone();
            // The point's inputs follow the hidden panels that the map before has written.
            if layer.slot.is_some() {
                pack_rows(
                    x,
                    inputs,
                    &mut activations[source.clone()][layer.hidden_panels * stride..],
                    stride,
                );
            }
            let (input, output) = split_disjoint(activations, source, tile.layout.inputs[index + 1].clone());
            let input = Tile {
                data: input,
                widths: &layer.input.widths,
                stride,
            };
            let epilogue = if index == self.shape.hidden_layers {
                Epilogue::Identity
            } else {
                Epilogue::Relu
            };
            self.forward_layer(tile, index, input, epilogue, output);
        }
    }

    /// Runs one map on one tile. A map with latent runs group by group, because the folded bias
    /// differs between groups.
    fn forward_layer(
        &self,
        tile: &ForwardTile,
        index: usize,
        input: Tile,
        epilogue: Epilogue,
        output: &mut [f32],
    ) {
        let layer = &self.layers[index];
        let points = tile.extent.tile_at(tile.first);
        let next = self
            .layers
            .get(index + 1)
            .map_or(no_prefetch(), |layer| layer.forward.as_ptr_range());
        // While a map runs, the weights of the next one are prefetched.
        let mut run = |bias, rows| {
            let job = AffineProduct {
                input,
                weights: &layer.forward,
                initial: InitialSum::Bias(bias),
                epilogue,
                rows,
                output_widths: &layer.output.widths,
                prefetch: [next.clone(), no_prefetch()],
            };
            affine(self.set, &job, output);
        };
        match layer.slot {
            None => run(&layer.bias, 0..points.len()),
            Some(slot) => {
                for segment in tile.extent.segments(points) {
                    run(&tile.biases[self.slot_range(segment.group, slot)], segment.rows);
                }
            }
        }
    }

    /// Copies the head's output of one tile from panels to row-major `outputs`.
    fn unpack_outputs(&self, layout: &TileLayout, activations: &[f32], outputs: &mut [f32]) {
        let head = layout.inputs[self.layers.len()].clone();
        unpack_rows(&activations[head], layout.stride, outputs, self.shape.outputs);
    }

    /// Returns the number of maps that take the latent. Each has a slot, numbered in order.
    pub(crate) fn slot_count(&self) -> usize {
        1 + usize::from(self.shape.skip.is_some())
    }

    /// Returns the number of values per group and slot: the widest map's outputs, in whole panels.
    pub(crate) fn slot_width(&self) -> usize {
        self.shape.hidden.max(self.shape.outputs).next_multiple_of(PANEL)
    }

    /// Returns the range of a group's slot in an array `[groups, slots, width]`.
    pub(crate) fn slot_range(&self, group: usize, slot: usize) -> Range<usize> {
        let start = (group * self.slot_count() + slot) * self.slot_width();
        start..start + self.slot_width()
    }

    /// Lists the layers that take the latent, with their slots.
    pub(crate) fn latent_layers(&self) -> impl Iterator<Item = (&Layer, usize)> {
        self.layers
            .iter()
            .filter_map(|layer| layer.slot.map(|slot| (layer, slot)))
    }
}

/// One tile of a forward pass.
pub(crate) struct ForwardTile<'a> {
    pub(crate) batch: &'a Batch<'a>,
    pub(crate) extent: &'a BatchExtent,
    pub(crate) layout: &'a TileLayout,
    /// Biases with the latent folded in, `[groups, slots, width]`.
    pub(crate) biases: &'a Buffer,
    /// Index of the tile's first point.
    pub(crate) first: usize,
}

/// Borrows two ranges of one slice that do not overlap: the first to read, the second to write.
fn split_disjoint(data: &mut [f32], read: Range<usize>, write: Range<usize>) -> (&[f32], &mut [f32]) {
    if read.start < write.start {
        let (head, tail) = data.split_at_mut(write.start);
        (&head[read], &mut tail[..write.len()])
    } else {
        let (head, tail) = data.split_at_mut(read.start);
        (&tail[..read.len()], &mut head[write])
    }
}
