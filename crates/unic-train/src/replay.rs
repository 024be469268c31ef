//! Collects the residuals of training clips that a model replays.
//!
//! The residual of a clip is what a prior lacks that has not seen the clip
//! ([`unic_core::replay`]). How much of it a model adds is measured on motions left out: each is
//! animated with the residuals of the others ([`gains`]).

mod gains;

use crate::{config::ReplaySettings, recurrence::Sequence};
use gains::{Fold, Gains, centre};
use rayon::prelude::*;
use std::ops::Range;
use unic_core::{
    network::Linear,
    replay::{Activity, FEATURES, Key, KeyMap, Library, MOST_FRAMES, Replay, ReplayScratch},
};
use unic_eval::{PrincipalComponents, SampleMatrix};

/// Largest number of frames that the principal components of the motion are computed from.
const MOST_SAMPLES: usize = 2000;

/// Residuals of training clips, scaled by their gains.
pub(crate) struct FittedReplay {
    keys: KeyMap,
    clips: Vec<ReplayClip>,
}

/// Keys and residuals of one sequence.
struct ReplayClip {
    /// Number of the sequence's motion.
    motion_number: usize,
    keys: Vec<Key>,
    /// Residuals about their mean, frames × K, metres.
    residuals: Vec<f32>,
}

impl FittedReplay {
    /// Collects the residuals of sequences beside `left_out`, their coefficients as predicted
    /// without their motion, frames × K. Returns none if there is nothing to replay: a lone motion,
    /// or predictions that vary enough.
    pub(crate) fn fit(
        settings: &ReplaySettings,
        fps: f32,
        sequences: &[Sequence],
        left_out: &[Vec<f32>],
    ) -> Option<Self> {
        let keys = key_map(sequences)?;
        let pairs = sequences.par_iter().zip(left_out);
        let clips = pairs.map(|(s, predicted)| ReplayClip::new(&keys, fps, s, predicted));
        let mut unscaled = Self {
            clips: clips.collect(),
            keys,
        };
        let played = unscaled.played(fps, sequences)?;
        let folds: Vec<Fold> = (sequences.iter().zip(left_out).zip(&played))
            .map(|((s, predicted), played)| Fold::new(s, predicted, played, fps))
            .collect();
        let gains = Gains::measure(settings, &folds)?;
        for clip in &mut unscaled.clips {
            clip.residuals = gains.scaled(&clip.residuals, fps);
        }
        Some(unscaled)
    }

    /// Replay of all motions, or of all but one. Returns none without any other motion.
    pub(crate) fn without(&self, motion_number: Option<usize>) -> Option<Replay> {
        let kept = |clip: &&ReplayClip| Some(clip.motion_number) != motion_number;
        let (mut frames, mut clips) = (0, Vec::new());
        for clip in self.clips.iter().filter(kept) {
            let taken = clip.keys.len().min(MOST_FRAMES - frames);
            frames += taken;
            clips.push((clip, taken));
        }
        clips.retain(|(_, taken)| *taken > 0);
        let outputs = clips.first().map(|(clip, _)| clip.outputs())?;
        let residuals: Vec<f32> = (clips.iter())
            .flat_map(|(clip, taken)| &clip.residuals[..taken * outputs])
            .copied()
            .collect();
        let scales = scales(&residuals, outputs);
        let units = residuals
            .iter()
            .zip(scales.iter().cycle())
            .map(|(x, s)| in_units(*x, *s));
        let keys = clips
            .iter()
            .flat_map(|(clip, taken)| &clip.keys[..*taken])
            .copied();
        let lengths = clips.iter().map(|(_, taken)| *taken as u32);
        // Lengths agree by construction, and residuals are finite.
        let library = Library::new(lengths.collect(), keys.collect(), units.collect(), scales).ok()?;
        Some(Replay::new(self.keys.clone(), library))
    }

    /// Residuals that are replayed in each sequence from those of the other motions, frames × K.
    fn played(&self, fps: f32, sequences: &[Sequence]) -> Option<Vec<Vec<f32>>> {
        let motions = sequences.iter().map(|s| s.motion_number + 1).max()?;
        let replays: Vec<Replay> = (0..motions)
            .into_par_iter()
            .map(|motion| self.without(Some(motion)))
            .collect::<Option<_>>()?;
        let played = sequences
            .par_iter()
            .map(|s| played_in(&replays[s.motion_number], fps, s));
        Some(played.collect())
    }
}

