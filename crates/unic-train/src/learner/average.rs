//! Running mean of a network's parameters over the steps.

use crate::config::RegularisationConfig;

/// Kind of running mean of the parameters that a training keeps, and its decay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Averaging {
    /// No mean: the finished model takes the parameters of the last step.
    Off,
    /// Exponential mean with this decay per step.
    Decay(f64),
    /// Exponential mean with this decay per step. It is the plain mean of the steps so far while
    /// these are few, so that the random start is forgotten.
    WarmedUpDecay(f64),
}

impl Averaging {
    /// The mean that a field's settings ask for.
    pub(crate) fn of(settings: &RegularisationConfig) -> Self {
        match settings.average > 0.0 {
            true => Self::WarmedUpDecay(settings.average),
            false => Self::Off,
        }
    }
}

/// The running mean.
#[derive(Clone)]
pub(super) struct Average {
    averaging: Averaging,
    /// Mean of each parameter tensor.
    pub(super) values: Vec<Vec<f32>>,
}

impl Average {
    /// Starts at the first parameters. Returns none where no mean is kept.
    pub(super) fn new(averaging: Averaging, first: impl FnOnce() -> Vec<Vec<f32>>) -> Option<Self> {
        match averaging {
            Averaging::Off => None,
            _ => Some(Self {
                averaging,
                values: first(),
            }),
        }
    }

    /// Adds the parameters after a step, counted from 0.
    pub(super) fn add(&mut self, step: u64, parameters: Vec<Vec<f32>>) {
        let decay = match self.averaging {
            Averaging::Off => 0.0,
            Averaging::Decay(decay) => decay,
            // The decay rises from 0.1 at step 0 to its final value, so that early means forget the
            // random start.
            Averaging::WarmedUpDecay(decay) => decay.min((step as f64 + 1.0) / (step as f64 + 10.0)),
        };
        for (mean, now) in self.values.iter_mut().zip(parameters) {
            let pairs = mean.iter_mut().zip(now);
            pairs.for_each(|(mean, x)| *mean += (1.0 - decay as f32) * (x - *mean));
        }
    }
}
