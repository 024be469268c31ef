//! Categorical motion encoder at batch one: memory-bound, so plain rows times a vector.

use super::{
    LayerError, Linear, Precision, check_layers,
    code::{pick, top_probability},
    rows::Rows,
};
use crate::{config::EncoderConfig, parallel::for_each_chunk};

/// E_θ and the pick of one category a channel (paper, section 3.1).
#[derive(Clone, Debug, PartialEq)]
pub struct Encoder {
    layers: Vec<Linear>,
    /// Of each layer.
    rows: Vec<Rows>,
    config: EncoderConfig,
}

/// Buffers of one evaluation.
#[derive(Clone, Debug, Default)]
pub struct EncoderScratch {
    front: Vec<f32>,
    back: Vec<f32>,
}

impl Encoder {
    /// From layers of the configured sizes, in [`Precision::F32`]; `inputs` is twice the motion vector's length.
    ///
    /// # Errors
    /// A layer of another size.
    pub fn new(config: &EncoderConfig, inputs: usize, layers: Vec<Linear>) -> Result<Self, LayerError> {
        let widths = config.widths(inputs);
        let expected: Vec<_> = widths.windows(2).map(|w| (w[0], w[1])).collect();
        check_layers("encoder", &layers, &expected)?;
        Ok(Self {
            rows: vec![Rows::F32; layers.len()],
            layers,
            config: config.clone(),
        })
    }

    /// The same encoder with weights stored in another precision; activations and sums are f32.
    pub fn with_precision(mut self, precision: Precision) -> Self {
        self.rows = self.layers.iter().map(|l| Rows::new(l, precision)).collect();
        self
    }

    /// The linear maps, in order.
    pub fn layers(&self) -> &[Linear] {
        &self.layers
    }

    /// Numbers in the latent vector.
    pub fn latent_len(&self) -> usize {
        self.config.latent_len()
    }

    /// Numbers that the categories are picked by: channels × categories.
    pub fn logit_count(&self) -> usize {
        self.config.channels * self.config.categories
    }

    /// Latent vector z of a pair of normalised motion vectors, of [`EncoderConfig::latent_len`] numbers.
    ///
    /// Each channel picks its largest logit after `noise` is added, which has [`Encoder::logit_count`]
    /// numbers or none. Without noise the same motion always gives the same code.
    pub fn encode(&self, inputs: &[f32], noise: &[f32], scratch: &mut EncoderScratch, latent: &mut [f32]) {
        let logits = self.logits(inputs, scratch);
        debug_assert_eq!(latent.len(), self.config.latent_len());
        pick(&self.config, logits, noise, latent);
    }

    /// How far a pair of normalised motion vectors decides its code: the mean over channels of the largest
    /// probability in the softmax of a channel's logits. 1: every category is certain; one over the number
    /// of categories: none is preferred.
    pub fn top_probability(&self, inputs: &[f32], scratch: &mut EncoderScratch) -> f32 {
        top_probability(self.logits(inputs, scratch), self.config.categories)
    }

    fn logits<'a>(&self, inputs: &[f32], scratch: &'a mut EncoderScratch) -> &'a [f32] {
        let EncoderScratch { front, back } = scratch;
        front.clear();
        front.extend_from_slice(inputs);
        let last = self.layers.len() - 1;
        for (i, (layer, rows)) in self.layers.iter().zip(&self.rows).enumerate() {
            back.resize(layer.outputs, 0.0);
            apply_rows(layer, rows, front, back);
            if i < last {
                back.iter_mut().for_each(|x| *x = elu(*x));
            }
            std::mem::swap(front, back);
        }
        front
    }
}

/// Exponential linear unit with α = 1 (Clevert et al. 2015).
pub(crate) fn elu(x: f32) -> f32 {
    if x > 0.0 { x } else { x.exp_m1() }
}

/// Rows below which a thread has less to do than it costs to wake it.
const ROWS_PER_TASK: usize = 256;

/// W x + b in f32.
pub(crate) fn apply(layer: &Linear, input: &[f32], output: &mut [f32]) {
    apply_rows(layer, &Rows::F32, input, output);
}

fn apply_rows(layer: &Linear, rows: &Rows, input: &[f32], output: &mut [f32]) {
    for_each_chunk(output, ROWS_PER_TASK, |first, output| {
        rows.apply(layer, input, first, output);
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
