//! Categorical motion encoder at batch size one, where each layer is a matrix times a vector.

use super::{
    LayerError, LayerSize, Linear, Precision, check_layers,
    code::{pick, top_probability},
    rows::StoredRows,
};
use crate::{config::EncoderConfig, parallel::for_each_chunk};

/// Motion encoder E_θ, which picks one category a channel (paper, section 3.1).
#[derive(Clone, Debug, PartialEq)]
pub struct Encoder {
    layers: Vec<Linear>,
    /// Weights of each layer as they are multiplied.
    stored: Vec<StoredRows>,
    config: EncoderConfig,
}

/// Scratch memory of [`Encoder::encode`].
#[derive(Clone, Debug, Default)]
pub struct EncoderScratch {
    /// Input of the current layer.
    front: Vec<f32>,
    /// Output of the current layer.
    back: Vec<f32>,
}

impl Encoder {
    /// Makes an encoder from layers of the configured sizes, in [`Precision::F32`].
    ///
    /// `inputs` is the length of a pair of motion vectors.
    ///
    /// # Errors
    /// A layer of another size.
    pub fn new(config: &EncoderConfig, inputs: usize, layers: Vec<Linear>) -> Result<Self, LayerError> {
        let widths = config.widths(inputs);
        let size = |ends: &[usize]| LayerSize {
            inputs: ends[0],
            outputs: ends[1],
        };
        let expected: Vec<_> = widths.windows(2).map(size).collect();
        check_layers("encoder", &layers, &expected)?;
        Ok(Self {
            stored: vec![StoredRows::F32; layers.len()],
            layers,
            config: config.clone(),
        })
    }

    /// Returns the same encoder with weights stored in another precision; activations and sums stay
    /// f32.
    pub fn with_precision(mut self, precision: Precision) -> Self {
        let layers = self.layers.iter();
        self.stored = layers.map(|l| StoredRows::new(l, precision)).collect();
        self
    }

    /// Linear maps in order, in f32.
    pub fn layers(&self) -> &[Linear] {
        &self.layers
    }

    /// Length of the latent vector.
    pub fn latent_len(&self) -> usize {
        self.config.latent_len()
    }

    /// Number of logits, channels × categories.
    pub fn logit_count(&self) -> usize {
        self.config.channels * self.config.categories
    }

    /// Writes the latent vector z of a pair of normalised motion vectors.
    ///
    /// `latent` has [`EncoderConfig::latent_len`] numbers. Each channel picks its largest logit
    /// after `noise` is added, which has [`Encoder::logit_count`] numbers or none. Without noise
    /// the same motion always gives the same code.
    pub fn encode(&self, inputs: &[f32], noise: &[f32], scratch: &mut EncoderScratch, latent: &mut [f32]) {
        let logits = self.logits(inputs, scratch);
        debug_assert_eq!(latent.len(), self.config.latent_len());
        pick(&self.config, logits, noise, latent);
    }

    /// Confidence of the code for a pair of normalised motion vectors: the mean over channels of
    /// the largest softmax probability.
    ///
    /// It is 1 where every category is certain, and one over the number of categories where none is
    /// preferred.
    pub fn top_probability(&self, inputs: &[f32], scratch: &mut EncoderScratch) -> f32 {
        top_probability(self.logits(inputs, scratch), self.config.categories)
    }

    /// Runs all layers; the logits stay in `scratch`.
    fn logits<'a>(&self, inputs: &[f32], scratch: &'a mut EncoderScratch) -> &'a [f32] {
        let EncoderScratch { front, back } = scratch;
        front.clear();
        front.extend_from_slice(inputs);
        let last = self.layers.len() - 1;
        for (i, (layer, stored)) in self.layers.iter().zip(&self.stored).enumerate() {
            back.resize(layer.outputs, 0.0);
            apply_stored(layer, stored, front, back);
            if i < last {
                back.iter_mut().for_each(|x| *x = elu(*x));
            }
            // The output is the input of the next layer.
            std::mem::swap(front, back);
        }
        front
    }
}

/// Exponential linear unit with α = 1 (Clevert et al. 2015).
pub(crate) fn elu(x: f32) -> f32 {
    // exp(x) − 1 would lose all digits of small x.
    if x > 0.0 { x } else { x.exp_m1() }
}

/// Rows of one task. Fewer take less time than waking a thread.
const ROWS_PER_TASK: usize = 256;

/// Writes W x + b, computed in f32 on all threads.
pub(crate) fn apply(layer: &Linear, input: &[f32], output: &mut [f32]) {
    apply_stored(layer, &StoredRows::F32, input, output);
}

fn apply_stored(layer: &Linear, stored: &StoredRows, input: &[f32], output: &mut [f32]) {
    for_each_chunk(output, ROWS_PER_TASK, |first_row, output| {
        stored.apply(layer, input, first_row, output);
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::LatentCode;

    #[test]
    fn the_largest_logit_of_each_channel_is_picked() {
        let config = EncoderConfig {
            hidden: vec![],
            channels: 2,
            categories: 3,
            code: LatentCode::PickedLogit,
        };
        let layer = Linear {
            inputs: 1,
            outputs: 6,
            weight: vec![1.0, 2.0, -1.0, -3.0, 0.5, 0.0],
            bias: vec![0.0, 0.0, 0.0, 0.0, 0.0, -1.0],
        };
        let encoder = Encoder::new(&config, 1, vec![layer]).unwrap();
        let mut latent = [0.0; 2];
        encoder.encode(&[2.0], &[], &mut EncoderScratch::default(), &mut latent);
        assert_eq!(latent, [4.0, 1.0]);
        assert!(Encoder::new(&config, 2, encoder.layers().to_vec()).is_err());
    }

    #[test]
    fn elu_is_smooth_at_zero() {
        assert_eq!(elu(2.0), 2.0);
        assert!((elu(-1e-3) + 1e-3).abs() < 1e-6);
        assert!((elu(-20.0) + 1.0).abs() < 1e-6);
    }
}
