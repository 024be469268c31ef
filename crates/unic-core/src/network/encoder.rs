//! Categorical motion encoder at batch one: memory-bound, so plain rows times a vector.

use super::{Instructions, LayerError, Linear, check_layers, simd::Vector};
use crate::config::EncoderConfig;

/// E_θ and the pick of one category a channel (paper, section 3.1).
#[derive(Clone, Debug, PartialEq)]
pub struct Encoder {
    layers: Vec<Linear>,
    channels: usize,
    categories: usize,
}

/// Buffers of one evaluation.
#[derive(Clone, Debug, Default)]
pub struct EncoderScratch {
    front: Vec<f32>,
    back: Vec<f32>,
}

impl Encoder {
    /// From layers of the configured sizes; `inputs` is twice the motion vector's length.
    ///
    /// # Errors
    /// A layer of another size.
    pub fn new(config: &EncoderConfig, inputs: usize, layers: Vec<Linear>) -> Result<Self, LayerError> {
        let widths = config.widths(inputs);
        let expected: Vec<_> = widths.windows(2).map(|w| (w[0], w[1])).collect();
        check_layers("encoder", &layers, &expected)?;
        Ok(Self {
            layers,
            channels: config.channels,
            categories: config.categories,
        })
    }

    /// The linear maps, in order.
    pub fn layers(&self) -> &[Linear] {
        &self.layers
    }

    /// Numbers in the latent vector.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Latent vector z of a pair of normalised motion vectors, `latent` holding one number a channel.
    ///
    /// Each channel gives its largest logit: the pick of the Gumbel sampling without noise, so that
    /// inference is deterministic.
    pub fn encode(&self, inputs: &[f32], scratch: &mut EncoderScratch, latent: &mut [f32]) {
        let EncoderScratch { front, back } = scratch;
        front.clear();
        front.extend_from_slice(inputs);
        let last = self.layers.len() - 1;
        for (i, layer) in self.layers.iter().enumerate() {
            back.resize(layer.outputs, 0.0);
            apply(layer, front, back);
            if i < last {
                back.iter_mut().for_each(|x| *x = elu(*x));
            }
            std::mem::swap(front, back);
        }
        for (latent, logits) in latent.iter_mut().zip(front.chunks_exact(self.categories)) {
            *latent = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        }
        debug_assert_eq!(latent.len(), self.channels);
    }
}

/// Exponential linear unit with α = 1 (Clevert et al. 2015).
pub(crate) fn elu(x: f32) -> f32 {
    if x > 0.0 { x } else { x.exp_m1() }
}

/// Rows below which a thread has less to do than it costs to wake it.
#[cfg(feature = "rayon")]
const ROWS_PER_TASK: usize = 256;

pub(crate) fn apply(layer: &Linear, input: &[f32], output: &mut [f32]) {
    let instructions = Instructions::best();
    let rows = |first: usize, output: &mut [f32]| {
        for (row, out) in output.iter_mut().enumerate() {
            let row = first + row;
            let weights = &layer.weight[row * layer.inputs..][..layer.inputs];
            *out = layer.bias[row] + dot(instructions, weights, input);
        }
    };
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        (output.par_chunks_mut(ROWS_PER_TASK).enumerate())
            .for_each(|(i, chunk)| rows(i * ROWS_PER_TASK, chunk));
    }
    #[cfg(not(feature = "rayon"))]
    rows(0, output);
}

/// Σ a_i b_i over the shorter length.
pub(super) fn dot(instructions: Instructions, a: &[f32], b: &[f32]) -> f32 {
    match instructions {
        // SAFETY: `instructions` comes from detection on this machine.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => unsafe { dot_avx512(a, b) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { dot_avx2(a, b) },
        // SAFETY: plain arrays need no instructions.
        Instructions::Portable => unsafe { dot_of::<[f32; 8]>(a, b) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn dot_avx512(a: &[f32], b: &[f32]) -> f32 {
    // SAFETY: the caller has AVX-512F.
    unsafe { dot_of::<std::arch::x86_64::__m512>(a, b) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn dot_avx2(a: &[f32], b: &[f32]) -> f32 {
    // SAFETY: the caller has AVX2 and FMA.
    unsafe { dot_of::<std::arch::x86_64::__m256>(a, b) }
}

/// Four running sums hide the latency of the multiply-add.
///
/// # Safety
/// The machine has the instructions of `V`.
#[inline(always)]
unsafe fn dot_of<V: Vector>(a: &[f32], b: &[f32]) -> f32 {
    let count = a.len().min(b.len());
    let whole = count - count % (4 * V::LANES);
    // SAFETY: every pointer stays `4 · LANES` numbers before `whole` ≤ both lengths.
    let mut total = unsafe {
        let mut sums = [V::splat(0.0); 4];
        for i in (0..whole).step_by(4 * V::LANES) {
            for (k, sum) in sums.iter_mut().enumerate() {
                let at = i + k * V::LANES;
                *sum = sum.add_product(V::load(a.as_ptr().add(at)), V::load(b.as_ptr().add(at)));
            }
        }
        sums.map(|s| s.sum()).iter().sum::<f32>()
    };
    for i in whole..count {
        total += a[i] * b[i];
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(count: usize, phase: f32) -> Vec<f32> {
        (0..count).map(|i| (i as f32 * 0.37 + phase).sin()).collect()
    }

    #[test]
    fn every_instruction_set_gives_the_same_dot_product() {
        for count in [0, 1, 7, 64, 65, 590] {
            let (a, b) = (wave(count, 0.1), wave(count, 2.0));
            let exact: f64 = a.iter().zip(&b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
            for set in Instructions::available() {
                assert!(
                    (f64::from(dot(set, &a, &b)) - exact).abs() < 1e-4,
                    "{set:?} {count}"
                );
            }
        }
    }

    #[test]
    fn the_largest_logit_of_each_channel_is_picked() {
        let config = EncoderConfig {
            hidden: vec![],
            channels: 2,
            categories: 3,
        };
        let layer = Linear {
            inputs: 1,
            outputs: 6,
            weight: vec![1.0, 2.0, -1.0, -3.0, 0.5, 0.0],
            bias: vec![0.0, 0.0, 0.0, 0.0, 0.0, -1.0],
        };
        let encoder = Encoder::new(&config, 1, vec![layer]).unwrap();
        let mut latent = [0.0; 2];
        encoder.encode(&[2.0], &mut EncoderScratch::default(), &mut latent);
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
