//! Duration of a run's training.

use std::ops::Add;

/// Training time: of the prior, of steps and of validations. Loading clips and measuring the pace
/// for a budget are no part of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrainingTime {
    /// All of it, seconds.
    pub seconds: f64,
    /// The part of it that the prior's fit took, seconds.
    pub prior_seconds: f64,
}

impl Add for TrainingTime {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            seconds: self.seconds + other.seconds,
            prior_seconds: self.prior_seconds + other.prior_seconds,
        }
    }
}
