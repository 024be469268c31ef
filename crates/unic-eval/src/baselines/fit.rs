//! Fitting a regression on the components, and choosing its strength on clips left out.

use super::components::{Series, SeriesSet};
use crate::regression::{LinearMap, Moments};
use rayon::prelude::*;

/// Strengths to choose from, in units of an input's variance: dense where real captures lie.
const STRENGTHS: [f64; 13] = [
    1e-6, 1e-4, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 1e4,
];
/// Units of the previous components to choose from, in RMS of the first: in a smaller unit memory is
/// cheap where the motion's inputs are not. With the first alone, linear dynamics is ridge again.
const FEEDBACK_UNITS: [f64; 3] = [1.0, 0.1, 0.01];
/// Pieces that a lone training clip is cut into, to have something to leave out.
const PIECES: usize = 4;
/// Components may leave the range seen in training by this factor, no further: an unstable system
/// then stays finite.
const RANGE_FACTOR: f64 = 2.0;

/// Does the regression read its own previous output?
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feedback {
    /// Ridge: from the motion alone.
    None,
    /// Linear dynamics.
    Previous,
}

/// A fitted regression.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    feedback: Feedback,
    map: LinearMap,
    /// What previous components are divided by, metres.
    unit: f64,
    /// Largest absolute value of each component, metres.
    limits: Vec<f64>,
    /// The strength chosen.
    pub(super) strength: f64,
    /// Squared error on the clips that it was chosen by, m².
    error: f64,
}

/// Clips to fit and clips to judge by.
struct Fold<'a> {
    moments: Moments,
    held_out: Vec<&'a Series>,
}

impl Fitted {
    /// Fits on the training series with the strength that has the least squared error, free
    /// running, on the validation series, or on training series left out one at a time where there
    /// are none. `None` without training pairs.
    pub(super) fn new(set: &SeriesSet, feedback: Feedback) -> Option<Self> {
        let pieces;
        let train = match set.train.as_slice() {
            [only] if set.validation.is_empty() => {
                pieces = only.cut(PIECES);
                pieces.as_slice()
            }
            all => all,
        };
        let all = || train.iter().flat_map(|s| &s.components);
        let (unit, limits) = (unit(all()), limits(all()));
        let factors = match feedback {
            Feedback::None => &FEEDBACK_UNITS[..1],
            Feedback::Previous => &FEEDBACK_UNITS,
        };
        let fits = factors.iter().filter_map(|factor| {
            let scale = Scale {
                feedback,
                unit: unit * factor,
                limits: limits.clone(),
            };
            scale.best(train, &set.validation)
        });
        fits.min_by(|a, b| a.error.total_cmp(&b.error))
    }

    /// The components of a frame from its inputs and the components before it.
    pub(super) fn next(&self, inputs: &[f64], previous: &[f64]) -> Vec<f64> {
        let mut all = inputs.to_vec();
        push_feedback(self.feedback, self.unit, previous, &mut all);
        let mut next = self.map.apply(&all);
        for (z, limit) in next.iter_mut().zip(&self.limits) {
            *z = z.clamp(-limit, *limit);
        }
        next
    }

    /// Σ ‖z − truth‖² of a free run from frame 0, m².
    fn free_running_error(&self, series: &Series) -> f64 {
        let Some((first, truth)) = series.components.split_first() else {
            return 0.0;
        };
        let (mut z, mut error) = (first.clone(), 0.0);
        for (inputs, truth) in series.inputs.iter().zip(truth) {
            z = self.next(inputs, &z);
            error += z.iter().zip(truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        }
        error
    }
}

/// What all strengths share.
struct Scale {
    feedback: Feedback,
    unit: f64,
    limits: Vec<f64>,
}

impl Scale {
    fn moments(&self, series: &Series) -> Moments {
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        let pairs = series.components.iter().zip(&series.components[1..]);
        for (x, (previous, z)) in series.inputs.iter().zip(pairs) {
            inputs.extend_from_slice(x);
            push_feedback(self.feedback, self.unit, previous, &mut inputs);
            outputs.extend_from_slice(z);
        }
        Moments::new(&inputs, &outputs, series.inputs.len())
    }

