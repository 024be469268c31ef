//! Fitting a regression on the components, and choosing its strength on clips left out.

use super::components::{Series, SeriesSet};
use crate::regression::{LinearMap, Moments};
use rayon::prelude::*;

/// Strengths to choose from: powers of ten and the halves between them, in units of an input's
/// variance.
const STRENGTH_EXPONENTS: std::ops::RangeInclusive<i32> = -12..=8;
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
        let scale = Scale {
            feedback,
            unit: unit(all()),
            limits: limits(all()),
        };
        let moments: Vec<Moments> = (train.par_iter())
            .filter(|s| !s.inputs.is_empty())
            .map(|s| scale.moments(s))
            .collect();
        let folds = folds(train, &set.validation, &moments);
        let strength = scale.best_strength(&folds);
        scale.solve(&Moments::pooled(moments.iter())?, strength)
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
        })
    }

    /// The weakest of the best: errors that are equal go to the smaller strength.
    fn best_strength(&self, folds: &[Fold]) -> f64 {
        let strengths = STRENGTH_EXPONENTS.map(|half| 10f64.powf(f64::from(half) / 2.0));
        let error = |strength: f64| -> f64 {
            let of_fold = |fold: &Fold| match self.solve(&fold.moments, strength) {
                Some(fitted) => fold.held_out.iter().map(|s| fitted.free_running_error(s)).sum(),
                None => f64::INFINITY,
            };
            folds.iter().map(of_fold).sum()
        };
        let strengths: Vec<f64> = strengths.collect();
        let errors: Vec<f64> = strengths.par_iter().map(|&s| error(s)).collect();
        let best = (0..errors.len()).min_by(|&a, &b| errors[a].total_cmp(&errors[b]));
        best.map_or(1.0, |i| strengths[i])
    }
}

impl Series {
    /// Consecutive pieces; each begins with the frame that its first pair starts from.
    fn cut(&self, pieces: usize) -> Vec<Series> {
        let pairs = self.inputs.len();
        let bounds = (0..pieces).map(|k| (k * pairs / pieces, (k + 1) * pairs / pieces));
        let piece = |(from, to): (usize, usize)| Series {
            inputs: self.inputs[from..to].to_vec(),
            components: self.components[from..to + 1].to_vec(),
        };
        bounds.filter(|(from, to)| from < to).map(piece).collect()
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
    let used = train.iter().filter(|s| !s.inputs.is_empty());
    let without = |(out, held_out): (usize, &'a Series)| {
        let others = moments.iter().enumerate().filter(|(i, _)| *i != out);
        Some(Fold {
            moments: Moments::pooled(others.map(|(_, m)| m))?,
            held_out: vec![held_out],
        })
    };
    used.enumerate().filter_map(without).collect()
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
