//! The networks at inference on the CPU: the motion encoder and the deformation field.
//!
//! For training and tools: an engine reaches the networks through [`Animator`](crate::Animator).
//! Training compares its own forward pass with these.

#[cfg(target_arch = "x86_64")]
mod amx;
mod arithmetic;
mod code;
mod dot;
mod encoder;
mod field;
mod kernel;
mod packed;
mod precision;
mod rows;
mod tile;
mod words;

pub use code::{CodeSampling, gumbel};
pub use encoder::{Encoder, EncoderScratch};
pub(crate) use encoder::{apply, elu};
pub use field::{Field, FieldBiases};
pub use precision::Precision;
pub use tile::{FieldScratch, TILE};

use thiserror::Error;

/// Linear map y = W x + b in f32.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// Length of x.
    pub inputs: usize,
    /// Length of y.
    pub outputs: usize,
    /// W, row-major, outputs × inputs.
    pub weight: Vec<f32>,
    /// b, one number an output.
    pub bias: Vec<f32>,
}

impl Linear {
    /// Multiplies weights and biases, and with them every output, by `factor`.
    pub fn scale(&mut self, factor: f32) {
        let numbers = self.weight.iter_mut().chain(&mut self.bias);
        numbers.for_each(|x| *x *= factor);
    }

    /// Multiplies weights and biases of each output by a factor of its own.
    pub fn scale_outputs(&mut self, factors: &[f32]) {
        debug_assert_eq!(factors.len(), self.outputs);
        let rows = self.weight.chunks_exact_mut(self.inputs.max(1));
        for (row, factor) in rows.zip(factors) {
            row.iter_mut().for_each(|x| *x *= factor);
        }
        let biases = self.bias.iter_mut().zip(factors);
        biases.for_each(|(bias, factor)| *bias *= factor);
    }

    /// Weights of one output.
    pub fn row(&self, output: usize) -> &[f32] {
        &self.weight[output * self.inputs..][..self.inputs]
    }

    /// Keeps the first outputs, so many at most.
    pub fn truncate_outputs(&mut self, outputs: usize) {
        self.outputs = self.outputs.min(outputs);
        self.weight.truncate(self.outputs * self.inputs);
        self.bias.truncate(self.outputs);
    }

    /// Appends outputs that are zero, up to `outputs` in all.
    pub fn append_zero_outputs(&mut self, outputs: usize) {
        self.outputs = self.outputs.max(outputs);
        self.weight.resize(self.outputs * self.inputs, 0.0);
        self.bias.resize(self.outputs, 0.0);
    }
}

/// Error: a layer whose size differs from the configuration's.
#[derive(Debug, Error, PartialEq)]
#[error(
    "network: {layer} must map {expected_inputs} to {expected_outputs} numbers, found {inputs} to {outputs}"
)]
pub struct LayerError {
    /// Name of the layer.
    pub layer: String,
    /// Inputs in the configuration.
    pub expected_inputs: usize,
    /// Outputs in the configuration.
    pub expected_outputs: usize,
    /// Inputs of the layer; 0 when it is missing.
    pub inputs: usize,
    /// Outputs of the layer; 0 when it is missing.
    pub outputs: usize,
}

/// Size of a [`Linear`] map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LayerSize {
    /// Length of its input.
    pub(crate) inputs: usize,
    /// Length of its output.
    pub(crate) outputs: usize,
}

/// Checks the layers of the network `name` against the sizes that its configuration asks for.
pub(crate) fn check_layers(name: &str, layers: &[Linear], expected: &[LayerSize]) -> Result<(), LayerError> {
    for (i, &expected) in expected.iter().enumerate() {
        let found = layers.get(i);
        let (inputs, outputs) = found.map_or((0, 0), |l| (l.inputs, l.outputs));
        let lengths =
            found.is_some_and(|l| l.weight.len() == l.inputs * l.outputs && l.bias.len() == l.outputs);
        if (LayerSize { inputs, outputs }) != expected || !lengths {
            return Err(LayerError {
                layer: format!("{name}.{i}"),
                expected_inputs: expected.inputs,
                expected_outputs: expected.outputs,
                inputs,
                outputs,
            });
        }
    }
    Ok(())
}
