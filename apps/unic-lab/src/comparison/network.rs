//! The networks in training, and as the runtime has them.

use super::{
    config::{ComparisonConfig, GlobalFeatureSettings},
    samples::Batch,
};
use burn::module::Module;
use burn::nn::Linear;
use burn::tensor::{Device, Tensor, TensorData};
use unic_core::{
    config::{EncoderConfig, LatentCode},
    network::{Encoder, EncoderScratch},
};
use unic_train::{
    Stream, TrainError, generator,
    layers::{CodeSizes, dropout_mask, gumbel_noise, picked, runtime_layers, stacked, uniform_layers},
};

/// Sizes. Without a feature of the garment the decoder reads the motion itself.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    inputs: usize,
    outputs: usize,
    hidden: Vec<usize>,
    global_feature: Option<GlobalFeatureSettings>,
}

/// Number of the first parameter, far from those of [`unic_train::Network`] and of the recurrence.
const FIRST_PARAMETER: u64 = 3000;

/// A perceptron and the numbers that it reads.
type Part = (EncoderConfig, usize);

impl Shape {
    pub(super) fn new(config: &ComparisonConfig, inputs: usize, outputs: usize) -> Self {
        Self {
            inputs,
            outputs,
            hidden: config.hidden.clone(),
            global_feature: config.global_feature.clone(),
        }
    }

    pub(super) fn reads_garment(&self) -> bool {
        self.global_feature.is_some()
    }

    /// Of the motion's encoder, the garment's encoder and the decoder, each with its inputs.
    fn parts(&self) -> (Option<[Part; 2]>, Part) {
        let plain = |hidden: Vec<usize>, outputs: usize| EncoderConfig {
            hidden,
            channels: outputs,
            // One category: there is nothing to pick.
            categories: 1,
            code: LatentCode::PickedLogit,
        };
        let encoders = self.global_feature.as_ref().map(|g| {
            [
                (g.encoder.clone(), self.inputs),
                (plain(vec![g.hidden], g.width), self.outputs),
            ]
        });
        let inputs = encoders
            .as_ref()
            .map_or(self.inputs, |e| e.iter().map(|(e, _)| e.channels).sum());
        (encoders, (plain(self.hidden.clone(), self.outputs), inputs))
    }

    /// Widths of the three, an absent one has none.
    fn widths(&self) -> [Vec<usize>; 3] {
        let (encoders, (decoder, inputs)) = self.parts();
        let [motion, garment] = encoders.map_or([Vec::new(), Vec::new()], |e| {
            e.map(|(config, inputs)| config.widths(inputs))
        });
        [motion, garment, decoder.widths(inputs)]
    }

    /// Widths of the map that reads the motion: dropout is for it.
    fn reader(&self) -> Vec<usize> {
        let [motion, _, decoder] = self.widths();
        if self.reads_garment() { motion } else { decoder }
    }

    /// Sizes of the categorical code. Zero without a feature of the garment.
    fn code_sizes(&self) -> CodeSizes {
        let encoder = self.global_feature.as_ref().map(|g| &g.encoder);
        CodeSizes {
            channels: encoder.map_or(0, |e| e.channels),
            categories: encoder.map_or(0, |e| e.categories),
        }
    }
}

/// The random part of one step, on the host.
pub(super) struct Noise {
    /// Dropout factors of each layer's input of the map that reads the motion.
    masks: Vec<Option<Vec<f32>>>,
    /// Rows × channels × categories.
    gumbel: Vec<f32>,
}

impl Noise {
    pub(super) fn draw(shape: &Shape, config: &ComparisonConfig, step: u64) -> Self {
        let mut rng = generator(config.seed, Stream::Dropout, step);
        let widths = shape.reader();
        let inputs = widths[..widths.len() - 1].iter().enumerate();
        let masks = inputs.map(|(layer, width)| {
            let rate = if layer == 0 {
                config.input_dropout
            } else {
                config.dropout
            };
            (rate > 0.0).then(|| dropout_mask(&mut rng, rate, config.frames * width))
        });
        let masks = masks.collect();
        let mut rng = generator(config.seed, Stream::Gumbel, step);
        let CodeSizes { channels, categories } = shape.code_sizes();
        Self {
            masks,
            gumbel: gumbel_noise(&mut rng, config.frames * channels * categories),
        }
    }
}

/// Stacks of linear maps with ELU between them.
#[derive(Module, Debug)]
pub(super) struct ComparisonNetwork {
    motion: Vec<Linear>,
    garment: Vec<Linear>,
    decoder: Vec<Linear>,
}

impl Default for ComparisonNetwork {
    /// No layer at all: what stands in while a network is moved out to be updated.
    fn default() -> Self {
        Self {
            motion: Vec::new(),
            garment: Vec::new(),
            decoder: Vec::new(),
        }
    }
}

impl ComparisonNetwork {
    pub(super) fn new(shape: &Shape, seed: u64, device: &Device) -> Self {
        let mut next = FIRST_PARAMETER;
        let [motion, garment, decoder] = shape.widths().map(|widths| {
            let layers = uniform_layers(&widths, seed, next, device);
            next += 2 * layers.len() as u64;
            layers
        });
        Self {
            motion,
            garment,
            decoder,
        }
    }

