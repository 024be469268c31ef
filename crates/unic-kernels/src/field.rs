//! The field: loading parameters, forward and inference.

use std::ops::Range;

use rayon::prelude::*;

use crate::batch::{Batch, Extent};
use crate::buffer::Buffer;
use crate::error::expect_length;
use crate::layer::Layer;
use crate::panels::{PANEL, gather, scatter};
use crate::product::{Affine, Finish, Start, Tile, affine, nothing};
use crate::saved::{Retention, Saved, TileLayout};
use crate::{FieldShape, InstructionSet, KernelError};

/// A garment field with its parameters packed for this processor.
///
/// Parameters come as one flat vector, [`FieldShape::layout`] says where each lies. After an optimiser step,
/// [`Field::load`] packs them again; that costs about as much as two hundred points' forward.
pub struct Field {
    pub(crate) shape: FieldShape,
    pub(crate) layers: Vec<Layer>,
    pub(crate) parameters: Vec<f32>,
    pub(crate) set: InstructionSet,
}

impl Field {
    /// A field whose parameters are all zero, on the widest instructions of this processor.
    ///
    /// # Errors
    /// [`KernelError::Size`] when a size is out of range.
    pub fn new(shape: FieldShape) -> Result<Self, KernelError> {
        Self::with_instructions(shape, InstructionSet::detect())
    }

    /// The same on the given instructions.
    ///
    /// # Errors
    /// [`KernelError::Instructions`] when this processor lacks them, and those of [`Field::new`].
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

    /// The field's sizes.
    pub fn shape(&self) -> &FieldShape {
        &self.shape
    }

    /// Takes new parameters, `[parameter_count]`.
    ///
    /// # Errors
    /// [`KernelError::Length`] when there are too few or too many.
    pub fn load(&mut self, parameters: &[f32]) -> Result<(), KernelError> {
        expect_length("parameters", self.parameters.len(), parameters.len())?;
        self.parameters.copy_from_slice(parameters);
        self.layers
            .par_iter_mut()
            .for_each(|layer| layer.load(parameters));
        Ok(())
    }