    fn solve(&self, moments: &Moments, strength: f64) -> Option<Fitted> {
        Some(Fitted {
            feedback: self.feedback,
            map: moments.solve(strength)?,
            unit: self.unit,
            limits: self.limits.clone(),
            strength,
            error: f64::INFINITY,
        })
    }

    /// The fit with the strength that serves the clips held out best; of equals the weakest.
    fn best(&self, train: &[Series], validation: &[Series]) -> Option<Fitted> {
        let moments: Vec<Moments> = (train.par_iter())
            .filter(|s| !s.inputs.is_empty())
            .map(|s| self.moments(s))
            .collect();
        let folds = folds(train, validation, &moments);
        let error = |&strength: &f64| folds.iter().map(|fold| self.error(fold, strength)).sum();
        let errors: Vec<f64> = STRENGTHS.par_iter().map(error).collect();
        let best = (0..errors.len()).min_by(|&a, &b| errors[a].total_cmp(&errors[b]))?;
        let mut fitted = self.solve(&Moments::pooled(moments.iter())?, STRENGTHS[best])?;
        fitted.error = errors[best];
        Some(fitted)
    }

    fn error(&self, fold: &Fold, strength: f64) -> f64 {
        let Some(fitted) = self.solve(&fold.moments, strength) else {
            return f64::INFINITY;
        };
        fold.held_out.iter().map(|s| fitted.free_running_error(s)).sum()
    }
}

impl Series {
    /// Consecutive pieces; each begins with the frame that its first pair starts from.
    fn cut(&self, pieces: usize) -> Vec<Series> {
        let pairs = self.inputs.len();
        let bounds = (0..pieces).map(|k| (k, k * pairs / pieces, (k + 1) * pairs / pieces));
        let piece = |(motion, from, to): (usize, usize, usize)| Series {
            inputs: self.inputs[from..to].to_vec(),
            components: self.components[from..to + 1].to_vec(),
            motion,
        };
        bounds.filter(|(_, from, to)| from < to).map(piece).collect()
    }
}

fn folds<'a>(train: &'a [Series], validation: &'a [Series], moments: &[Moments]) -> Vec<Fold<'a>> {
    if !validation.is_empty() {
        let fold = Moments::pooled(moments.iter()).map(|moments| Fold {
            moments,
            held_out: validation.iter().collect(),
        });
        return fold.into_iter().collect();
    }
    let used = || train.iter().filter(|s| !s.inputs.is_empty());
    let without = |held_out: &'a Series| {
        let others = used().zip(moments).filter(|(s, _)| s.motion != held_out.motion);
        Some(Fold {
            moments: Moments::pooled(others.map(|(_, m)| m))?,
            held_out: vec![held_out],
        })
    };
    used().filter_map(without).collect()
}

fn push_feedback(feedback: Feedback, unit: f64, previous: &[f64], inputs: &mut Vec<f64>) {
    if feedback == Feedback::Previous {
        inputs.extend(previous.iter().map(|z| z / unit));
    }
}

/// One unit for all components, so that the strength presses on displacements and not on the small
/// components more than on the large: the RMS of the first, which varies most.
fn unit<'a>(components: impl Iterator<Item = &'a Vec<f64>>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for z in components.filter_map(|z| z.first()) {
        sum += z * z;
        count += 1.0;
    }
    f64::sqrt(sum / f64::max(count, 1.0)).max(f64::MIN_POSITIVE)
}

fn limits<'a>(components: impl Iterator<Item = &'a Vec<f64>>) -> Vec<f64> {
    let mut limits = Vec::new();
    for z in components {
        limits.resize(z.len(), 0.0);
        for (limit, z) in limits.iter_mut().zip(z) {
            *limit = f64::max(*limit, z.abs() * RANGE_FACTOR);
        }
    }
    limits
}
