//! Networks in training, and the same networks at inference.

use super::config::{ComparisonConfig, GlobalFeatureSettings};
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

/// Sizes of a network. Without a feature of the garment the decoder reads the motion itself.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    inputs: usize,
    outputs: usize,
    hidden: Vec<usize>,
    global_feature: Option<GlobalFeatureSettings>,
}

/// Number of the first parameter. Random initial values are keyed by it, so that it is far from
/// those of [`unic_train::Network`] and of the recurrence.
const FIRST_PARAMETER: u64 = 3000;

/// Multilayer perceptron with its number of inputs.
struct Part {
    config: EncoderConfig,
    inputs: usize,
}

impl Shape {
    /// Reads the sizes from the settings.
    pub(super) fn new(config: &ComparisonConfig, inputs: usize, outputs: usize) -> Self {
        Self {
            inputs,
            outputs,
            hidden: config.hidden.clone(),
            global_feature: config.global_feature.clone(),
        }
    }

    /// Returns whether the previous garment is an input.
    pub(super) fn reads_garment(&self) -> bool {
        self.global_feature.is_some()
    }

    /// Returns the encoders of motion and garment, where there is a feature of the garment, and the
    /// decoder.
    fn parts(&self) -> (Option<[Part; 2]>, Part) {
        let plain = |hidden: Vec<usize>, outputs: usize| EncoderConfig {
            hidden,
            channels: outputs,
            // One category leaves nothing to pick: the encoder is a plain perceptron.
            categories: 1,
            code: LatentCode::PickedLogit,
        };
        let encoders = self.global_feature.as_ref().map(|g| {
            [
                Part {
                    config: g.encoder.clone(),
                    inputs: self.inputs,
                },
                Part {
                    config: plain(vec![g.hidden], g.width),
                    inputs: self.outputs,
                },
            ]
        });
        let inputs = encoders
            .as_ref()
            .map_or(self.inputs, |e| e.iter().map(|part| part.config.channels).sum());
        let decoder = Part {
            config: plain(self.hidden.clone(), self.outputs),
            inputs,
        };
        (encoders, decoder)
    }

    /// Returns the layer widths of motion encoder, garment encoder and decoder. Those of an absent
    /// one are empty.
    fn widths(&self) -> [Vec<usize>; 3] {
        let (encoders, decoder) = self.parts();
        let widths = |part: Part| part.config.widths(part.inputs);
        let [motion, garment] = encoders.map_or([Vec::new(), Vec::new()], |e| e.map(widths));
        [motion, garment, widths(decoder)]
    }

    /// Returns the layer widths of the map that reads the motion, which has dropout.
    fn reader(&self) -> Vec<usize> {
        let [motion, _, decoder] = self.widths();
        if self.reads_garment() { motion } else { decoder }
    }

    /// Returns the sizes of the categorical code. They are zero without a feature of the garment.
    fn code_sizes(&self) -> CodeSizes {
        let encoder = self.global_feature.as_ref().map(|g| &g.encoder);
        CodeSizes {
            channels: encoder.map_or(0, |e| e.channels),
            categories: encoder.map_or(0, |e| e.categories),
        }
    }
}

/// Random numbers of one step, on the host.
pub(super) struct Noise {
    /// Dropout factors of the inputs of each layer of the map that reads the motion.
    masks: Vec<Option<Vec<f32>>>,
    /// Gumbel noise, rows × channels × categories.
    gumbel: Vec<f32>,
}

impl Noise {
    /// Draws the random numbers of a step from its own generators.
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

/// Samples of one step.
pub(super) struct Batch {
    pub(super) rows: usize,
    /// Inputs from the motion, rows × features.
    pub(super) motion: Vec<f32>,
    /// Previous coefficients, rows × K. Empty for networks that do not read them.
    pub(super) garment: Vec<f32>,
    /// Expected outputs, rows × K.
    pub(super) targets: Vec<f32>,
    pub(super) noise: Noise,
}

/// Network in training: perceptrons with ELU between their linear layers.
#[derive(Module, Debug)]
pub(super) struct ComparisonNetwork {
    motion: Vec<Linear>,
    garment: Vec<Linear>,
    decoder: Vec<Linear>,
}

impl Default for ComparisonNetwork {
    /// Network without layers: the placeholder while a network is moved out for an update.
    fn default() -> Self {
        Self {
            motion: Vec::new(),
            garment: Vec::new(),
            decoder: Vec::new(),
        }
    }
}

impl ComparisonNetwork {
    /// Initialises a network at random.
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

    /// Returns the squared error summed over coefficients, mean over frames.
    pub(super) fn loss(&self, shape: &Shape, batch: &Batch, device: &Device) -> Tensor<1> {
        let targets = tensor(&batch.targets, batch.rows, device);
        let error = self.outputs(shape, batch, Some(&batch.noise), device) - targets;
        error.powi_scalar(2).mean() * shape.outputs as f64
    }

    /// Returns the outputs, rows × K.
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

/// Moves rows of numbers to the device.
fn tensor(values: &[f32], rows: usize, device: &Device) -> Tensor<2> {
    let shape = [rows, values.len() / rows.max(1)];
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device)
}

/// Network at inference: on the host, one frame at a time, without noise.
#[derive(Clone, Debug)]
pub(super) struct Runtime {
    /// Encoders of the motion and of the previous garment.
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
    /// Builds a network from its parameters in the order of their layers.
    pub(super) fn new(shape: &Shape, values: &[Vec<f32>]) -> Result<Self, TrainError> {
        let mut rest = values;
        let mut next = |Part { config, inputs }: Part| {
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

    /// Computes the K outputs for the inputs of a frame and the previous coefficients, in the
    /// network's units.
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
    fn training_and_inference_agree() {
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
