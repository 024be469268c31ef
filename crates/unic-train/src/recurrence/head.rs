//! First values of the last map of a unit that starts from a pretrained one.
//!
//! With a random last map the first steps distort what the other maps have learned, and little
//! motion allows few steps. So the last map then starts as a ridge regression from what it reads to
//! the coefficients, and all maps are trained from there (Kumar et al. 2022, "Fine-Tuning can Distort
//! Pretrained Features and Underperform Out-of-Distribution").

use super::{sequence::Sequence, unit::SLOW_SHARE};
use crate::{
    mirror::View,
    regression::{LeaveOneOut, Pairs},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use unic_core::recurrence::Recurrence;
use unic_eval::{LinearMap, Moments};

/// Ridge strengths to choose from, in units of the mean square of an input.
const STRENGTHS: [f64; 9] = [0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];

/// Seconds of motion below which last maps are regressed. A T-shirt with two minutes of motion has 4 %
/// more error on unseen motion when its last map is; loose skirts with half a minute have 5 to 14 %
/// less.
const LITTLE_MOTION_S: f32 = 60.0;

/// First values of the last map of a unit that starts from a pretrained one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum HeadStart {
    /// Small random numbers.
    #[default]
    Random,
    /// A ridge regression.
    Regressed,
}

impl HeadStart {
    /// Start for training on `sequences`. Mirrored motion and the same motion in another wind are not
    /// more motion.
    pub(super) fn of(sequences: &[Sequence], fps: f32) -> Self {
        let mut motions: BTreeMap<usize, usize> = BTreeMap::new();
        for s in sequences.iter().filter(|s| s.view == View::Direct) {
            let frames = motions.entry(s.motion_number).or_default();
            *frames = (*frames).max(s.len());
        }
        let frames: usize = motions.values().sum();
        match (frames as f32) < LITTLE_MOTION_S * fps {
            true => Self::Regressed,
            false => Self::Random,
        }
    }
}

/// A last map, with its weights as inputs × outputs.
pub(super) struct Head {
    pub(super) weight: Vec<f32>,
    pub(super) bias: Vec<f32>,
}

impl Head {
    /// Fits the last map of `unit` to sequences, whose coefficients are divided by `scale`, by the
    /// loss of the training on consecutive windows of `window` frames, without dropout. Returns none
    /// without frames.
    pub(super) fn fit(unit: &Recurrence, sequences: &[&Sequence], scale: f32, window: usize) -> Option<Self> {
        let read = |s: &&Sequence| {
            let scaled = s.coefficients.iter().map(|x| x / scale);
            Read {
                motion_number: s.motion_number,
                inputs: less_slow(s.hidden(unit), s.len(), window),
                outputs: less_slow(scaled.collect(), s.len(), window),
                frames: s.len(),
            }
        };
        let reads: Vec<Read> = sequences.par_iter().map(read).collect();
        let squares = |read: &Read| read.inputs.iter().map(|x| f64::from(x * x)).sum::<f64>();
        let count: usize = reads.iter().map(|read| read.inputs.len()).sum();
        let mean_square = reads.iter().map(squares).sum::<f64>() / count.max(1) as f64;
        let map = LeaveOneOut::fit(&reads, &STRENGTHS.map(|s| s * mean_square)).all?;
        let inputs = unit.head.inputs;
        let weight = |(i, k)| map.coefficient(i, k) as f32;
        // The value of an affine map at zero is its constant part, of which a window keeps a share.
        let constant = map.apply(&vec![0.0; inputs]).into_iter();
        let bias = constant.map(|b| (b / SLOW_SHARE) as f32);
        Some(Self {
            weight: (0..inputs)
                .flat_map(|i| (0..map.outputs()).map(move |k| (i, k)))
                .map(weight)
                .collect(),
            bias: bias.collect(),
        })
    }
}

/// Takes from frames × numbers what the loss takes from errors: all of a window's mean but
/// [`SLOW_SHARE`]. The loss of a linear map on what is left is the square of its error.
fn less_slow(mut values: Vec<f32>, frames: usize, window: usize) -> Vec<f32> {
    let width = values.len() / frames.max(1);
    for window in values.chunks_mut((width * window).max(1)) {
        let count = (window.len() / width) as f64;
        for k in 0..width {
            let sum: f64 = window.iter().skip(k).step_by(width).map(|x| f64::from(*x)).sum();
            let taken = ((1.0 - SLOW_SHARE) * sum / count) as f32;
            window.iter_mut().skip(k).step_by(width).for_each(|x| *x -= taken);
        }
    }
    values
}

/// Inputs and targets of the last map in a sequence, both [`less_slow`].
struct Read {
    motion_number: usize,
    /// Frames × width.
    inputs: Vec<f32>,
    /// Frames × K.
    outputs: Vec<f32>,
    frames: usize,
}

impl Read {
    fn inputs(&self) -> Vec<f64> {
        self.inputs.iter().copied().map(f64::from).collect()
    }

    fn outputs(&self) -> Vec<f64> {
        self.outputs.iter().copied().map(f64::from).collect()
    }
}

impl Pairs for Read {
    fn motion_number(&self) -> usize {
        self.motion_number
    }

    fn moments(&self) -> Moments {
        Moments::new(&self.inputs(), &self.outputs(), self.frames)
    }

