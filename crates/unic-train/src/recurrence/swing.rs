//! Energy of the garment's swings on motions that were left out.
//!
//! Least squares predict the mean of all that could follow from a motion, and the mean has less
//! energy than each possibility: the cloth appears stiff. So the swings of the recurrence's
//! training targets, their variation faster than half a hertz, are scaled up by the energy that
//! predictions on motions left out lack. Least squares are linear in the targets, so this costs
//! nothing when animating.

use super::sequence::Sequence;
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Longest period of a swing, in seconds.
const SLOWEST_S: f32 = 2.0;

/// Largest factor of a coefficient's swings in the blend. Where predictions hardly follow the
/// motion, a larger one would amplify noise.
const MOST_GAIN: f64 = 1.5;

/// Largest factor of the recurrence's targets. A recurrence with a small weight in the blend cannot
/// make up for the linear map.
const MOST_LEARNED_GAIN: f32 = 2.5;

/// Wanted energy of the swings.
pub(super) struct Swings<'a> {
    /// Wanted share of the true swings' energy, on motions left out.
    pub(super) wanted: f32,
    /// Share of the recurrence in the blend of each coefficient. The recurrence also makes up for the
    /// linear map's missing swings.
    pub(super) shares: &'a [f32],
    /// Ticks per second.
    pub(super) fps: f32,
}

impl Swings<'_> {
    /// Returns the sequences with swings scaled up by the energy that those of `left_out` lack: the
    /// blended coefficients of each sequence, predicted without its motion.
    pub(super) fn amplified<'a>(
        &self,
        sequences: &[Sequence<'a>],
        left_out: &[Vec<f32>],
    ) -> Vec<Sequence<'a>> {
        let outputs = sequences.first().map_or(0, Sequence::outputs);
        let fast = |values: &Vec<f32>| swings(values, outputs, self.fps);
        let truths: Vec<Vec<f32>> = sequences.par_iter().map(|s| fast(&s.coefficients)).collect();
        let predicted: Vec<Vec<f32>> = left_out.par_iter().map(fast).collect();
        let [truth, predicted] = [&truths, &predicted].map(|all| energies(all, outputs));
        let gains = gains(&truth, &predicted, self.wanted).into_iter();
        let of_recurrence = gains
            .zip(self.shares)
            .map(|(g, share)| recurrence_gain(g, *share));
        let of_recurrence: Vec<f32> = of_recurrence.collect();
        let amplified = |(s, swings): (&Sequence<'a>, &Vec<f32>)| {
            let mut s = s.clone();
            let pairs = s
                .coefficients
                .iter_mut()
                .zip(swings)
                .zip(of_recurrence.iter().cycle());
            pairs.for_each(|((a, swing), gain)| *a += (gain - 1.0) * swing);
            s
        };
        sequences.iter().zip(&truths).map(amplified).collect()
    }
}

/// Factor of the recurrence's swings that gives the blend's swings the factor `gain`, at least 1.
fn recurrence_gain(gain: f32, share: f32) -> f32 {
    match share > 0.0 {
        true => (1.0 + (gain - 1.0) / share).min(MOST_LEARNED_GAIN),
        // No factor changes the blend.
        false => 1.0,
    }
}

/// Sum of squares of each coefficient.
fn energies(swings: &[Vec<f32>], outputs: usize) -> Vec<f64> {
    let mut energies = vec![0.0; outputs];
    for row in swings.iter().flat_map(|s| s.chunks_exact(outputs.max(1))) {
        energies
            .iter_mut()
            .zip(row)
            // Summed in f64: sums of many small squares lose digits in f32.
            .for_each(|(e, x)| *e += f64::from(x * x));
    }
    energies
}

/// Factor of each coefficient's swings.
fn gains(truths: &[f64], predicted: &[f64], wanted: f32) -> Vec<f32> {
    let gain = |(truth, predicted): (&f64, &f64)| match *predicted > 0.0 {
        true => (f64::from(wanted) * truth / predicted)
            .sqrt()
            // Never below 1: swings with enough energy are not damped.
            .clamp(1.0, MOST_GAIN) as f32,
        false => 1.0,
    };
    truths.iter().zip(predicted).map(gain).collect()
}

