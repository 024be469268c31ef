//! The categorical code of the motion: one category is picked in each channel of logits.

use crate::config::{EncoderConfig, LatentCode};
use serde::Serialize;

/// How inference picks the category of each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CodeSampling {
    /// The largest logit: the same motion always gives the same code.
    #[default]
    Largest,
    /// The largest sum of logit and Gumbel noise, drawn anew in every tick, as the authors' release does:
    /// with a `scale` of 1 a category is picked as often as the softmax of its channel says.
    Gumbel {
        /// Spread of the uniform numbers that the noise is made of, 0 to 1; 0 picks the largest logit. What lies
        /// beyond counts as the nearer end, NaN as 0.
        scale: f32,
        /// Seed of the noise.
        seed: u64,
    },
}

impl CodeSampling {
    /// Noise of one tick, a number a logit; left empty where nothing is drawn.
    pub(crate) fn write_noise(self, tick: u64, logits: usize, noise: &mut Vec<f32>) {
        noise.clear();
        if let Self::Gumbel { scale, seed } = self {
            // NaN is not above zero.
            let scale = if scale > 0.0 { scale.min(1.0) } else { 0.0 };
            let mut state = mixed(seed ^ mixed(tick));
            noise.extend((0..logits).map(|_| {
                state = state.wrapping_add(GOLDEN_GAMMA);
                // The top 24 bits are a uniform number with all digits that f32 has.
                let uniform = (mixed(state) >> 40) as f32 / (1u64 << 24) as f32;
                gumbel(scale * (uniform - 0.5) + 0.5)
            }));
        }
    }
}

/// 2^64 over the golden ratio: the increment of SplitMix64 (Steele et al. 2014).
const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// Output function of SplitMix64.
fn mixed(state: u64) -> u64 {
    let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// −ln(−ln u): a Gumbel number from a uniform one, which is kept away from 0 and 1.
pub fn gumbel(uniform: f32) -> f32 {
    -(-uniform.clamp(1e-7, 1.0 - 1e-7).ln()).ln()
}

/// Latent vector from logits, channel by channel; `noise` is empty or has one number a logit.
pub(super) fn pick(config: &EncoderConfig, logits: &[f32], noise: &[f32], latent: &mut [f32]) {
    let categories = config.categories;
    for (channel, logits) in logits.chunks_exact(categories).enumerate() {
        let noise = noise.chunks_exact(categories).nth(channel);
        let score = |k: usize| logits[k] + noise.map_or(0.0, |noise| noise[k]);
        // The first of equal scores, as `argmax` has it.
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

/// Mean over channels of the largest probability in the softmax of a channel's logits: 1 where the motion
/// decides every category, 1 / `categories` where it decides none.
pub(super) fn top_probability(logits: &[f32], categories: usize) -> f32 {
    let mut channels = 0;
    let sum: f32 = logits
        .chunks_exact(categories)
        .map(|logits| {
            channels += 1;
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
    fn a_code_is_the_picked_logit_or_where_it_stands() {
        let logits = [1.0, 4.0, -2.0, -6.0, -1.0, -1.0];
        let mut latent = [9.0; 2];
        pick(&config(LatentCode::PickedLogit), &logits, &[], &mut latent);
        assert_eq!(latent, [4.0, -1.0]);
        let mut latent = [9.0; 6];
        pick(&config(LatentCode::OneHot), &logits, &[], &mut latent);
        assert_eq!(latent, [0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
        // Noise decides which logit it is, and is no part of it.
        let noise = [0.0, 0.0, 7.0, 0.0, 0.0, 0.5];
        let mut latent = [9.0; 2];
        pick(&config(LatentCode::PickedLogit), &logits, &noise, &mut latent);
        assert_eq!(latent, [-2.0, -1.0]);
    }

    #[test]
    fn noise_picks_as_often_as_the_softmax_says() {
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
    fn noise_is_a_function_of_seed_and_tick_and_none_at_scale_zero() {
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
    fn the_top_probability_tells_a_decided_code_from_an_undecided_one() {
        assert!((top_probability(&[2.0; 8], 8) - 0.125).abs() < 1e-6);
        assert!((top_probability(&[0.0, 100.0, 0.0, 0.0], 4) - 1.0).abs() < 1e-6);
        // e / (e + 1) and 1 / 2.
        let half_decided = top_probability(&[1.0, 0.0, 3.0, 3.0], 2);
        assert!((half_decided - (0.731_058_6 + 0.5) / 2.0).abs() < 1e-6);
    }
}
