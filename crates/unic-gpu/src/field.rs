//! Kernel of the deformation field, generated for the sizes of a model.

mod blocks;
mod source;
mod tiles;

use crate::{
    GpuContext, GpuError, Precision,
    animator::Buffers,
    kernel::{Dispatch, Kernel, Source},
};
use blocks::{Blocks, Real};
use std::ops::Range;
use tiles::Tiles;
use unic_core::{Model, network::Linear};
use wgpu::{Buffer, Features};

/// Sizes of a field on a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FieldShape {
    /// Width of the hidden layers, padded to whole blocks.
    pub(crate) width: usize,
    /// Number of hidden layers.
    layers: usize,
    /// Index of the layer that reads the inputs again.
    skip: Option<usize>,
    /// Number of point inputs.
    inputs: usize,
    tile: Tile,
}

/// Partition of a tile of vertices, which one workgroup evaluates through all layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tile {
    /// Blocks in the registers of each invocation.
    Blocks(Blocks),
    /// Matrices in matrix units.
    Tiles(Tiles),
}

/// Field on the device. Asset.
#[derive(Debug)]
pub(crate) struct FieldKernel {
    pub(crate) shape: FieldShape,
    kernel: Kernel,
    hidden_weights: Buffer,
    /// Weights of the point inputs and of the head.
    edge_weights: Buffer,
    /// Number of tiles.
    tiles: usize,
}

impl FieldShape {
    /// Chooses the largest tiles for a model's field that fit the device.
    ///
    /// # Errors
    /// Fails when the device does not have the precision or the field is too wide for it.
    pub(crate) fn new(context: &GpuContext, model: &Model, precision: Precision) -> Result<Self, GpuError> {
        let config = &model.config().field;
        let limits = context.device().limits();
        if precision != Precision::F32 && !context.has(Features::SHADER_F16) {
            return Err(GpuError::Feature {
                what: "half precision",
                feature: "SHADER_F16",
            });
        }
        let tile = match precision {
            Precision::F32 => Tile::Blocks(Blocks::new(Real::Single, config.width, &limits)?),
            Precision::F16 => Tile::Blocks(Blocks::new(Real::Half, config.width, &limits)?),
            Precision::F16Matrix => {
                let units = context.needed_matrix_units()?;
                Tile::Tiles(Tiles::new(units, config.width, &limits)?)
            }
        };
        Ok(Self {
            width: match tile {
                Tile::Blocks(blocks) => blocks.width(),
                Tile::Tiles(tiles) => tiles.width(),
            },
            layers: config.hidden_layers,
            skip: config.skip,
            inputs: model.field().point_inputs(),
            tile,
        })
    }

    /// Number of vertices in a tile.
    pub(crate) fn lanes(&self) -> usize {
        match self.tile {
            Tile::Blocks(blocks) => blocks.lanes(),
            Tile::Tiles(tiles) => tiles.lanes(),
        }
    }

    fn source(&self, model: &Model, biases: usize) -> String {
        match &self.tile {
            Tile::Blocks(blocks) => blocks.source(self, model, biases),
            Tile::Tiles(tiles) => tiles.source(self, model, biases),
        }
    }

    /// Length of one input channel of a number of vertices, padded to whole tiles.
    pub(crate) fn stride(&self, vertices: usize) -> usize {
        vertices.next_multiple_of(self.lanes())
    }

    /// Length of the biases of all layers with the head's, which is padded to four.
    pub(crate) fn biases(&self) -> usize {
        self.layers * self.width + 4
    }

    /// Returns whether a layer has the latent vector among its inputs.
    pub(crate) fn reads_latent(&self, layer: usize) -> bool {
        layer == 0 || self.skip == Some(layer)
    }

    /// Writes the layers' own biases, without the products with the latent vector.
    pub(crate) fn write_biases(&self, layers: &[Linear], out: &mut [f32]) {
        for (layer, out) in layers.iter().zip(out.chunks_mut(self.width)) {
            out[..layer.bias.len()].copy_from_slice(&layer.bias);
        }
    }

