//! Collects the wrinkles of training clips that a model replays.
//!
//! The residual of a clip is what a prior lacks that has not seen the clip. Its wrinkles get shapes
//! of their own among the prior's components ([`shapes`]), whose coefficients in training motions
//! are the library of a replay ([`unic_core::replay`]). How much of them a model adds is measured on
//! motions left out: each is animated with the wrinkles of the others ([`gain`]).

mod gain;
mod residuals;
mod shapes;

pub(crate) use residuals::Residuals;
pub(crate) use shapes::wrinkle_filter;

use crate::{config::ReplaySettings, recurrence::Sequence};
use gain::gain;
use glam::Vec3;
use rayon::prelude::*;
use residuals::last;
use shapes::WrinkleShapes;
use std::ops::Range;
use unic_core::{
    network::Linear,
    replay::{Activity, FEATURES, Key, KeyMap, Library, Replay, ReplayScratch},
};
use unic_eval::{PrincipalComponents, SampleMatrix, WrinkleFilter};

/// Largest number of frames that the principal components of the motion are computed from.
const MOST_SAMPLES: usize = 2000;

/// Largest number of frames in a library: 6 minutes at 30 frames per second. With 64 shapes they
/// take 0.8 MB.
const MOST_FRAMES: usize = 10_240;

/// Time of a clip that is worth keeping, seconds. A stretch of it plays for a second at least.
const LEAST_S: f32 = 5.0;

/// Shapes of wrinkles, and their coefficients in training clips.
pub(crate) struct FittedReplay {
    keys: KeyMap,
    /// Shapes, V × R vectors in metres.
    shapes: Vec<Vec3>,
    clips: Vec<ReplayClip>,
    /// Factor of the coefficients.
    gain: f32,
}

/// Keys and wrinkles of a part of one sequence.
struct ReplayClip {
    /// Number of the sequence's motion.
    motion_number: usize,
    keys: Vec<Key>,
    /// Coefficients of the wrinkles, frames × R, metres.
    coefficients: Vec<f32>,
}

impl FittedReplay {
    /// Collects the wrinkles of sequences. Returns none if there is nothing to replay: one short
    /// clip, or predictions that wrinkle enough.
    pub(crate) fn fit(
        settings: &ReplaySettings,
        fps: f32,
        filter: WrinkleFilter,
        residuals: Residuals,
    ) -> Option<Self> {
        let sequences = residuals.sequences;
        let numbers = || sequences.iter().map(|s| s.motion_number);
        if numbers().min() == numbers().max() {
            return None;
        }
        let keys = key_map(sequences)?;
        let shapes = WrinkleShapes::fit(filter, residuals, settings.shapes);
        let clip = |(i, frames): (usize, Range<usize>)| ReplayClip {
            motion_number: sequences[i].motion_number,
            coefficients: shapes.coefficients(residuals, i, frames.clone()),
            keys: keys_of(&keys, fps, &sequences[i])[frames].to_vec(),
        };
        let least = (LEAST_S * fps).round() as usize;
        let frames = last(&residuals.lengths(), MOST_FRAMES, least).into_iter();
        let mut fitted = Self {
            clips: frames.map(clip).collect(),
            shapes: shapes.vectors(),
            gain: 1.0,
            keys,
        };
        let played = fitted.played(fps, sequences)?;
        fitted.gain = gain(settings, residuals, &shapes, &played) as f32;
        (fitted.gain > 0.0).then_some(fitted)
    }

    /// Shapes of wrinkles, V × R vectors in metres, which become components of the prior.
    pub(crate) fn shapes(&self) -> &[Vec3] {
        &self.shapes
    }

    /// Replay of all motions, or of all but one. Returns none without any other motion.
    pub(crate) fn without(&self, motion_number: Option<usize>) -> Option<Replay> {
        let kept = |clip: &&ReplayClip| Some(clip.motion_number) != motion_number && !clip.keys.is_empty();
        let clips: Vec<_> = self.clips.iter().filter(kept).collect();
        let outputs = clips.first()?.coefficients.len() / clips.first()?.keys.len();
        let coefficients = clips.iter().flat_map(|clip| &clip.coefficients);
        let coefficients: Vec<f32> = coefficients.map(|c| self.gain * c).collect();
        let scales = scales(&coefficients, outputs);
        let units = coefficients.iter().zip(scales.iter().cycle());
        let units = units.map(|(x, s)| in_units(*x, *s)).collect();
        let keys = clips.iter().flat_map(|clip| &clip.keys).copied().collect();
        let lengths = clips.iter().map(|clip| clip.keys.len() as u32).collect();
        // Lengths agree by construction, and coefficients are finite.
        let library = Library::new(lengths, keys, units, scales).ok()?;
        Some(Replay::new(self.keys.clone(), library))
    }

    /// Wrinkles that are replayed in each sequence from those of the other motions, frames × R.
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

/// Keys of all frames of a sequence.
fn keys_of(keys: &KeyMap, fps: f32, sequence: &Sequence) -> Vec<Key> {
    let (mut activity, mut pair) = (Activity::default(), Vec::new());
    let key = |t: usize| {
        pair.clear();
        // A clip does not change before its second frame.
        sequence.write_pair(t.max(1).min(sequence.len() - 1), &mut pair);
        match t {
            0 => activity = Activity::of(&pair, 1.0 / fps),
            _ => activity.follow(&pair, 1.0 / fps),
        }
        keys.key(&pair, activity)
    };
    (0..sequence.len()).map(key).collect()
}

/// Wrinkles that a replay adds in a sequence, frames × R.
fn played_in(replay: &Replay, fps: f32, sequence: &Sequence) -> Vec<f32> {
    let (mut state, mut scratch) = (replay.start(), ReplayScratch::default());
    let outputs = replay.library().coefficients();
    let mut residuals = vec![0.0; sequence.len() * outputs];
    let mut pair = Vec::new();
    let mut frames = residuals.chunks_exact_mut(outputs.max(1));
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
