//! Layers of the field in the memory layout that their kernel reads.

use super::{Linear, arithmetic::Arithmetic, kernel::Kernel};
use crate::simd::AlignedWords;

/// One layer, its weights in blocks of outputs.
#[derive(Clone, Debug)]
pub(super) struct PackedLayer {
    /// Number of outputs, padded to whole blocks.
    pub(super) rows: usize,
    /// Words of activations that a row reads; zero in the first layer.
    pub(super) groups: usize,
    /// Weights of the activations as words, block after block.
    pub(super) weights: AlignedWords,
    /// Scale of each row's weights, 1 for floating-point formats.
    pub(super) row_scales: Vec<f32>,
    /// Weights of the vertex's inputs in f32, row after row; empty where the layer reads none.
    pub(super) point_weights: Vec<f32>,
    /// Inputs of the vertex that each row reads.
    pub(super) point_inputs: usize,
    /// First column of `Linear::weight` that multiplies the latent vector, where the layer reads
    /// it.
    pub(super) latent: Option<usize>,
}

/// Columns of a layer's weights by what they multiply; the rest multiply the latent vector.
#[derive(Clone, Copy)]
pub(super) struct Columns {
    /// Columns for activations of the previous layer, which come first.
    pub(super) hidden: usize,
    /// Columns for inputs of the vertex, which come second.
    pub(super) points: usize,
}

impl PackedLayer {
    /// Packs a layer for the kernel `K`.
    pub(super) fn new<K: Kernel>(layer: &Linear, columns: Columns) -> Self {
        let Columns { hidden, points } = columns;
        let padded = |count: usize| count.next_multiple_of(K::ROWS.max(K::PADDED));
        let channels = <K::Arithmetic as Arithmetic>::CHANNELS;
        let (rows, groups) = (padded(layer.outputs), padded(hidden) / channels);
        let mut packed = Self {
            rows,
            groups,
            weights: AlignedWords::zeroed(rows * groups),
            row_scales: vec![1.0; rows],
            point_weights: Vec::new(),
            point_inputs: points,
            latent: (hidden + points < layer.inputs).then_some(hidden + points),
        };
        packed.point_weights.reserve(rows * points);
        for (row, weights) in layer.weight.chunks_exact(layer.inputs).enumerate() {
            let of_points = &weights[hidden..hidden + points];
            packed.point_weights.extend_from_slice(of_points);
            packed.row_scales[row] = packed.pack_row::<K>(row, &weights[..hidden]);
        }
        // Padding rows multiply by zero.
        packed.point_weights.resize(rows * points, 0.0);
        packed
    }

    /// Packs the weights of one row and returns their scale.
    fn pack_row<K: Kernel>(&mut self, row: usize, weights: &[f32]) -> f32 {
        let channels = <K::Arithmetic as Arithmetic>::CHANNELS;
        let scale = K::Arithmetic::row_scale(weights);
        let mut scaled: Vec<f32> = weights.iter().map(|w| w / scale).collect();
        scaled.resize(self.groups * channels, 0.0);
        // Blocks follow each other, so that a kernel reads weights in sequence.
        let block = row / K::ROWS * K::ROWS * self.groups;
        for (group, scaled) in scaled.chunks_exact(channels).enumerate() {
            let place = block + K::place(row % K::ROWS, group, self.groups);
            self.weights.as_mut_slice::<u32>()[place] = K::Arithmetic::weights(scaled);
        }
        scale
    }
}
