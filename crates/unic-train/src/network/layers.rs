//! Stacks of linear maps, and the pick of one category a channel: what all networks share.

use super::{parameter, transposed};
use crate::elu_op::elu;
use crate::stream::{Stream, generator};
use burn::nn::Linear;
use burn::tensor::{Device, IndexingUpdateOp, Int, Tensor, TensorData, activation::softmax};
use rand::{Rng, RngExt};
use unic_core::network;

/// Maps of these widths, from input to output; `first` is the number of the first one among all
/// parameters of a network: identifiers and random numbers hang on it.
pub(crate) fn uniform_layers(widths: &[usize], seed: u64, first: u64, device: &Device) -> Vec<Linear> {
    let layer = |(i, w): (usize, &[usize])| {
        let id = first + 2 * i as u64;
        let weight = uniform([seed, id], w[0] * w[1], w[0]);
        let bias = uniform([seed, id + 1], w[1], w[0]);
        Linear {
            weight: parameter(1 + id, weight, [w[0], w[1]], device),
            bias: Some(parameter(2 + id, bias, [w[1]], device)),
        }
    };
    widths.windows(2).enumerate().map(layer).collect()
}

/// Uniform in ±1/√inputs, the authors' framework's default for weights and biases; drawn from the seed
/// and the number of the parameter.
pub(crate) fn uniform([seed, number]: [u64; 2], count: usize, inputs: usize) -> Vec<f32> {
    let mut rng = generator(seed, Stream::Parameters, number);
    let bound = 1.0 / (inputs as f32).sqrt();
    let draw = |_| (2.0 * rng.random::<f32>() - 1.0) * bound;
    (0..count).map(draw).collect()
}

/// Dropout factors: zero, or what keeps the mean.
pub(crate) fn dropout_mask(rng: &mut impl Rng, rate: f32, count: usize) -> Vec<f32> {
    let keep = 1.0 / (1.0 - rate);
    let factor = |_| if rng.random::<f32>() < rate { 0.0 } else { keep };
    (0..count).map(factor).collect()
}

/// Independent Gumbel numbers.
pub(crate) fn gumbel_noise(rng: &mut impl Rng, count: usize) -> Vec<f32> {
    (0..count).map(|_| network::gumbel(rng.random())).collect()
}

/// Linear maps with ELU between them, their inputs `[rows, width]` times dropout factors where
/// `masks` has some.
pub(crate) fn stacked(layers: &[Linear], inputs: Tensor<2>, masks: &[Option<Vec<f32>>]) -> Tensor<2> {
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

/// One logit of each channel, picked by argmax of logit + noise; gradients flow through the picked
/// logit (reference: straight pick of the raw logit, temperature 1).
pub(crate) fn picked(
    logits: Tensor<2>,
    [channels, categories]: [usize; 2],
    noise: Option<&[f32]>,
) -> Tensor<2> {
    let sizes = [logits.dims()[0], channels, categories];
    let logits: Tensor<3> = logits.reshape(sizes); // [rows, C, K]
    let scores = with_noise(logits.clone().inner(), noise);
    let picked: Tensor<3, Int> = scores.argmax(2); // [rows, C, 1]
    logits.gather(2, picked).squeeze_dim::<2>(2)
}

/// One at the category of each channel that argmax of logit + noise picks, zero at the others, `[rows, C · K]`.
/// Gradients are those of the softmax of logit + noise, temperature 1: the straight-through estimator of Jang et
/// al. 2017, "Categorical Reparameterization with Gumbel-Softmax".
pub(crate) fn one_hot(
    logits: Tensor<2>,
    [channels, categories]: [usize; 2],
    noise: Option<&[f32]>,
) -> Tensor<2> {
    let rows = logits.dims()[0];
    let scores = with_noise(logits.reshape([rows, channels, categories]), noise); // [rows, C, K]
    let soft = softmax(scores.clone(), 2);
    let scores = scores.inner();
    let picked: Tensor<3, Int> = scores.clone().argmax(2); // [rows, C, 1]
    let ones = Tensor::ones([rows, channels, 1], &scores.device());
    let hard = scores
        .zeros_like()
        .scatter(2, picked, ones, IndexingUpdateOp::Add);
    // Soft minus soft is zero exactly, so the values are the hard ones and the gradient is the soft one's.
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

/// Maps as the runtime has them, weights `[out, in]`; `values` begin with weight and bias of each.
pub(crate) fn runtime_layers(widths: &[usize], values: &[Vec<f32>]) -> Vec<network::Linear> {
    let layer = |(w, pair): (&[usize], &[Vec<f32>])| network::Linear {
        inputs: w[0],
        outputs: w[1],
        weight: transposed(&pair[0], w[1]),
        bias: pair[1].clone(),
    };
    widths.windows(2).zip(values.chunks(2)).map(layer).collect()
}