    /// Mean over frames of the squared error, summed over the coefficients.
    pub(super) fn loss(&self, shape: &Shape, batch: &Batch, device: &Device) -> Tensor<1> {
        let targets = tensor(&batch.targets, batch.rows, device);
        let error = self.outputs(shape, batch, Some(&batch.noise), device) - targets;
        error.powi_scalar(2).mean() * shape.outputs as f64
    }

    /// Rows × K.
    fn outputs(&self, shape: &Shape, batch: &Batch, noise: Option<&Noise>, device: &Device) -> Tensor<2> {
        let masks = noise.map_or(&[][..], |n| &n.masks);
        let motion = tensor(&batch.motion, batch.rows, device);
        if !shape.reads_garment() {
            return stacked(&self.decoder, motion, masks);
        }
        let logits = stacked(&self.motion, motion, masks);
        let code = picked(logits, shape.code_sizes(), noise.map(|n| n.gumbel.as_slice()));
        let garment = tensor(&batch.garment, batch.rows, device);
        let feature = stacked(&self.garment, garment, &[]);
        stacked(&self.decoder, Tensor::cat(vec![code, feature], 1), &[])
    }
}

fn tensor(values: &[f32], rows: usize, device: &Device) -> Tensor<2> {
    let shape = [rows, values.len() / rows.max(1)];
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device)
}

/// A network at inference: on the host, one frame at a time, without noise.
#[derive(Clone, Debug)]
pub(super) struct Runtime {
    /// Of the motion and of the garment before.
    encoders: Option<[Encoder; 2]>,
    decoder: Encoder,
}

/// Buffers of one evaluation.
#[derive(Clone, Debug, Default)]
pub(super) struct RuntimeScratch {
    encoder: EncoderScratch,
    code: Vec<f32>,
}

impl Runtime {
    /// Of [`ComparisonNetwork::values`].
    pub(super) fn new(shape: &Shape, values: &[Vec<f32>]) -> Result<Self, TrainError> {
        let mut rest = values;
        let mut next = |(config, inputs): (EncoderConfig, usize)| {
            let widths = config.widths(inputs);
            let (own, after) = rest.split_at(rest.len().min(2 * (widths.len() - 1)));
            rest = after;
            Encoder::new(&config, inputs, runtime_layers(&widths, own))
        };
        let (encoders, decoder) = shape.parts();
        let encoders = match encoders {
            Some([motion, garment]) => Some([next(motion)?, next(garment)?]),
            None => None,
        };
        Ok(Self {
            encoders,
            decoder: next(decoder)?,
        })
    }

    pub(super) fn reads_garment(&self) -> bool {
        self.encoders.is_some()
    }

    /// K numbers for what is read of the motion and the coefficients before, in the network's
    /// units.
    pub(super) fn outputs(
        &self,
        motion: &[f32],
        garment: &[f32],
        scratch: &mut RuntimeScratch,
        out: &mut [f32],
    ) {
        let RuntimeScratch { encoder, code } = scratch;
        let Some(encoders) = &self.encoders else {
            return self.decoder.encode(motion, &[], encoder, out);
        };
        let widths = encoders.each_ref().map(Encoder::latent_len);
        code.resize(widths.iter().sum(), 0.0);
        let (of_motion, of_garment) = code.split_at_mut(widths[0]);
        encoders[0].encode(motion, &[], encoder, of_motion);
        encoders[1].encode(garment, &[], encoder, of_garment);
        self.decoder.encode(code, &[], encoder, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::ComparisonKind;
    use unic_train::{Averaging, Learner};

    #[test]
    fn training_and_runtime_say_the_same() {
        for kind in [ComparisonKind::VirtualBones, ComparisonKind::GlobalFeature] {
            let config = ComparisonConfig::of(kind);
            let shape = Shape::new(&config, 11, 7);
            let device = Device::flex().autodiff();
            let network = ComparisonNetwork::new(&shape, 3, &device);
            let wave = |count: usize| -> Vec<f32> { (0..count).map(|i| (i as f32 * 1.3).sin()).collect() };
            let rows = 5;
            let batch = Batch {
                rows,
                motion: wave(rows * 11),
                garment: wave(rows * 7),
                targets: Vec::new(),
                noise: Noise::draw(&shape, &config, 0),
            };
            let trained = network.outputs(&shape, &batch, None, &device).into_data();
            let trained = trained.try_to_vec::<f32>().unwrap();
            let runtime = Runtime::new(&shape, &Learner::new(network, Averaging::Off).kept()).unwrap();
            let (mut scratch, mut out) = (RuntimeScratch::default(), [0.0; 7]);
            for (row, expected) in trained.chunks_exact(7).enumerate() {
                let (motion, garment) = (&batch.motion[row * 11..][..11], &batch.garment[row * 7..][..7]);
                runtime.outputs(motion, garment, &mut scratch, &mut out);
                for (a, b) in out.iter().zip(expected) {
                    assert!((a - b).abs() < 1e-5, "{kind:?}: {a} {b}");
                }
            }
        }
    }
}
