//! Fit of a regression on components, with its regularisation strength chosen on held-out clips.

use super::components::{Series, SeriesSet};
use crate::regression::{LinearMap, Moments};
use rayon::prelude::*;

/// Regularisation strengths to choose from, in units of an input's variance. They are dense in the
/// range that real captures need.
const STRENGTHS: [f64; 13] = [
    1e-6, 1e-4, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 1e4,
];
/// Units of the previous components to choose from, as multiples of the RMS of the first component.
// Ridge regression penalises all coefficients equally. A smaller unit makes the fed-back inputs
// larger, so that their coefficients may be small and cost less. With the unit 1 alone, strengths
// that suit the motion inputs suppress the feedback, and linear dynamics is hardly more than ridge.
const FEEDBACK_UNITS: [f64; 3] = [1.0, 0.1, 0.01];
/// Number of pieces of a single training clip, so that cross-validation can leave one out.
const PIECES: usize = 4;
/// Largest predicted component, as a multiple of its largest absolute value in training. The limit
/// keeps an unstable system finite.
const RANGE_FACTOR: f64 = 2.0;

/// Use of the previous output as an input of a regression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feedback {
    /// The inputs are the motion alone: ridge regression.
    None,
    /// The inputs are the motion and the previous components: linear dynamics.
    Previous,
}

/// Regression with its coefficients and limits.
#[derive(Clone, Debug)]
pub(super) struct FittedRegression {
    feedback: Feedback,
    map: LinearMap,
    /// Divisor of previous components when they are inputs, metres.
    unit: f64,
    /// Largest absolute value of each predicted component, metres.
    limits: Vec<f64>,
    /// Chosen regularisation strength.
    pub(super) strength: f64,
    /// Squared error on the held-out clips that chose the strength, m².
    error: f64,
}

/// Fold of a cross-validation: moments of the clips to fit, and the clips held out.
struct Fold<'a> {
    moments: Moments,
    held_out: Vec<&'a Series>,
}

impl FittedRegression {
    /// Fits on the training series. The strength has the least squared error in free running on the
    /// validation series or, without any, in cross-validation over the training series. Returns
    /// `None` without training pairs.
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
        // Without feedback the unit has no effect.
        let factors = match feedback {
            Feedback::None => &FEEDBACK_UNITS[..1],
            Feedback::Previous => &FEEDBACK_UNITS,
        };
        let fits = factors.iter().filter_map(|factor| {
            let setup = RegressionSetup {
                feedback,
                unit: unit * factor,
                limits: limits.clone(),
            };
            setup.best(train, &set.validation)
        });
        fits.min_by(|a, b| a.error.total_cmp(&b.error))
    }

    /// Returns the components of a frame from its inputs and the components of the frame before.
    pub(super) fn next(&self, inputs: &[f64], previous: &[f64]) -> Vec<f64> {
        let mut all = inputs.to_vec();
        push_feedback(self.feedback, self.unit, previous, &mut all);
        let mut next = self.map.apply(&all);
        for (z, limit) in next.iter_mut().zip(&self.limits) {
            // NaN stays NaN: a diverged prediction must show.
            *z = z.clamp(-limit, *limit);
        }
        next
    }

    /// Returns Σ ‖z − truth‖² over a free run from frame 0, m².
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

/// Parts of a regression that do not depend on its strength; see [`FittedRegression`].
struct RegressionSetup {
    feedback: Feedback,
    unit: f64,
    limits: Vec<f64>,
}

impl RegressionSetup {
    /// Sums the pairs of one series. Its frames t ≥ 1 are pairs of inputs and components.
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

    /// Fits with one strength. Returns `None` where the system is singular.
    fn solve(&self, moments: &Moments, strength: f64) -> Option<FittedRegression> {
        Some(FittedRegression {
            feedback: self.feedback,
            map: moments.solve(strength)?,
            unit: self.unit,
            limits: self.limits.clone(),
            strength,
            error: f64::INFINITY,
        })
    }

    /// Returns the fit whose strength has the least error on held-out clips, the weaker of equals.
    fn best(&self, train: &[Series], validation: &[Series]) -> Option<FittedRegression> {
        // Moments of each series once: folds and strengths are sums over them.
        let moments: Vec<Moments> = (train.par_iter())
            .filter(|s| !s.inputs.is_empty())
            .map(|s| self.moments(s))
            .collect();
        let folds = folds(train, validation, &moments);
        let error = |&strength: &f64| folds.iter().map(|fold| self.error(fold, strength)).sum();
        // Collected in the order of the strengths, so that threads do not decide between equals.
        let errors: Vec<f64> = STRENGTHS.par_iter().map(error).collect();
        let best = (0..errors.len()).min_by(|&a, &b| errors[a].total_cmp(&errors[b]))?;
        let mut fitted = self.solve(&Moments::pooled(moments.iter())?, STRENGTHS[best])?;
        fitted.error = errors[best];
        Some(fitted)
    }

    /// Returns the squared error of a fold with one strength, m².
    fn error(&self, fold: &Fold, strength: f64) -> f64 {
        // A singular system is never chosen.
        let Some(fitted) = self.solve(&fold.moments, strength) else {
            return f64::INFINITY;
        };
        fold.held_out.iter().map(|s| fitted.free_running_error(s)).sum()
    }
}

impl Series {
    /// Cuts the series into consecutive pieces, each with a motion of its own. A piece includes the
    /// frame before its first pair.
    fn cut(&self, pieces: usize) -> Vec<Series> {
        let pairs = self.inputs.len();
        let piece = |motion: usize| {
            let (from, to) = (motion * pairs / pieces, (motion + 1) * pairs / pieces);
            (from < to).then(|| Series {
                inputs: self.inputs[from..to].to_vec(),
                components: self.components[from..to + 1].to_vec(),
                motion,
            })
        };
        (0..pieces).filter_map(piece).collect()
    }
}

/// Returns one fold with the validation series held out or, without any, one fold for each training
/// series. Series of the same motion are never on both sides of a fold.
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

/// Appends the previous components to the inputs, where the regression reads them.
fn push_feedback(feedback: Feedback, unit: f64, previous: &[f64], inputs: &mut Vec<f64>) {
    if feedback == Feedback::Previous {
        inputs.extend(previous.iter().map(|z| z / unit));
    }
}

/// Returns the unit of fed-back components: the RMS of the first component, which varies most.
// One unit serves all components. Scaling each by its own RMS would penalise small components as if
// they were as large a displacement as the first.
fn unit<'a>(components: impl Iterator<Item = &'a Vec<f64>>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for z in components.filter_map(|z| z.first()) {
        sum += z * z;
        count += 1.0;
    }
    // Components are divided by the unit, which may not be 0 where nothing varies.
    f64::sqrt(sum / f64::max(count, 1.0)).max(f64::MIN_POSITIVE)
}

/// Returns the largest absolute value of each component, times [`RANGE_FACTOR`].
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
