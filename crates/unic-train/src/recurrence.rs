//! Trains what remembers the motion: the recurrence of a prior.
//!
//! The linear map of a prior is fitted in closed form; what is left of the coefficients after it is
//! learned by a [`Recurrence`], in the space of the K coefficients, where a frame costs nothing but the
//! small network. How much of what it says is believed is measured on clips that it has not seen.

mod sequence;
mod swing;
mod unit;
mod windows;

pub(crate) use sequence::{Sequence, mirrored_surface};

use crate::{
    config::RecurrenceSettings,
    error::TrainError,
    event::Control,
    optimiser::{Moments, update},
    prior::PriorSettings,
    stream::{Stream, generator},
};
use burn::optim::GradientsParams;
use burn::tensor::Device;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use swing::livelier;
use unic_core::recurrence::Recurrence;
use unit::Unit;
use windows::Windows;

/// Asked after every step of a fit, from several threads: steps done and steps in all. One that has said
/// stop goes on saying so.
pub type Watch<'a> = dyn Fn(u64, u64) -> Control + Sync + 'a;

/// A recurrence that is worth having.
pub(crate) struct Fitted {
    /// Trained on all sequences.
    pub(crate) recurrence: Recurrence,
    /// Corrections of each sequence, T × K, by one that has not seen the sequence's clip, without larger swings:
    /// against those a field would learn to calm them.
    pub(crate) left_out: Vec<Vec<f32>>,
}

/// Parts that the motions are split into at most, to leave out one at a time. Two would judge a small capture by half
/// of what it teaches.
const MOST_FOLDS: usize = 5;

/// Less of what is left of the coefficients' squares than this is noise.
const LEAST_GAIN: f64 = 0.02;

/// Decay of the running mean of the parameters.
const AVERAGE: f32 = 0.99;

/// Trains on `sequences`; none if the corrections are of no use on clips left out.
///
/// # Errors
/// A loss that is no number, a watch that says stop.
pub(crate) fn fit_recurrence(
    settings: &RecurrenceSettings,
    sequences: &[Sequence],
    prior: &PriorSettings,
    watch: &Watch,
) -> Result<Option<Fitted>, TrainError> {
    let steps = settings.steps_for(sequences.iter().map(Sequence::len).sum());
    // As many looks at every frame as with all of them.
    let count = motions(sequences).clamp(2, MOST_FOLDS);
    let fold_of = |s: &Sequence| s.motion_number % count;
    let fold_steps = (steps * (count as u64 - 1)).div_ceil(count as u64);
    let progress = Progress {
        done: AtomicU64::new(0),
        all: count as u64 * fold_steps + steps,
        watch,
    };
    let fit = |steps: u64, sequences: Vec<&Sequence>| -> Result<Option<Recurrence>, TrainError> {
        let fit = UnitFit {
            settings,
            steps,
            sequences,
            seed: prior.seed,
            fps: prior.fps,
            device: &prior.device,
        };
        fit.run(&progress)
    };
    let others = |fold: usize| sequences.iter().filter(|s| fold_of(s) != fold).collect();
    let folds: Result<Vec<_>, TrainError> = (0..count)
        .into_par_iter()
        .map(|fold| fit(fold_steps, others(fold)))
        .collect();
    let folds = folds?;
    let corrections = |s: &Sequence| match &folds[fold_of(s)] {
        Some(recurrence) => s.corrections(recurrence),
        None => vec![0.0; s.targets.len()],
    };
    let mut left_out: Vec<Vec<f32>> = sequences.par_iter().map(corrections).collect();
    let worth = Worth::of(sequences, &left_out);
    if !worth.is_believable() {
        return Ok(None);
    }
    let scale = |values: &mut Vec<f32>| values.iter_mut().for_each(|x| *x *= worth.share as f32);
    left_out.iter_mut().for_each(scale);
    let lively = livelier(sequences, &left_out, settings.swing, prior.fps);
    Ok(fit(steps, lively.iter().collect())?.map(|mut recurrence| {
        scale(&mut recurrence.head.weight);
        scale(&mut recurrence.head.bias);
        Fitted { recurrence, left_out }
    }))
}

/// What corrections of clips left out are worth.
#[derive(Clone, Copy, Debug)]
struct Worth {
    /// The factor, 0 to 1, by which they leave least, every clip counted by what it has to correct.
    share: f64,
    /// Part of the squares that they take away then, on average over clips.
    gain: f64,
    /// Standard error of that average.
    gain_error: f64,
}