    fn squared_error(&self, map: Option<&LinearMap>) -> f64 {
        let predicted = map.map_or_else(|| vec![0.0; self.outputs.len()], |m| m.apply_rows(&self.inputs()));
        let errors = self.outputs.iter().zip(predicted);
        errors.map(|(y, p)| (f64::from(*y) - p).powi(2)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        dataset::MotionVectors,
        mirror::View,
        noise::normal,
        recurrence::sizes::Sizes,
        stream::{Stream, generator},
    };

    const SIZES: Sizes = Sizes {
        inputs: 4,
        width: 3,
        oscillators: 2,
        outputs: 2,
    };
    const FRAMES: usize = 90;
    const SCALE: f32 = 0.25;

    fn unit() -> Recurrence {
        let mut rng = generator(1, Stream::Parameters, 0);
        let mut draw = |count| -> Vec<f32> { (0..count).map(|_| normal(&mut rng)).collect() };
        let mut values = vec![vec![-1.0; 2], vec![0.3; 2]];
        values.extend(SIZES.maps().map(|(inputs, outputs)| draw(inputs * outputs)));
        values.extend(SIZES.maps().map(|(_, outputs)| draw(outputs)));
        SIZES.recurrence(&values, 1.0)
    }

    /// Three motions whose coefficients are those that `head` makes, each plus a constant that the
    /// motion does not tell.
    fn fitted(head: &Head, constants: [f32; 3]) -> Head {
        let mut rng = generator(2, Stream::Recurrence, 0);
        let mut unit = unit();
        let motions = [(); 3].map(|()| {
            let numbers = (0..2 * FRAMES).map(|_| normal(&mut rng)).collect();
            MotionVectors::of_plain(2, numbers)
        });
        let mut sequences: Vec<Sequence> = (motions.iter().enumerate())
            .map(|(motion_number, motion)| Sequence {
                motion,
                view: View::Direct,
                frames: 0..FRAMES,
                coefficients: vec![0.0; 2 * FRAMES],
                linear: vec![0.0; 2 * FRAMES],
                motion_number,
            })
            .collect();
        for (sequence, constant) in sequences.iter_mut().zip(constants) {
            let hidden = sequence.hidden(&unit);
            let out = |read: &[f32], k: usize| {
                let products = read.iter().enumerate().map(|(i, x)| x * head.weight[2 * i + k]);
                SCALE * (head.bias[k] + products.sum::<f32>() + constant)
            };
            let rows = hidden.chunks(3).flat_map(|read| [0, 1].map(|k| out(read, k)));
            sequence.coefficients = rows.collect();
        }
        unit.head.bias.fill(9.0);
        Head::fit(&unit, &sequences.iter().collect::<Vec<_>>(), SCALE, 30).unwrap()
    }

    fn head() -> Head {
        Head {
            weight: vec![0.5, -1.0, 2.0, 0.25, -0.75, 1.5],
            bias: vec![0.3, -0.2],
        }
    }

    #[test]
    fn a_map_that_makes_the_coefficients_is_found_whatever_the_last_map_was() {
        let found = fitted(&head(), [0.0; 3]);
        for (a, b) in found
            .weight
            .iter()
            .zip(head().weight)
            .chain(found.bias.iter().zip(head().bias))
        {
            assert!((a - b).abs() < 0.1, "{:?} {:?}", found.weight, found.bias);
        }
    }

    #[test]
    fn little_motion_regresses_and_mirrored_motion_is_not_more() {
        let motion = MotionVectors::of_plain(1, vec![0.0; 2000]);
        let numbered = |frames, view, motion_number| Sequence {
            motion: &motion,
            view,
            frames: 0..frames,
            coefficients: Vec::new(),
            linear: Vec::new(),
            motion_number,
        };
        let sequence = |frames, view| numbered(frames, view, 0);
        let winds = [0, 0].map(|number| numbered(1000, View::Direct, number));
        assert_eq!(HeadStart::of(&winds, 30.0), HeadStart::Regressed);
        let motions = [0, 1].map(|number| numbered(1000, View::Direct, number));
        assert_eq!(HeadStart::of(&motions, 30.0), HeadStart::Random);
        let short = [View::Direct, View::Mirrored].map(|view| sequence(1799, view));
        assert_eq!(HeadStart::of(&short, 30.0), HeadStart::Regressed);
        assert_eq!(HeadStart::of(&short, 15.0), HeadStart::Random);
        assert_eq!(
            HeadStart::of(&[sequence(1800, View::Direct)], 30.0),
            HeadStart::Random
        );
    }

    #[test]
    fn what_is_constant_over_a_window_counts_less() {
        let error = |found: &Head| {
            let pairs = found.weight.iter().zip(head().weight);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        let found = fitted(&head(), [2.0, -1.0, -1.0]);
        assert!(error(&found) < 0.3, "{}", error(&found));
        let (mut values, whole) = (vec![5.0; 8], vec![5.0; 8]);
        values[..4].copy_from_slice(&[1.0, 10.0, 3.0, 20.0]);
        let taken = less_slow(values, 4, 2);
        let share = SLOW_SHARE as f32;
        let expected = [
            2.0 * share - 1.0,
            15.0 * share - 5.0,
            2.0 * share + 1.0,
            15.0 * share + 5.0,
        ];
        for (a, b) in taken
            .iter()
            .zip(expected.into_iter().chain(whole.iter().map(|x| share * x)))
        {
            assert!((a - b).abs() < 1e-5, "{taken:?}");
        }
        assert!(less_slow(Vec::new(), 0, 30).is_empty());
    }
}
