//! Trains what remembers the motion: the recurrence of a prior.
//!
//! The linear map of a prior is fitted in closed form; what is left of the coefficients after it is
//! learned by a [`Recurrence`], in the space of the K coefficients, where a frame costs nothing but the
//! small network. How much of what it says is believed is measured on clips that it has not seen.

mod sequence;
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
    /// Its corrections of each sequence, T × K, by one that has not seen the sequence's clip.
    pub(crate) left_out: Vec<Vec<f32>>,
}

/// Parts that the clips are split into, to leave out one at a time. More would judge a small capture by more
/// of what it teaches, and five keep a correction for a garment that moves to a rhythm of its own.
const FOLDS: usize = 2;

/// Less of the correction than this is noise.
const LEAST_SHARE: f64 = 0.05;

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
    let fold_steps = settings.steps.div_ceil(FOLDS as u64);
    let progress = Progress {
        done: AtomicU64::new(0),
        all: FOLDS as u64 * fold_steps + settings.steps,
        watch,
    };
    let fit = |fold: Option<usize>| -> Result<Option<Recurrence>, TrainError> {
        let is_kept = |s: &&Sequence| fold.is_none() || Some(s.fold % FOLDS) != fold;
        let fit = UnitFit {
            settings,
            steps: fold.map_or(settings.steps, |_| fold_steps),
            sequences: sequences.iter().filter(is_kept).collect(),
            seed: prior.seed,
            fps: prior.fps,
        };
        fit.run(&progress)
    };
    let folds: Result<Vec<_>, TrainError> = (0..FOLDS).into_par_iter().map(|f| fit(Some(f))).collect();
    let folds = folds?;
    let corrections = |s: &Sequence| match &folds[s.fold % FOLDS] {
        Some(recurrence) => s.corrections(recurrence),
        None => vec![0.0; s.targets.len()],
    };
    let left_out: Vec<Vec<f32>> = sequences.par_iter().map(corrections).collect();
    let share = believable_share(sequences, &left_out);
    if share < LEAST_SHARE {
        return Ok(None);
    }
    let scaled = |values: &[f32]| values.iter().map(|x| x * share as f32).collect();
    Ok(fit(None)?.map(|mut recurrence| {
        recurrence.head.weight = scaled(&recurrence.head.weight);
        recurrence.head.bias = scaled(&recurrence.head.bias);
        Fitted {
            recurrence,
            left_out: left_out.iter().map(|c| scaled(c)).collect(),
        }
    }))
}

/// The factor, at most 1, by which corrections come closest to the truth.
fn believable_share(sequences: &[Sequence], corrections: &[Vec<f32>]) -> f64 {
    let (mut along, mut squares) = (0.0, 0.0);
    for (sequence, correction) in sequences.iter().zip(corrections) {
        for (c, t) in correction.iter().zip(&sequence.targets) {
            along += f64::from(*c) * f64::from(*t);
            squares += f64::from(*c) * f64::from(*c);
        }
    }
    if squares > 0.0 {
        (along / squares).clamp(0.0, 1.0)
    } else {
        0.0
    }
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
}

impl UnitFit<'_> {
    /// None without anything to learn.
    fn run(&self, progress: &Progress) -> Result<Option<Recurrence>, TrainError> {
        let Some(windows) = Windows::new(&self.sequences, self.settings) else {
            return Ok(None);
        };
        let device = Device::flex().autodiff();
        let mut unit = Unit::new(windows.sizes(), self.fps, self.seed, &device);
        let mut moments = Moments::zeros(unit.values().iter().map(Vec::len));
        let mut average = unit.values();
        let optimiser = self.settings.optimiser(self.steps);
        for step in 0..self.steps {
            let mut rng = generator(self.seed, Stream::Recurrence, step);
            let loss = unit.loss(&windows.draw(&mut rng), &device);
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