impl Worth {
    fn of(sequences: &[Sequence], corrections: &[Vec<f32>]) -> Self {
        let clips = by_clip(sequences, corrections);
        let sum = |of: fn(&Clip) -> f64| clips.iter().map(of).sum::<f64>();
        let (along, squares) = (sum(|c| c.along), sum(|c| c.squares));
        let share = if squares > 0.0 {
            (along / squares).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let gains = || clips.iter().map(|c| share * (2.0 * c.along - share * c.squares));
        let count = clips.len().max(1) as f64;
        let gain = gains().sum::<f64>() / count;
        let variance = gains().map(|g| (g - gain).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        Self {
            share,
            gain,
            gain_error: (variance / count).sqrt(),
        }
    }

    /// Less of the squares than [`LEAST_GAIN`] is noise, and so is what clips do not agree on.
    fn is_believable(&self) -> bool {
        self.gain > LEAST_GAIN.max(self.gain_error)
    }
}

/// Corrections c and targets t of a clip, relative to its |t|².
struct Clip {
    /// ⟨c, t⟩ / |t|².
    along: f64,
    /// |c|² / |t|².
    squares: f64,
}

fn by_clip(sequences: &[Sequence], corrections: &[Vec<f32>]) -> Vec<Clip> {
    let mut sums = vec![[0.0f64; 3]; motions(sequences)];
    for (sequence, correction) in sequences.iter().zip(corrections) {
        let [along, squares, size] = &mut sums[sequence.motion_number];
        for (c, t) in correction.iter().zip(&sequence.targets) {
            let (c, t) = (f64::from(*c), f64::from(*t));
            *along += c * t;
            *squares += c * c;
            *size += t * t;
        }
    }
    let sized = sums.into_iter().filter(|[_, _, size]| *size > 0.0);
    sized
        .map(|[along, squares, size]| Clip {
            along: along / size,
            squares: squares / size,
        })
        .collect()
}

/// Motions are numbered from 0 on.
fn motions(sequences: &[Sequence]) -> usize {
    sequences.iter().map(|s| s.motion_number + 1).max().unwrap_or(0)
}

struct Progress<'a> {
    done: AtomicU64,
    all: u64,
    watch: &'a Watch<'a>,
}

impl Progress<'_> {
    fn step(&self) -> Result<(), TrainError> {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        match (self.watch)(done, self.all) {
            Control::Continue => Ok(()),
            Control::Stop => Err(TrainError::Stopped),
        }
    }
}

/// One training of one unit.
struct UnitFit<'a> {
    settings: &'a RecurrenceSettings,
    steps: u64,
    sequences: Vec<&'a Sequence<'a>>,
    seed: u64,
    fps: f32,
    device: &'a Device,
}

impl UnitFit<'_> {
    /// None without anything to learn.
    fn run(&self, progress: &Progress) -> Result<Option<Recurrence>, TrainError> {
        let Some(windows) = Windows::new(&self.sequences, self.settings) else {
            return Ok(None);
        };
        let device = self.device;
        let mut unit = Unit::new(windows.sizes(), self.fps, self.seed, device);
        let mut moments = Moments::zeros(unit.values().iter().map(Vec::len));
        let mut average = unit.values();
        let optimiser = self.settings.optimiser(self.steps);
        for step in 0..self.steps {
            let mut rng = generator(self.seed, Stream::Recurrence, step);
            let loss = unit.loss(&windows.draw(&mut rng), device);
            let value = loss.clone().into_scalar::<f32>();
            if !value.is_finite() {
                return Err(TrainError::Diverged {
                    step,
                    what: "loss of the prior's recurrence",
                    value: value.into(),
                });
            }
            let gradients = GradientsParams::from_grads(loss.backward(), &unit);
            let rate = optimiser.learning_rate(step);
            let norm = update(&mut unit, gradients, &mut moments, &optimiser, rate, step)?;
            if !norm.is_finite() {
                return Err(TrainError::Diverged {
                    step,
                    what: "gradient's norm of the prior's recurrence",
                    value: norm,
                });
            }
            for (average, now) in average.iter_mut().zip(unit.values()) {
                let pairs = average.iter_mut().zip(now);
                pairs.for_each(|(a, x)| *a += (1.0 - AVERAGE) * (x - *a));
            }
            progress.step()?;
        }
        Ok(Some(windows.sizes().recurrence(&average, windows.scale())))
    }
}
