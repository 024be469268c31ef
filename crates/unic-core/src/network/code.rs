//! Categorical code of the motion: one category a channel, picked by its logits.

use crate::config::{EncoderConfig, LatentCode};
use serde::Serialize;

/// Rule by which inference picks the category of each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CodeSampling {
    /// The largest logit. The same motion always gives the same code.
    #[default]
    Largest,
    /// The largest sum of logit and Gumbel noise, drawn anew in every tick, as in the
    /// authors' release. A `scale` of 1 picks a category with its softmax probability.
    Gumbel {
        /// Spread of the uniform numbers that the noise is made of, 0 to 1; 0 picks the largest
        /// logit. Values are clamped to that range, and NaN counts as 0.
        scale: f32,
        /// Seed of the noise.
        seed: u64,
    },
}

impl CodeSampling {
    /// Writes the noise of one tick, one number a logit; leaves `noise` empty for
    /// [`Self::Largest`].
    pub(crate) fn write_noise(self, tick: u64, logits: usize, noise: &mut Vec<f32>) {
        noise.clear();
        if let Self::Gumbel { scale, seed } = self {
            // A comparison with NaN is false, so that NaN becomes 0.
            let scale = if scale > 0.0 { scale.min(1.0) } else { 0.0 };
            // A stream of its own for every tick, so that a restored state draws the same noise.
            let mut state = mixed(seed ^ mixed(tick));
            noise.extend((0..logits).map(|_| {
                state = state.wrapping_add(GOLDEN_GAMMA);
                // 24 bits are as many as f32 represents exactly.
                let uniform = (mixed(state) >> 40) as f32 / (1u64 << 24) as f32;
                gumbel(scale * (uniform - 0.5) + 0.5)
            }));
        }
    }
}

/// Increment of SplitMix64, 2^64 over the golden ratio (Steele et al. 2014).
const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// Output function of SplitMix64.
fn mixed(state: u64) -> u64 {
    let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Standard Gumbel number −ln(−ln u) of a number u that is uniform in [0, 1].
pub fn gumbel(uniform: f32) -> f32 {
    // At 0 and 1 the logarithms are infinite.
    -(-uniform.clamp(1e-7, 1.0 - 1e-7).ln()).ln()
}

/// Writes the latent vector, channel by channel; `noise` is empty or has one number a logit.
pub(super) fn pick(config: &EncoderConfig, logits: &[f32], noise: &[f32], latent: &mut [f32]) {
    let categories = config.categories;
    for (channel, logits) in logits.chunks_exact(categories).enumerate() {
        let noise = noise.chunks_exact(categories).nth(channel);
        let score = |k: usize| logits[k] + noise.map_or(0.0, |noise| noise[k]);
        // Equal scores give the first category, as `argmax` does.
        let best = (1..categories).fold(0, |best, k| if score(k) > score(best) { k } else { best });
        match config.code {
            LatentCode::PickedLogit => latent[channel] = logits[best],
            LatentCode::OneHot => {
                let latent = &mut latent[channel * categories..(channel + 1) * categories];
                latent.fill(0.0);
                latent[best] = 1.0;
            }
        }
    }
}

/// Mean over channels of the largest softmax probability: 1 where every category is certain,
/// 1 / `categories` where none is preferred.
pub(super) fn top_probability(logits: &[f32], categories: usize) -> f32 {
    let mut channels = 0;
    let sum: f32 = logits
        .chunks_exact(categories)
        .map(|logits| {
            channels += 1;
            // Softmax with the largest logit subtracted, so that no exponential overflows. The
            // largest probability is then 1 over the sum.
            let largest = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            logits.iter().map(|x| (x - largest).exp()).sum::<f32>().recip()
        })
        .sum();
    sum / channels.max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(code: LatentCode) -> EncoderConfig {
        EncoderConfig {
            hidden: vec![],
            channels: 2,
            categories: 3,
            code,
        }
    }

    #[test]
    fn a_code_is_the_picked_logit_or_a_one_hot_vector() {
        let logits = [1.0, 4.0, -2.0, -6.0, -1.0, -1.0];
        let mut latent = [9.0; 2];
        pick(&config(LatentCode::PickedLogit), &logits, &[], &mut latent);
        assert_eq!(latent, [4.0, -1.0]);
        let mut latent = [9.0; 6];
        pick(&config(LatentCode::OneHot), &logits, &[], &mut latent);
        assert_eq!(latent, [0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
        // Noise decides which logit is picked, and is not added to it.
        let noise = [0.0, 0.0, 7.0, 0.0, 0.0, 0.5];
        let mut latent = [9.0; 2];
        pick(&config(LatentCode::PickedLogit), &logits, &noise, &mut latent);
        assert_eq!(latent, [-2.0, -1.0]);
    }

    #[test]
    fn categories_are_picked_with_their_softmax_probabilities() {
        let logits = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0];
        let (mut noise, mut picks) = (Vec::new(), [0; 3]);
        let mut latent = [0.0; 6];
        let ticks = 20_000;
        for tick in 0..ticks {
            CodeSampling::Gumbel { scale: 1.0, seed: 3 }.write_noise(tick, 6, &mut noise);
            pick(&config(LatentCode::OneHot), &logits, &noise, &mut latent);
            (0..3).for_each(|k| picks[k] += latent[k] as u64);
        }
        let total = 1f64.exp() + 2.0;
        for (found, expected) in picks
            .into_iter()
            .zip([1.0 / total, 1f64.exp() / total, 1.0 / total])
        {
            let share = found as f64 / ticks as f64;
            // Four standard deviations of a share near a half.
            assert!((share - expected).abs() < 0.015, "{share} {expected}");
        }
    }

    #[test]
    fn noise_depends_on_seed_and_tick_and_vanishes_at_scale_zero() {
        let noise = |scale, seed, tick| {
            let mut noise = Vec::new();
            CodeSampling::Gumbel { scale, seed }.write_noise(tick, 4, &mut noise);
            noise
        };
        assert_eq!(noise(1.0, 1, 5), noise(1.0, 1, 5));
        assert_ne!(noise(1.0, 1, 5), noise(1.0, 1, 6));
        assert_ne!(noise(1.0, 1, 5), noise(1.0, 2, 5));
        assert_eq!(noise(0.0, 1, 5), [gumbel(0.5); 4]);
        assert_eq!(noise(f32::NAN, 1, 5), noise(0.0, 1, 5));
        assert_eq!(noise(7.0, 1, 5), noise(1.0, 1, 5));
        let mut none = vec![1.0];
        CodeSampling::Largest.write_noise(5, 4, &mut none);
        assert!(none.is_empty());
    }

    #[test]
    fn top_probability_separates_certain_codes_from_uncertain_ones() {
        assert!((top_probability(&[2.0; 8], 8) - 0.125).abs() < 1e-6);
        assert!((top_probability(&[0.0, 100.0, 0.0, 0.0], 4) - 1.0).abs() < 1e-6);
        // e / (e + 1) and 1 / 2.
        let half_decided = top_probability(&[1.0, 0.0, 3.0, 3.0], 2);
        assert!((half_decided - (0.731_058_6 + 0.5) / 2.0).abs() < 1e-6);
    }
}
