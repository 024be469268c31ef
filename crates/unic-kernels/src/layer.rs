//! A linear map with its weights packed for the forward and the backward pass.

use crate::buffer::Buffer;
use crate::panels::{PANEL, Panels};
use crate::shape::LinearMap;

/// A linear map with packed parameters, which [`crate::Field::load`] updates.
pub(crate) struct Layer {
    pub(crate) map: LinearMap,
    /// Panels of the input columns that vary from point to point: hidden inputs, then point inputs.
    pub(crate) input: Panels,
    /// Panels of the outputs.
    pub(crate) output: Panels,
    /// Number of the input's panels that hold hidden inputs.
    pub(crate) hidden_panels: usize,
    /// Index of this map among those that take the latent; `None` for other maps.
    pub(crate) slot: Option<usize>,
    /// Weights for the forward pass: for each output panel, for each input column, 32 outputs.
    pub(crate) forward: Buffer,
    /// Weights for the backward pass: for each input panel, for each output, 32 inputs.
    pub(crate) backward: Buffer,
    /// Biases: one value per output, in panels.
    pub(crate) bias: Buffer,
    /// Weights of the latent, transposed: for each latent value, one value per output, in panels.
    pub(crate) latent: Buffer,
}

impl Layer {
    pub(crate) fn new(map: LinearMap, slot: Option<usize>) -> Self {
        let input = Panels::of(&[map.hidden_inputs, map.point_inputs]);
        let output = Panels::of(&[map.outputs]);
        let width = output.count() * PANEL;
        Self {
            hidden_panels: map.hidden_inputs.div_ceil(PANEL),
            forward: Buffer::zeros(width * map.varying_inputs()),
            backward: Buffer::zeros(input.count() * PANEL * map.outputs),
            bias: Buffer::zeros(width),
            latent: Buffer::zeros(width * map.latent_inputs),
            map,
            input,
            output,
            slot,
        }
    }

    /// Returns the number of outputs, rounded up to whole panels.
    pub(crate) fn padded_outputs(&self) -> usize {
        self.output.count() * PANEL
    }

    /// Packs this map's part of the flat parameter vector.
    pub(crate) fn load(&mut self, parameters: &[f32]) {
        let weight = &parameters[self.map.weight.clone()];
        let outputs = self.map.outputs;
        self.bias[..outputs].copy_from_slice(&parameters[self.map.bias.clone()]);
        self.pack_forward(weight);
        self.pack_backward(weight);
        let (inputs, varying, width) = (
            self.map.inputs(),
            self.map.varying_inputs(),
            self.padded_outputs(),
        );
        // Columns become rows, so that folding adds scaled rows instead of strided columns.
        for (index, column) in self
            .latent
            .chunks_exact_mut(width)
            .take(self.map.latent_inputs)
            .enumerate()
        {
            for (output, value) in column[..outputs].iter_mut().enumerate() {
                *value = weight[output * inputs + varying + index];
            }
        }
    }

    /// Packs the weights for the forward pass, which broadcasts inputs and loads 32 outputs at a
    /// time.
    fn pack_forward(&mut self, weight: &[f32]) {
        let (inputs, depth) = (self.map.inputs(), self.map.varying_inputs());
        for ((start, width), packed) in self
            .output
            .starts()
            .zip(self.forward.chunks_exact_mut(depth * PANEL))
        {
            let rows = &weight[start * inputs..(start + width) * inputs];
            for (lane, row) in rows.chunks_exact(inputs).enumerate() {
                for (column, value) in row[..depth].iter().enumerate() {
                    packed[column * PANEL + lane] = *value;
                }
            }
        }
    }

    /// Packs the weights for the backward pass, which broadcasts output gradients and loads 32
    /// inputs at a time.
    fn pack_backward(&mut self, weight: &[f32]) {
        let inputs = self.map.inputs();
        let panel_length = self.map.outputs * PANEL;
        for ((start, width), packed) in self
            .input
            .starts()
            .zip(self.backward.chunks_exact_mut(panel_length))
        {
            for (row, packed) in weight.chunks_exact(inputs).zip(packed.chunks_exact_mut(PANEL)) {
                packed[..width].copy_from_slice(&row[start..start + width]);
            }
        }
    }

    /// Computes the bias with the latent folded in, `bias + W_z · z`: one value per output, in
    /// panels.
    pub(crate) fn fold_latent(&self, latent: &[f32], bias: &mut [f32]) {
        let width = self.padded_outputs();
        bias.copy_from_slice(&self.bias[..width]);
        for (factor, column) in latent.iter().zip(self.latent.chunks_exact(width)) {
            add_scaled(bias, *factor, column);
        }
    }
}

/// Computes `sum += factor · values`.
pub(crate) fn add_scaled(sum: &mut [f32], factor: f32, values: &[f32]) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += factor * value;
    }
}
