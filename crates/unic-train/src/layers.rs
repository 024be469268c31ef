//! Building blocks of trained networks, for networks of one's own: stacks of linear maps with ELU,
//! dropout, and the choice of one category per channel.

use crate::{
    elu_op::elu,
    stream::{Stream, generator},
};
use burn::module::{Param, ParamId};
use burn::nn::Linear;
use burn::tensor::{Device, IndexingUpdateOp, Int, Tensor, TensorData, activation::softmax};
use rand::{Rng, RngExt};
use unic_core::network;

/// Sizes of a categorical code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CodeSizes {
    /// Channels C.
    pub channels: usize,
    /// Categories K of a channel.
    pub categories: usize,
}

/// Linear maps of these widths, from input to output. `first` is the number of the first map among
/// all parameters of a network; identifiers and random numbers are derived from it.
pub fn uniform_layers(widths: &[usize], seed: u64, first: u64, device: &Device) -> Vec<Linear> {
    let layer = |(i, w): (usize, &[usize])| {
        let id = first + 2 * i as u64;
        let weight = uniform(seed, id, w[0] * w[1], w[0]);
        let bias = uniform(seed, id + 1, w[1], w[0]);
        Linear {
            weight: parameter(1 + id, weight, [w[0], w[1]], device),
            bias: Some(parameter(2 + id, bias, [w[1]], device)),
        }
    };
    widths.windows(2).enumerate().map(layer).collect()
}

/// First values of a parameter, uniform in ±1/√inputs: the default of the paper's framework for
/// weights and biases. They are drawn from the seed and the number of the parameter.
pub fn uniform(seed: u64, number: u64, count: usize, inputs: usize) -> Vec<f32> {
    let mut rng = generator(seed, Stream::Parameters, number);
    let bound = 1.0 / (inputs as f32).sqrt();
    let draw = |_| (2.0 * rng.random::<f32>() - 1.0) * bound;
    (0..count).map(draw).collect()
}

/// Dropout factors: zero with probability `rate`, else 1 / (1 − rate), which keeps the mean.
pub fn dropout_mask(rng: &mut impl Rng, rate: f32, count: usize) -> Vec<f32> {
    let keep = 1.0 / (1.0 - rate);
    let factor = |_| if rng.random::<f32>() < rate { 0.0 } else { keep };
    (0..count).map(factor).collect()
}

/// Independent numbers of the standard Gumbel distribution.
pub fn gumbel_noise(rng: &mut impl Rng, count: usize) -> Vec<f32> {
    (0..count).map(|_| network::gumbel(rng.random())).collect()
}

/// Applies linear maps with ELU between them. Inputs `[rows, width]` of a map are multiplied by its
/// dropout factors where `masks` has some.
pub fn stacked(layers: &[Linear], inputs: Tensor<2>, masks: &[Option<Vec<f32>>]) -> Tensor<2> {
    let device = inputs.device();
    let mut hidden = inputs;
    for (i, layer) in layers.iter().enumerate() {
        if let Some(Some(mask)) = masks.get(i) {
            let data = TensorData::new(mask.clone(), hidden.dims());
            hidden = hidden * Tensor::from_data(data, &device);
        }
        hidden = layer.forward(hidden);
        if i + 1 < layers.len() {
            hidden = elu(hidden);
        }
    }
    hidden
}

/// Picks one logit of each channel by argmax of logit + noise, `[rows, C]`. Gradients flow through
/// the picked logit (paper's release: the raw logit, temperature 1).
pub fn picked(logits: Tensor<2>, sizes: CodeSizes, noise: Option<&[f32]>) -> Tensor<2> {
    let CodeSizes { channels, categories } = sizes;
    let sizes = [logits.dims()[0], channels, categories];
    let logits: Tensor<3> = logits.reshape(sizes); // [rows, C, K]
    // Argmax has no gradient, so it is computed outside the graph.
    let scores = with_noise(logits.clone().inner(), noise);
    let picked: Tensor<3, Int> = scores.argmax(2); // [rows, C, 1]
    logits.gather(2, picked).squeeze_dim::<2>(2)
}

/// One at the category of each channel that argmax of logit + noise picks, zero at the others,
/// `[rows, C · K]`. Gradients are those of the softmax of logit + noise, temperature 1: the
/// straight-through estimator of Jang et al. 2017, "Categorical Reparameterization with
/// Gumbel-Softmax".
pub fn one_hot(logits: Tensor<2>, sizes: CodeSizes, noise: Option<&[f32]>) -> Tensor<2> {
    let CodeSizes { channels, categories } = sizes;
    let rows = logits.dims()[0];
    let scores = with_noise(logits.reshape([rows, channels, categories]), noise); // [rows, C, K]
    let soft = softmax(scores.clone(), 2);
    let scores = scores.inner();
    let picked: Tensor<3, Int> = scores.clone().argmax(2); // [rows, C, 1]
    let ones = Tensor::ones([rows, channels, 1], &scores.device());
    let hard = scores
        .zeros_like()
        .scatter(2, picked, ones, IndexingUpdateOp::Add);
    // Soft minus soft is zero exactly, so the values are the hard ones and the gradient is the soft
    // one's.
    let code = match soft.device().is_autodiff() {
        true => Tensor::from_inner(hard) + (soft.clone() - soft.detach()),
        false => hard,
    };
    code.reshape([rows, channels * categories])
}

fn with_noise(logits: Tensor<3>, noise: Option<&[f32]>) -> Tensor<3> {
    let Some(noise) = noise else { return logits };
    let (sizes, device) = (logits.dims(), logits.device());
    logits + Tensor::from_data(TensorData::new(noise.to_vec(), sizes), &device)
}

/// Converts maps to the runtime's form, weights `[out, in]`. `values` begin with weight and bias of
/// each map.
pub fn runtime_layers(widths: &[usize], values: &[Vec<f32>]) -> Vec<network::Linear> {
    let layer = |(w, pair): (&[usize], &[Vec<f32>])| network::Linear {
        inputs: w[0],
        outputs: w[1],
        weight: transposed(&pair[0], w[1]),
        bias: pair[1].clone(),
    };
    widths.windows(2).zip(values.chunks(2)).map(layer).collect()
}

/// Makes a parameter on a device, with gradients where the device has them. Its identifier `id` is
/// fixed, so that records repeat from run to run.
pub fn parameter<const D: usize>(
    id: u64,
    values: Vec<f32>,
    shape: [usize; D],
    device: &Device,
) -> Param<Tensor<D>> {
    let tensor = Tensor::<D>::from_data(TensorData::new(values, shape), device);
    let tensor = if device.is_autodiff() {
        tensor.require_grad()
    } else {
        tensor
    };
    Param::initialized(ParamId::from(id), tensor)
}

/// Rows of `columns` numbers to columns.
pub(crate) fn transposed(values: &[f32], columns: usize) -> Vec<f32> {
    let rows = values.len() / columns.max(1);
    (0..columns)
        .flat_map(|c| (0..rows).map(move |r| values[r * columns + c]))
        .collect()
}