    /// Evaluates the field into `outputs`, `[points, O]` row-major, and keeps in `saved` what backward needs.
    ///
    /// # Errors
    /// [`KernelError::Length`] when a slice does not fit the field or the batch.
    pub fn forward(&self, batch: &Batch, outputs: &mut [f32], saved: &mut Saved) -> Result<(), KernelError> {
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
                        self.read_head(&layout, activations, outputs);
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

    /// Evaluates the field into `outputs`, `[points, O]` row-major, and keeps nothing.
    ///
    /// # Errors
    /// [`KernelError::Length`] when a slice does not fit the field or the batch.
    pub fn infer(&self, batch: &Batch, outputs: &mut [f32]) -> Result<(), KernelError> {
        let extent = batch.extent(&self.shape)?;
        expect_length("outputs", extent.points * self.shape.outputs, outputs.len())?;
        let mut biases = Buffer::default();
        self.fold_latents(batch, &extent, &mut biases);
        self.evaluate(batch, &extent, &biases, outputs);
        Ok(())
    }

    /// Forward through two alternating layers of activations, which stay in cache.
    fn evaluate(&self, batch: &Batch, extent: &Extent, biases: &Buffer, outputs: &mut [f32]) {
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
                self.read_head(&layout, activations, outputs);
            },
        );
    }

    /// Each tile's first point and its part of the outputs.
    fn tile_outputs<'a>(
        &self,
        extent: &Extent,
        outputs: &'a mut [f32],
    ) -> impl IndexedParallelIterator<Item = (usize, &'a mut [f32])> + use<'a> {
        let points = extent.tile_points();
        let tiles = outputs.par_chunks_mut(points * self.shape.outputs).enumerate();
        tiles.map(move |(tile, outputs)| (tile * points, outputs))
    }

    /// Biases of the maps that take the latent, with the latent folded in: `[groups, slots, width]`.
    pub(crate) fn fold_latents(&self, batch: &Batch, extent: &Extent, biases: &mut Buffer) {
        let width = self.slot_width();
        biases.resize(extent.groups * self.slots() * width);
        for (layer, slot) in self.latent_layers() {
            for group in 0..extent.groups {
                let latent = &batch.latents[group * self.shape.latent..(group + 1) * self.shape.latent];
                let bias = &mut biases[self.slot_range(group, slot)];
                layer.fold_latent(latent, &mut bias[..layer.padded_outputs()]);
            }
        }
    }

    /// Runs one tile through all maps; the layout says where in `activations` each map's input lies.
    pub(crate) fn forward_tile(&self, tile: &ForwardTile, activations: &mut [f32]) {
        let stride = tile.layout.stride;
        let points = tile.extent.tile_at(tile.first);
        let inputs = self.shape.point_inputs;
        let x = &tile.batch.points[points.start * inputs..points.end * inputs];
        for (index, layer) in self.layers.iter().enumerate() {
            let source = tile.layout.inputs[index].clone();
            if layer.slot.is_some() {
                scatter(
                    x,
                    inputs,
                    &mut activations[source.clone()][layer.hidden_panels * stride..],
                    stride,
                );
            }
            let (input, output) = pair(activations, source, tile.layout.inputs[index + 1].clone());
            let input = Tile {
                data: input,
                widths: &layer.input.widths,
                stride,
            };
            let finish = if index == self.shape.hidden_layers {
                Finish::Keep
            } else {
                Finish::Relu
            };
            self.forward_layer(tile, index, input, finish, output);
        }
    }

    /// One map on one tile: at once, or group by group where the bias holds the latent's share.
    fn forward_layer(
        &self,
        tile: &ForwardTile,
        index: usize,
        input: Tile,
        finish: Finish,
        output: &mut [f32],
    ) {
        let layer = &self.layers[index];
        let points = tile.extent.tile_at(tile.first);
        let next = self
            .layers
            .get(index + 1)
            .map_or(nothing(), |layer| layer.forward.as_ptr_range());
        let mut run = |bias, rows| {
            let job = Affine {
                input,
                weights: &layer.forward,
                start: Start::Bias(bias),
                finish,
                rows,
                output_widths: &layer.output.widths,
                ahead: [next.clone(), nothing()],
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

    fn read_head(&self, layout: &TileLayout, activations: &[f32], outputs: &mut [f32]) {
        let head = layout.inputs[self.layers.len()].clone();
        gather(&activations[head], layout.stride, outputs, self.shape.outputs);
    }

    /// Maps that take the latent.
    pub(crate) fn slots(&self) -> usize {
        1 + usize::from(self.shape.skip.is_some())
    }

    /// Numbers kept for each group and slot.
    pub(crate) fn slot_width(&self) -> usize {
        self.shape.hidden.max(self.shape.outputs).next_multiple_of(PANEL)
    }

    /// Where a group's numbers of a slot lie in `[groups, slots, width]`.
    pub(crate) fn slot_range(&self, group: usize, slot: usize) -> Range<usize> {
        let start = (group * self.slots() + slot) * self.slot_width();
        start..start + self.slot_width()
    }

    pub(crate) fn latent_layers(&self) -> impl Iterator<Item = (&Layer, usize)> {
        self.layers
            .iter()
            .filter_map(|layer| layer.slot.map(|slot| (layer, slot)))
    }
}

/// One tile of a forward pass.
pub(crate) struct ForwardTile<'a> {
    pub(crate) batch: &'a Batch<'a>,
    pub(crate) extent: &'a Extent,
    pub(crate) layout: &'a TileLayout,
    pub(crate) biases: &'a Buffer,
    /// The tile's first point.
    pub(crate) first: usize,
}

/// Two ranges of one slice that do not overlap: the first to read, the second to write.
fn pair(data: &mut [f32], read: Range<usize>, write: Range<usize>) -> (&[f32], &mut [f32]) {
    if read.start < write.start {
        let (head, tail) = data.split_at_mut(write.start);
        (&head[read], &mut tail[..write.len()])
    } else {
        let (head, tail) = data.split_at_mut(read.start);
        (&tail[..read.len()], &mut head[write])
    }
}
