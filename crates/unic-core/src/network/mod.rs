//! The networks at inference: the categorical motion encoder and the deformation field on CPU.

#[cfg(target_arch = "x86_64")]
mod amx;
mod arithmetic;
mod code;
mod encoder;
mod field;
mod float;
mod instructions;
mod kernel;
mod lines;
#[cfg(target_arch = "x86_64")]
pub mod matrix_units;
mod packed;
mod precision;
mod rows;
mod tile;
mod vector;
mod words;

pub use code::{CodeSampling, gumbel};
pub use encoder::{Encoder, EncoderScratch};
pub(crate) use encoder::{apply, elu};
pub use field::{Field, FieldBiases};
pub use instructions::Instructions;
pub use precision::Precision;
pub use tile::{FieldScratch, TILE};

use thiserror::Error;

/// One linear map y = W x + b, as training leaves it.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// Numbers in.
    pub inputs: usize,
    /// Numbers out.
    pub outputs: usize,
    /// W, row-major, outputs × inputs.
    pub weight: Vec<f32>,
    /// b, one an output.
    pub bias: Vec<f32>,
}

impl Linear {
    /// Multiplies all that it says.
    pub fn scale(&mut self, factor: f32) {
        let numbers = self.weight.iter_mut().chain(&mut self.bias);
        numbers.for_each(|x| *x *= factor);
    }
}

/// A layer of another size than the configuration says.
#[derive(Debug, Error, PartialEq)]
#[error(
    "network: {layer} must map {expected_inputs} to {expected_outputs} numbers, found {inputs} to {outputs}"
)]
pub struct LayerError {
    /// Name of the layer.
    pub layer: String,
    /// Inputs by the configuration.
    pub expected_inputs: usize,
    /// Outputs by the configuration.
    pub expected_outputs: usize,
    /// Inputs found.
    pub inputs: usize,
    /// Outputs found.
    pub outputs: usize,
}

/// Checks a stack of layers against (inputs, outputs) of each.
pub(crate) fn check_layers(
    name: &str,
    layers: &[Linear],
    expected: &[(usize, usize)],
) -> Result<(), LayerError> {
    for (i, &(expected_inputs, expected_outputs)) in expected.iter().enumerate() {
        let found = layers.get(i);
        let (inputs, outputs) = found.map_or((0, 0), |l| (l.inputs, l.outputs));
        let lengths =
            found.is_some_and(|l| l.weight.len() == l.inputs * l.outputs && l.bias.len() == l.outputs);
        if (inputs, outputs) != (expected_inputs, expected_outputs) || !lengths {
            return Err(LayerError {
                layer: format!("{name}.{i}"),
                expected_inputs,
                expected_outputs,
                inputs,
                outputs,
            });
        }
    }
    Ok(())
}
