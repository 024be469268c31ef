//! Stretches of sequences, drawn at random for a training step.

use super::{sequence::Sequence, sizes::Sizes};
use crate::config::RecurrenceSettings;
use rand::{Rng, RngExt};

/// Returns the greatest length such that the sequences of at least this length have half of all
/// frames. One long clip does not exclude the others.
fn common_length(sequences: &[&Sequence]) -> Option<usize> {
    let mut lengths: Vec<usize> = sequences.iter().map(|s| s.len()).collect();
    lengths.sort_unstable_by(|a, b| b.cmp(a));
    let all: usize = lengths.iter().sum();
    let mut frames = 0;
    lengths.into_iter().find(|length| {
        frames += length;
        2 * frames >= all
    })
}

/// Sequences that training windows are drawn from, with the windows' sizes.
pub(super) struct Windows<'a> {
    sequences: &'a [&'a Sequence<'a>],
    sizes: Sizes,
    windows: usize,
    frames: usize,
    dropout: f32,
    /// Root mean square of the largest coefficient, metres.
    scale: f32,
}

/// Windows of one step, frame-major.
pub(super) struct WindowBatch {
    pub(super) frames: usize,
    pub(super) windows: usize,
    pub(super) sizes: Sizes,
    pub(super) inputs: Vec<f32>,
    pub(super) targets: Vec<f32>,
    /// Dropout factors of embedding and memory: windows × width. Those of the inputs are already
    /// applied to `inputs`.
    pub(super) masks: [Vec<f32>; 2],
}

impl WindowBatch {
    pub(super) fn shape(&self, numbers: usize) -> [usize; 3] {
        [self.frames, self.windows, numbers]
    }
}

impl<'a> Windows<'a> {
    /// Measures sizes and scale. Returns none where all coefficients are zero or missing.
    pub(super) fn new(sequences: &'a [&'a Sequence<'a>], settings: &RecurrenceSettings) -> Option<Self> {
        let common = common_length(sequences)?;
        let first = sequences.first()?;
        let sizes = Sizes::new(settings, first);
        let rms = |k: usize| {
            let of = |s: &&Sequence| -> f64 {
                let column = s.coefficients.iter().skip(k).step_by(sizes.outputs);
                column.map(|t| f64::from(t * t)).sum()
            };
            let frames: usize = sequences.iter().map(|s| s.len()).sum();
            (sequences.iter().map(of).sum::<f64>() / frames.max(1) as f64).sqrt()
        };
        // One scale for all coefficients, so that each weighs in the loss as much as it moves the
        // garment.
        let scale = (0..sizes.outputs).map(rms).fold(0.0, f64::max) as f32;
        (scale > 0.0 && scale.is_finite()).then_some(Self {
            sequences,
            sizes,
            windows: settings.windows,
            frames: settings.frames.min(common),
            dropout: settings.dropout,
            scale,
        })
    }

    pub(super) fn sizes(&self) -> Sizes {
        self.sizes
    }

    /// Frames of a window.
    pub(super) fn frames(&self) -> usize {
        self.frames
    }

    /// Returns the metres in one unit of a target.
    pub(super) fn scale(&self) -> f32 {
        self.scale
    }

    pub(super) fn draw(&self, rng: &mut impl Rng) -> WindowBatch {
        let starts = |s: &&Sequence| (s.len() + 1).saturating_sub(self.frames);
        let total: usize = self.sequences.iter().map(starts).sum();
        let chosen: Vec<(&Sequence, usize)> = (0..self.windows)
            .map(|_| self.locate(rng.random_range(0..total.max(1))))
            .collect();
        let Sizes {
            inputs: numbers,
            width,
            outputs,
            ..
        } = self.sizes;
        let inputs_mask = self.mask(numbers, rng);
        let mut inputs = Vec::with_capacity(self.frames * inputs_mask.len());
        let mut targets = Vec::with_capacity(self.frames * self.windows * outputs);
        for t in 0..self.frames {
            for ((sequence, start), mask) in chosen.iter().zip(inputs_mask.chunks_exact(numbers)) {
                let first = inputs.len();
                sequence.write_pair(start + t, &mut inputs);
                inputs[first..].iter_mut().zip(mask).for_each(|(x, m)| *x *= m);
                let frame = &sequence.coefficients[(start + t) * outputs..][..outputs];
                targets.extend(frame.iter().map(|x| x / self.scale));
            }
        }
        let masks = [width, width].map(|width| self.mask(width, rng));
        WindowBatch {
            frames: self.frames,
            windows: self.windows,
            sizes: self.sizes,
            inputs,
            targets,
            masks,
        }
    }

    fn locate(&self, mut index: usize) -> (&'a Sequence<'a>, usize) {
        for &sequence in self.sequences {
            let starts = (sequence.len() + 1).saturating_sub(self.frames);
            if index < starts {
                return (sequence, index);
            }
            index -= starts;
        }
        (self.sequences[0], 0)
    }

    /// Draws dropout factors, windows × `width`: one mask per window, for all of its frames.
    fn mask(&self, width: usize, rng: &mut impl Rng) -> Vec<f32> {
        let factor = |_| {
            if rng.random::<f32>() < self.dropout {
                0.0
            } else {
                1.0 / (1.0 - self.dropout)
            }
        };
        (0..self.windows * width).map(factor).collect()
    }
}