/// High-pass filter: frames × `outputs` minus their mean over a Hann window of [`SLOWEST_S`]. The
/// window is symmetric, so no phase shifts.
pub(crate) fn swings(values: &[f32], outputs: usize, fps: f32) -> Vec<f32> {
    let frames = values.len() / outputs.max(1);
    let half = (0.5 * SLOWEST_S * fps) as usize;
    let window: Vec<f32> = (0..=2 * half)
        // Shifted by one: the two outermost weights of a Hann window are zero and are left out.
        .map(|i| 1.0 - (TAU * (i + 1) as f32 / (2 * half + 2) as f32).cos())
        .collect();
    let mut fast = values.to_vec();
    for (t, row) in fast.chunks_exact_mut(outputs.max(1)).enumerate() {
        let near = t.saturating_sub(half)..(t + half + 1).min(frames);
        let weights = &window[near.start + half - t..][..near.len()];
        // Normalised by the weights in range: a constant stays its own mean where the window is cut
        // off.
        let total: f32 = weights.iter().sum();
        for (s, weight) in near.zip(weights) {
            let around = &values[s * outputs..][..outputs];
            row.iter_mut()
                .zip(around)
                .for_each(|(x, y)| *x -= weight / total * y);
        }
    }
    fast
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{dataset::MotionVectors, mirror::View};

    #[test]
    fn amplification_restores_fast_swings_and_keeps_the_mean() {
        const FPS: f32 = 30.0;
        let motion = MotionVectors::of_plain(1, vec![0.0; 300]);
        let wave: Vec<f32> = (0..300).map(|t| (TAU * 1.5 * t as f32 / FPS).sin()).collect();
        // Predictions have four fifths of the true swing and all of its mean, 5 m.
        let sequence = Sequence {
            motion: &motion,
            view: View::Direct,
            frames: 0..300,
            coefficients: wave.iter().map(|x| 5.0 + x).collect(),
            linear: vec![0.0; 300],
            motion_number: 0,
        };
        let left_out: Vec<f32> = wave.iter().map(|x| 5.0 + 0.8 * x).collect();
        let learned = |wanted, share: f32| {
            let swings = Swings {
                wanted,
                shares: &[share],
                fps: FPS,
            };
            let amplified =
                swings.amplified(std::slice::from_ref(&sequence), std::slice::from_ref(&left_out));
            amplified[0].coefficients.clone()
        };
        for (share, size) in [(1.0, 1.25), (0.5, 1.5), (0.01, 2.5), (0.0, 1.0)] {
            for (t, (x, target)) in (wave.iter().zip(learned(1.0, share)))
                .enumerate()
                .skip(45)
                .take(210)
            {
                assert!(
                    (target - 5.0 - size * x).abs() < 0.02,
                    "frame {t}: {target} of {x}"
                );
            }
        }
        assert_eq!(learned(0.0, 1.0), sequence.coefficients);
    }

    #[test]
    fn each_coefficient_has_the_gain_of_its_own_share() {
        let motion = MotionVectors::of_plain(1, vec![0.0; 300]);
        let wave = (0..600).map(|i| (TAU * 1.5 * (i / 2) as f32 / 30.0).sin());
        let sequence = Sequence {
            motion: &motion,
            view: View::Direct,
            frames: 0..300,
            coefficients: wave.collect(),
            linear: vec![0.0; 600],
            motion_number: 0,
        };
        let left_out: Vec<f32> = sequence.coefficients.iter().map(|x| 0.8 * x).collect();
        let swings = Swings {
            wanted: 1.0,
            shares: &[0.5, 0.0],
            fps: 30.0,
        };
        let amplified = swings.amplified(std::slice::from_ref(&sequence), &[left_out]);
        for (t, pair) in amplified[0]
            .coefficients
            .chunks_exact(2)
            .enumerate()
            .skip(45)
            .take(210)
        {
            assert!((pair[0] - 1.5 * pair[1]).abs() < 0.02, "frame {t}: {pair:?}");
        }
    }

    #[test]
    fn high_pass_filter_keeps_fast_waves_without_a_phase_shift() {
        const FPS: f32 = 30.0;
        let wave = |hz: f32| move |t: usize| (TAU * hz * t as f32 / FPS).sin();
        for (hz, share) in [(0.05, 0.0), (1.5, 1.0), (4.0, 1.0)] {
            let values: Vec<f32> = (0..600).map(wave(hz)).flat_map(|x| [x, -2.0 * x]).collect();
            let fast = swings(&values, 2, FPS);
            for t in 60..540 {
                let expected = share * wave(hz)(t);
                assert!((fast[2 * t] - expected).abs() < 0.06, "{hz} Hz, frame {t}");
                assert!((fast[2 * t + 1] + 2.0 * fast[2 * t]).abs() < 1e-4);
            }
        }
        // At the ends the window is cut off, not padded.
        assert!(swings(&[3.0; 40], 1, FPS).iter().all(|x| x.abs() < 1e-5));
    }

    #[test]
    fn gains_restore_the_wanted_energy_within_bounds() {
        let found = gains(&[4.0, 4.0, 4.0, 100.0, 1.0], &[2.0, 3.6, 8.0, 1.0, 0.0], 0.85);
        assert!((found[0] - 1.7f32.sqrt()).abs() < 1e-6);
        // Enough energy, too much, hardly any, none.
        assert_eq!(found[1..], [1.0, 1.0, 1.5, 1.0]);
        assert_eq!(gains(&[4.0], &[1.0], 0.0), [1.0]);
    }
}