    /// Number of multiply-adds of one vertex, without padding.
    fn products(&self, model: &Model) -> usize {
        let layers = model.field().layers().iter().enumerate();
        let used = layers.map(|(i, layer)| match self.reads_latent(i) {
            true => layer.weight.len() - layer.outputs * model.config().encoder.latent_len(),
            false => layer.weight.len(),
        });
        used.sum()
    }
}

/// Columns of a layer that multiply the latent vector: the last ones.
pub(crate) fn latent_columns(model: &Model, layer: &Linear) -> Range<usize> {
    layer.inputs - model.config().encoder.latent_len()..layer.inputs
}

impl FieldKernel {
    pub(crate) fn new(
        context: &GpuContext,
        model: &Model,
        shape: FieldShape,
        precision: Precision,
        biases: usize,
    ) -> Self {
        let text = shape.source(model, biases);
        let source = Source {
            text: &text,
            entry: "field",
            constants: &[],
        };
        let hidden = hidden_weights(&shape, model.field().layers());
        Self {
            shape,
            // SAFETY: all indices are bounded by constants of this shape. Rows and columns of the
            // weights are packed below, inputs come in whole tiles, activations and chunks have the
            // declared lengths, and states are guarded by the number of vertices. `staged` has room
            // for the blocks of all jobs and one more, into which subgroups without a job write
            // numbers that nobody reads. All loops count to constants.
            kernel: unsafe { Kernel::unchecked(context, &source) },
            hidden_weights: context.upload_weights("hidden weights", precision, &hidden),
            edge_weights: context.upload("edge weights", &edge_weights(&shape, model)),
            tiles: model.vertex_count().div_ceil(shape.lanes()),
        }
    }

    pub(crate) fn dispatch(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        let bindings = [
            (0, &self.hidden_weights),
            (1, &self.edge_weights),
            (2, &buffers.vectors),
            (3, &buffers.inputs),
            (4, &buffers.states),
        ];
        self.kernel.dispatch(&bindings, self.tiles)
    }

    /// Number of floating-point operations of one vertex, two for each multiply-add. Products with
    /// the latent vector are excluded.
    pub(crate) fn flop_per_vertex(&self, model: &Model) -> usize {
        2 * self.shape.products(model)
    }
}

/// Packs the weights of the hidden inputs of layers 1 and up: layer by layer, input by input, with
/// the outputs adjacent.
// The transpose of the model's rows: neighbouring invocations compute neighbouring outputs, so that
// they read adjacent weights.
fn hidden_weights(shape: &FieldShape, layers: &[Linear]) -> Vec<f32> {
    let width = shape.width;
    let mut packed = vec![0.0; (shape.layers - 1) * width * width];
    let inner = layers.iter().take(shape.layers).skip(1);
    for (layer, packed) in inner.zip(packed.chunks_exact_mut(width * width)) {
        for (row, weights) in layer.weight.chunks_exact(layer.inputs).enumerate() {
            // A hidden layer has as many hidden inputs as outputs; further columns are inputs of
            // the skip layer.
            for (column, weight) in weights[..layer.outputs].iter().enumerate() {
                packed[column * width + row] = *weight;
            }
        }
    }
    packed
}

/// Packs the weights of the point inputs of the first and the skip layer in the same order, and
/// then the head's rows.
fn edge_weights(shape: &FieldShape, model: &Model) -> Vec<f32> {
    let (layers, width) = (model.field().layers(), shape.width);
    let mut packed = Vec::new();
    for layer in (0..shape.layers)
        .filter(|&i| shape.reads_latent(i))
        .map(|i| &layers[i])
    {
        let points = latent_columns(model, layer).start - shape.inputs..latent_columns(model, layer).start;
        for column in points {
            let rows = layer.weight.chunks_exact(layer.inputs);
            packed.extend(rows.map(|row| row[column]));
            packed.resize(packed.len().next_multiple_of(width), 0.0);
        }
    }
    // Room for the skip layer even without one, so that the head has a fixed place.
    packed.resize(2 * shape.inputs * width, 0.0);
    let head = &layers[shape.layers];
    for row in head.weight.chunks_exact(head.inputs) {
        packed.extend_from_slice(row);
        packed.resize(packed.len().next_multiple_of(width), 0.0);
    }
    packed
}