impl ReplayClip {
    fn new(keys: &KeyMap, fps: f32, sequence: &Sequence, predicted: &[f32]) -> Self {
        let (mut activity, mut pair) = (Activity::default(), Vec::new());
        let mut key = |t: usize| {
            pair.clear();
            // A clip does not change before its second frame.
            sequence.write_pair(t.max(1).min(sequence.len() - 1), &mut pair);
            match t {
                0 => activity = Activity::of(&pair, 1.0 / fps),
                _ => activity.follow(&pair, 1.0 / fps),
            }
            keys.key(&pair, activity)
        };
        let pairs = sequence.coefficients.iter().zip(predicted);
        let mut residuals: Vec<f32> = pairs.map(|(c, p)| c - p).collect();
        // The mean residual belongs to the clip's own start.
        centre(&mut residuals, sequence.outputs());
        Self {
            motion_number: sequence.motion_number,
            keys: (0..sequence.len()).map(&mut key).collect(),
            residuals,
        }
    }

    /// Number K of coefficients.
    fn outputs(&self) -> usize {
        self.residuals.len() / self.keys.len().max(1)
    }
}

/// Residuals that a replay adds in a sequence, frames × K.
fn played_in(replay: &Replay, fps: f32, sequence: &Sequence) -> Vec<f32> {
    let (mut state, mut scratch) = (replay.start(), ReplayScratch::default());
    let mut residuals = vec![0.0; sequence.coefficients.len()];
    let mut pair = Vec::new();
    let mut frames = residuals.chunks_exact_mut(sequence.outputs().max(1));
    let Some(first) = frames.next() else {
        return Vec::new();
    };
    for (t, out) in (1..).zip(frames) {
        pair.clear();
        sequence.write_pair(t, &mut pair);
        if t == 1 {
            replay.begin(&pair, 1.0 / fps, &mut state);
            replay.add_to(&state, first);
        }
        replay.advance(&pair, 1.0 / fps, &mut state, &mut scratch);
        replay.add_to(&state, out);
    }
    residuals
}

/// Unit of each coefficient's residuals, with which the largest takes 127 steps.
fn scales(residuals: &[f32], outputs: usize) -> Vec<f32> {
    let largest = |k: usize| {
        let column = residuals.iter().skip(k).step_by(outputs);
        column.fold(0.0f32, |most, x| most.max(x.abs()))
    };
    (0..outputs).map(|k| largest(k) / f32::from(i8::MAX)).collect()
}

fn in_units(x: f32, scale: f32) -> i8 {
    // A division of zero by zero is no number, which becomes 0.
    (x / scale).round() as i8
}

/// Motion vectors of frames that are spread evenly over sequences.
struct MotionSamples<'a> {
    sequences: &'a [Sequence<'a>],
    /// Sequence and frame of each sample.
    frames: Vec<(usize, usize)>,
}

impl<'a> MotionSamples<'a> {
    fn spread(sequences: &'a [Sequence<'a>]) -> Self {
        let all: usize = sequences.iter().map(Sequence::len).sum();
        let every = all.div_ceil(MOST_SAMPLES).max(1);
        let frames = sequences
            .iter()
            .enumerate()
            .flat_map(|(i, s)| (0..s.len()).map(move |t| (i, t)));
        Self {
            sequences,
            frames: frames.step_by(every).collect(),
        }
    }
}

impl SampleMatrix for MotionSamples<'_> {
    fn rows(&self) -> usize {
        self.frames.len()
    }

    fn columns(&self) -> usize {
        self.sequences.first().map_or(0, |s| s.motion.len)
    }

    fn read(&self, row: usize, columns: Range<usize>, out: &mut [f32]) {
        let (sequence, t) = self.frames[row];
        let s = &self.sequences[sequence];
        out.copy_from_slice(&s.motion.frame(s.frames.start + t, s.view)[columns]);
    }
}

/// Map from motion vectors to their leading principal components, in units of the components' root
/// mean square. Returns none for a motion that does not change.
fn key_map(sequences: &[Sequence]) -> Option<KeyMap> {
    let samples = MotionSamples::spread(sequences);
    let components = PrincipalComponents::fit(&samples, FEATURES);
    let unit = (components.variances().iter().sum::<f64>() / FEATURES as f64).sqrt() as f32;
    if unit <= 0.0 || !unit.is_finite() {
        return None;
    }
    let inputs = samples.columns();
    let mut weight = vec![0.0; FEATURES * inputs];
    let mut bias = vec![0.0; FEATURES];
    for k in 0..components.len() {
        let row = &mut weight[k * inputs..(k + 1) * inputs];
        let component = components.component(k).iter();
        row.iter_mut().zip(component).for_each(|(w, c)| *w = c / unit);
        bias[k] = -row.iter().zip(components.mean()).map(|(w, m)| w * m).sum::<f32>();
    }
    // Sizes are right, and components of finite vectors are finite.
    KeyMap::new(Linear {
        inputs,
        outputs: FEATURES,
        weight,
        bias,
    })
    .ok()
}
