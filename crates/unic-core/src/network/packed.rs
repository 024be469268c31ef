//! A layer of the field as its kernel reads it.

use super::{Linear, arithmetic::Arithmetic, kernel::Kernel, lines::Lines};

/// Weights in blocks of the kernel's rows.
#[derive(Clone, Debug)]
pub(super) struct Packed {
    /// Outputs, padded to whole blocks.
    pub(super) rows: usize,
    /// Words of activations that a row reads; none in the first layer.
    pub(super) groups: usize,
    /// Words, block after block.
    pub(super) weights: Lines,
    /// What a unit of each row's weights is worth.
    pub(super) units: Vec<f32>,
    /// Weights of the point's inputs, row after row, where the layer reads them.
    pub(super) points: Vec<f32>,
    /// How many a row.
    pub(super) point_inputs: usize,
    /// Columns of `Linear::weight` that multiply the latent vector start here, if any.
    pub(super) latent: Option<usize>,
}

/// How many columns of a layer multiply what.
#[derive(Clone, Copy)]
pub(super) struct Columns {
    /// Activations of the layer before.
    pub(super) hidden: usize,
    /// Inputs of the vertex.
    pub(super) points: usize,
}

impl Packed {
    pub(super) fn new<K: Kernel>(layer: &Linear, columns: Columns) -> Self {
        let Columns { hidden, points } = columns;
        let padded = |count: usize| count.next_multiple_of(K::ROWS.max(K::PADDED));
        let channels = <K::Arithmetic as Arithmetic>::CHANNELS;
        let (rows, groups) = (padded(layer.outputs), padded(hidden) / channels);
        let mut packed = Self {
            rows,
            groups,
            weights: Lines::zeroed(rows * groups),
            units: vec![1.0; rows],
            points: Vec::new(),
            point_inputs: points,
            latent: (hidden + points < layer.inputs).then_some(hidden + points),
        };
        packed.points.reserve(rows * points);
        for (row, weights) in layer.weight.chunks_exact(layer.inputs).enumerate() {
            packed.points.extend_from_slice(&weights[hidden..hidden + points]);
            packed.units[row] = packed.pack_row::<K>(row, &weights[..hidden]);
        }
        packed.points.resize(rows * points, 0.0);
        packed
    }

    /// The unit of the row's weights.
    fn pack_row<K: Kernel>(&mut self, row: usize, weights: &[f32]) -> f32 {
        let channels = <K::Arithmetic as Arithmetic>::CHANNELS;
        let unit = K::Arithmetic::unit(weights);
        let mut scaled: Vec<f32> = weights.iter().map(|w| w / unit).collect();
        scaled.resize(self.groups * channels, 0.0);
        let block = row / K::ROWS * K::ROWS * self.groups;
        for (group, scaled) in scaled.chunks_exact(channels).enumerate() {
            let place = block + K::place(row % K::ROWS, group, self.groups);
            self.weights.of_mut::<u32>()[place] = K::Arithmetic::weights(scaled);
        }
        unit
    }
}
