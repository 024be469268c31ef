//! The networks in training: Burn modules with parameters and noise of our own making.

use crate::{
    config::{Products, RegularisationConfig},
    error::TrainError,
    field_op::FieldOperation,
    layers::{
        CodeSizes, dropout_mask, gumbel_noise, one_hot, parameter, picked, runtime_layers, stacked, uniform,
        uniform_layers,
    },
    stream::{Stream, generator},
};
use burn::module::{Module, Param};
use burn::nn::Linear;
use burn::tensor::{Device, Tensor};
use unic_core::{
    config::{LatentCode, ModelConfig, StateConfig},
    network,
};
use unic_kernels::FieldShape;

/// Sizes of both networks.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkShape {
    /// Widths of the encoder from input to logits.
    pub encoder: Vec<usize>,
    /// Channels of the latent vector.
    pub channels: usize,
    /// Categories a channel.
    pub categories: usize,
    /// Code that the field reads for a picked category.
    pub code: LatentCode,
    /// The field.
    pub field: FieldShape,
    /// Zero initialisation of the field's last layer, so that the field of a new model outputs
    /// zero. It is set where the state is a displacement. All layers of the paper's field start at
    /// random.
    pub zero_head: bool,
}

impl NetworkShape {
    /// Computes the sizes of a model for a skeleton with `joints` joints.
    pub fn new(config: &ModelConfig, joints: usize) -> Self {
        Self {
            encoder: config.encoder.widths(2 * config.motion.len(joints)),
            channels: config.encoder.channels,
            categories: config.encoder.categories,
            code: config.encoder.code,
            field: FieldShape {
                point_inputs: config.state.input_len(),
                latent: config.encoder.latent_len(),
                hidden: config.field.width,
                hidden_layers: config.field.hidden_layers,
                skip: config.field.skip,
                outputs: 3,
            },
            zero_head: config.state != StateConfig::RootRelative,
        }
    }
}

/// Encoder and field. The field's parameters are one flat vector (`FieldShape::layout`), so that
/// its fused operation has three parents instead of twenty.
#[derive(Module, Debug)]
pub struct Network {
    encoder: Vec<Linear>,
    field: Param<Tensor<1>>,
}

impl Default for Network {
    /// Network without layers: the placeholder while a network is moved out for an update.
    fn default() -> Self {
        Self {
            encoder: Vec::new(),
            field: parameter(FIELD_ID, vec![0.0], [1], &Device::flex()),
        }
    }
}

/// Named parameter tensor, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// `encoder.0.weight` (`[in, out]`), ..., `field` (flat).
    pub name: String,
    /// Sizes.
    pub shape: Vec<usize>,
    /// Values.
    pub values: Vec<f32>,
}

/// Number of rows that the encoder reads in a step: `frames` × `windows`, frame-major.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WindowRows {
    /// Frames of the rollout.
    pub frames: usize,
    /// Windows of the batch.
    pub windows: usize,
}

/// Random numbers of one step's forward pass, on the host. They depend on seed and step alone.
pub struct StepNoise {
    /// Dropout factors of each encoder layer's input, `[rows, width]`; absent where nothing is
    /// dropped.
    masks: Vec<Option<Vec<f32>>>,
    /// Gumbel noise, `[rows, channels, categories]`.
    gumbel: Vec<f32>,
}

impl StepNoise {
    /// Draws the noise of a step.
    pub fn draw(
        shape: &NetworkShape,
        config: &RegularisationConfig,
        rows: WindowRows,
        seed: u64,
        step: u64,
    ) -> Self {
        let mut rng = generator(seed, Stream::Dropout, step);
        let WindowRows { frames, windows } = rows;
        let drawn = if config.dropout_by_window { 1 } else { frames };
        let layers = shape.encoder.len() - 1;
        let masks = (shape.encoder[..layers].iter().enumerate())
            .map(|(layer, width)| {
                let rate = if layer == 0 {
                    config.input_dropout
                } else {
                    config.dropout
                };
                (rate > 0.0)
                    // Rows are frame-major, so repeating a frame's mask gives it to every frame.
                    .then(|| dropout_mask(&mut rng, rate, drawn * windows * width).repeat(frames / drawn))
            })
            .collect();
        // A stream of its own: dropout settings do not change the Gumbel noise.
        let mut rng = generator(seed, Stream::Gumbel, step);
        let count = frames * windows * shape.channels * shape.categories;
        Self {
            masks,
            gumbel: gumbel_noise(&mut rng, count),
        }
    }
}

