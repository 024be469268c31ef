//! Trains what remembers the motion: the recurrence of a prior.
//!
//! The linear map of a prior is fitted in closed form. A [`Recurrence`] learns the same K coefficients
//! beside it, where a frame costs nothing but the small network, and the two are blended by the share
//! that does best on motions which neither has seen. The recurrence learns the coefficients and not what
//! the linear map leaves of them: what a map leaves of a motion that it has not seen is mostly that
//! motion's own, and says nothing of the next.

mod learner;
mod scan;
mod sequence;
mod swing;
mod unit;
mod windows;

pub(crate) use sequence::{Sequence, mirrored_surface};

use crate::{config::RecurrenceSettings, error::TrainError, event::Control, prior::PriorSettings};
use learner::UnitFit;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use swing::Swings;
use unic_core::recurrence::Recurrence;

/// Asked after every step, from several threads: steps done and steps in all. Once stop, always stop.
pub type Watch<'a> = dyn Fn(u64, u64) -> Control + Sync + 'a;

/// A recurrence that is worth having.
pub(crate) struct Fitted {
    /// Trained on all sequences; what it says is its share of the blend.
    pub(crate) recurrence: Recurrence,
    /// What is left to the linear map, 0 to 1.
    pub(crate) linear_share: f32,
    /// The blend in each sequence, T × K, by what has not seen the sequence's motion. Its swings are not enlarged: a
    /// field would learn to calm them.
    pub(crate) left_out: Vec<Vec<f32>>,
    /// By part of the motions, one that has not seen it, as large as its share; its swings are not enlarged either.
    folds: Vec<Option<Recurrence>>,
}

impl Fitted {
    /// What has not seen a motion; none where there was nothing else to learn from.
    pub(crate) fn without(&self, motion_number: usize) -> Option<&Recurrence> {
        self.folds[fold_of(motion_number, self.folds.len())].as_ref()
    }
}

/// Parts that the motions are split into at most, to leave out one at a time. Two would judge a small capture by half
/// of what it teaches.
pub const MOST_FOLDS: usize = 5;

/// The part that a motion belongs to.
fn fold_of(motion_number: usize, folds: usize) -> usize {
    motion_number % folds
}

/// Less of what the linear map leaves of the coefficients' squares than this is noise.
const LEAST_GAIN: f64 = 0.02;

/// Trains on `sequences`; none if it is of no use beside the linear map on motions left out.
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
    let others = |fold: usize| {
        sequences
            .iter()
            .filter(|s| fold_of(s.motion_number, count) != fold)
            .collect()
    };
    let folds = (0..count)
        .into_par_iter()
        .map(|fold| fit(fold_steps, others(fold)));
    let folds = folds.collect::<Result<Vec<_>, TrainError>>()?;
    let said = |s: &Sequence| match &folds[fold_of(s.motion_number, count)] {
        Some(recurrence) => s.said_by(recurrence),
        None => s.linear.clone(),
    };
    let Some(blend) = Blend::of(sequences, sequences.par_iter().map(said).collect()) else {
        return Ok(None);
    };
    let swings = Swings {
        wanted: settings.swing,
        share: blend.share,
        fps: prior.fps,
    };
    let lively = swings.livelier(sequences, &blend.left_out);
    let recurrence = fit(steps, lively.iter().collect())?;
    Ok(recurrence.map(|recurrence| blend.fitted(recurrence, folds)))
}

/// The linear map and recurrences, each on motions that it has not seen.
struct Blend {
    /// Of the recurrence, above 0.
    share: f32,
    /// T × K of each sequence.
    left_out: Vec<Vec<f32>>,
}

impl Blend {
    /// None if the recurrences are of no use.
    fn of(sequences: &[Sequence], recurrent: Vec<Vec<f32>>) -> Option<Self> {
        let worth = Worth::of(sequences, &recurrent);
        let share = worth.share as f32;
        let mut left_out = recurrent;
        for (s, left_out) in sequences.iter().zip(&mut left_out) {
            let pairs = left_out.iter_mut().zip(&s.linear);
            pairs.for_each(|(x, linear)| *x = linear + share * (*x - linear));
        }
        worth.is_believable().then_some(Self { share, left_out })
    }

    fn fitted(self, recurrence: Recurrence, folds: Vec<Option<Recurrence>>) -> Fitted {
        let shared = |mut recurrence: Recurrence| {
            recurrence.head.scale(self.share);
            recurrence
        };
        Fitted {
            recurrence: shared(recurrence),
            folds: folds.into_iter().map(|fold| fold.map(shared)).collect(),
            linear_share: 1.0 - self.share,
            left_out: self.left_out,
        }
    }
}

/// What a recurrence is worth on motions left out.
#[derive(Clone, Copy, Debug)]
struct Worth {
    /// Its share in the blend that errs least, 0 to 1, every motion counted by what the linear map leaves of it.
    share: f64,
    /// Part of the squares left by the linear map that the blend takes away, on average over motions.
    gain: f64,
    /// Standard error of that average.
    gain_error: f64,
}

impl Worth {
    fn of(sequences: &[Sequence], recurrent: &[Vec<f32>]) -> Self {
        let clips = by_motion(sequences, recurrent);
        let sum = |of: fn(&MotionFit) -> f64| clips.iter().map(of).sum::<f64>();
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

/// Of a motion: c from the linear map to the recurrence, t from the linear map to the truth.
struct MotionFit {
    /// ⟨c, t⟩ / |t|².
    along: f64,
    /// |c|² / |t|².
    squares: f64,
}

fn by_motion(sequences: &[Sequence], recurrent: &[Vec<f32>]) -> Vec<MotionFit> {
    let mut sums = vec![[0.0f64; 3]; motions(sequences)];
    for (sequence, recurrent) in sequences.iter().zip(recurrent) {
        let [along, squares, size] = &mut sums[sequence.motion_number];
        let pairs = recurrent.iter().zip(&sequence.coefficients);
        for ((x, truth), linear) in pairs.zip(&sequence.linear) {
            let (c, t) = (f64::from(x - linear), f64::from(truth - linear));
            *along += c * t;
            *squares += c * c;
            *size += t * t;
        }
    }
    let sized = sums.into_iter().filter(|[_, _, size]| *size > 0.0);
    sized
        .map(|[along, squares, size]| MotionFit {
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
