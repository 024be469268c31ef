//! Candidates of a sizing and the rungs that they climb.

use super::Tried;
use crate::config::{SizingSettings, TrainConfig};
use serde::{Deserialize, Serialize};
use unic_core::config::FieldConfig;

/// Size of a field and the number of its training steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Candidate {
    /// Width of the hidden layers.
    pub width: usize,
    /// Number of hidden layers.
    pub hidden_layers: usize,
    /// Optimiser steps.
    pub steps: u64,
}

/// Factor between the steps of two rungs.
const GROWTH: u64 = 3;

/// Fewest steps of a rung, unless the last rung has fewer.
pub(crate) const LEAST_STEPS: u64 = 100;

/// Steps of each rung, ascending. The last one has `most`.
pub fn rungs(most: u64) -> Vec<u64> {
    let mut rungs = vec![most.max(1)];
    while rungs[0] / GROWTH >= LEAST_STEPS {
        rungs.insert(0, rungs[0] / GROWTH);
    }
    rungs
}

/// Candidates of the first rung, in the order of the settings. Their steps are those of no rung.
pub(super) fn candidates(settings: &SizingSettings) -> Vec<Candidate> {
    let of = |&[width, hidden_layers]: &[usize; 2]| Candidate {
        width,
        hidden_layers,
        steps: 0,
    };
    settings.sizes.iter().map(of).collect()
}

/// The better half of a rung's candidates, rounded up, the best one first.
pub(super) fn better_half(rung: &[Tried]) -> Vec<Candidate> {
    let mut order: Vec<&Tried> = rung.iter().collect();
    // A stable sort: of equal candidates the earlier one, which the settings prefer.
    order.sort_by(|a, b| b.gain.mean.total_cmp(&a.gain.mean));
    order.truncate(rung.len().div_ceil(2));
    order.into_iter().map(|tried| tried.candidate).collect()
}

impl Candidate {
    /// The settings of a run, with this size and number of steps.
    pub(super) fn config(self, settings: &TrainConfig) -> TrainConfig {
        let mut config = settings.clone();
        config.model.field = self.field();
        config.set_steps(self.steps);
        config
    }

    /// The field's sizes in a model.
    pub(crate) fn field(self) -> FieldConfig {
        FieldConfig {
            width: self.width,
            hidden_layers: self.hidden_layers,
            skip: None,
        }
    }

    /// Name of the candidate in files.
    pub(super) fn name(self) -> String {
        format!("{}x{}_{}_steps", self.width, self.hidden_layers, self.steps)
    }
}