impl Network {
    /// Draws weights and biases uniformly in ±1/√inputs, the default of the authors' framework.
    pub fn new(shape: &NetworkShape, seed: u64, device: &Device) -> Self {
        let mut field = vec![0.0; shape.field.parameter_count()];
        for (i, map) in shape.field.layout().iter().enumerate() {
            let id = FIELD_ID + 2 * i as u64;
            let weight = uniform(seed, id, map.weight.len(), map.inputs());
            field[map.weight.clone()].copy_from_slice(&weight);
            let bias = uniform(seed, id + 1, map.bias.len(), map.inputs());
            field[map.bias.clone()].copy_from_slice(&bias);
        }
        if shape.zero_head {
            let head = shape.field.layout().pop();
            head.into_iter()
                // Weight and bias of a layer are adjacent in the flat vector.
                .for_each(|h| field[h.weight.start..h.bias.end].fill(0.0));
        }
        let count = field.len();
        Self {
            encoder: uniform_layers(&shape.encoder, seed, 0, device),
            field: parameter(FIELD_ID, field, [count], device),
        }
    }

    /// Computes the latent vectors z of motion pairs `[rows, 2 D]`: `[rows, C]` of picked logits,
    /// `[rows, C · K]` one-hot.
    ///
    /// One category of each channel is picked by argmax of logit + noise. Gradients flow through
    /// the picked logit (reference: straight pick of the raw logit, temperature 1), or through the
    /// softmax of logit + noise that a one-hot code stands for.
    pub fn latents(&self, shape: &NetworkShape, motion: Tensor<2>, noise: Option<&StepNoise>) -> Tensor<2> {
        let masks = noise.map_or(&[][..], |n| &n.masks);
        let logits = stacked(&self.encoder, motion, masks); // [rows, C · K]
        let sizes = CodeSizes {
            channels: shape.channels,
            categories: shape.categories,
        };
        let noise = noise.map(|n| n.gumbel.as_slice());
        match shape.code {
            LatentCode::PickedLogit => picked(logits, sizes, noise),
            LatentCode::OneHot => one_hot(logits, sizes, noise),
        }
    }

    /// The field of one step.
    ///
    /// # Errors
    /// Sizes that do not fit the shape, products that the device does not have.
    pub fn field(&self, shape: &NetworkShape, products: Products) -> Result<FieldOperation, TrainError> {
        Ok(FieldOperation::new(shape.field, self.field.val(), products)?)
    }

    /// All parameters, in a fixed order.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut all = Vec::new();
        for (i, layer) in self.encoder.iter().enumerate() {
            all.push(host(format!("encoder.{i}.weight"), &layer.weight));
            if let Some(bias) = &layer.bias {
                all.push(host(format!("encoder.{i}.bias"), bias));
            }
        }
        all.push(host("field".into(), &self.field));
        all
    }

    /// Values of all parameters, in the order of [`Network::parameters`].
    pub fn values(&self) -> Vec<Vec<f32>> {
        self.parameters().into_iter().map(|p| p.values).collect()
    }

    /// Creates a network with these values, in the order of [`Network::parameters`].
    ///
    /// # Panics
    /// Panics if a value has another number of elements; callers check names and lengths first.
    pub fn with_parameters(shape: &NetworkShape, values: &[Vec<f32>], device: &Device) -> Self {
        let mut values = values.iter().cloned();
        let mut next = || values.next().unwrap_or_default();
        let encoder = (shape.encoder.windows(2).enumerate())
            .map(|(i, w)| Linear {
                weight: parameter(1 + 2 * i as u64, next(), [w[0], w[1]], device),
                bias: Some(parameter(2 + 2 * i as u64, next(), [w[1]], device)),
            })
            .collect();
        let count = shape.field.parameter_count();
        Self {
            encoder,
            field: parameter(FIELD_ID, next(), [count], device),
        }
    }
}

/// Layers as the model file holds them: weights `[out, in]`.
pub(crate) fn model_layers(
    shape: &NetworkShape,
    values: &[Vec<f32>],
) -> (Vec<network::Linear>, Vec<network::Linear>) {
    let encoder = runtime_layers(&shape.encoder, values);
    let flat = &values[2 * (shape.encoder.len() - 1)];
    let field = (shape.field.layout().iter())
        .map(|map| network::Linear {
            inputs: map.inputs(),
            outputs: map.outputs,
            weight: flat[map.weight.clone()].to_vec(),
            bias: flat[map.bias.clone()].to_vec(),
        })
        .collect();
    (encoder, field)
}

/// Parameter ids are fixed, so that records repeat from run to run; the encoder's start at 1.
const FIELD_ID: u64 = 1000;

pub(crate) fn host<const D: usize>(name: String, parameter: &Param<Tensor<D>>) -> Parameter {
    let values = parameter.val().inner().try_into_vec_as::<f32>();
    Parameter {
        name,
        shape: parameter.dims().to_vec(),
        // Parameters are made as f32 above and never change their type.
        values: values.expect("f32 parameters"),
    }
}

#[cfg(test)]
mod tests;
