//! Description of a fit in its checkpoints.

use crate::{config::TrainConfig, fit::Fit};
use serde::{Deserialize, Serialize};

/// Description of a fit in its checkpoints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldRecord {
    /// Fit of the run.
    pub fit: Fit,
    /// Settings of the run.
    pub config: TrainConfig,
    /// Seconds that the prior's training took.
    pub prior_seconds: f64,
    /// Smallest free-running error on the validation clips so far, in metres.
    pub best_rmse: Option<f64>,
}

impl FieldRecord {
    /// Compares with the fit and settings of a run that is to continue from this checkpoint. The
    /// run may compute in another product format, and it may be longer: see
    /// [`TrainConfig::is_lengthened_by`].
    ///
    /// # Errors
    /// The difference, in a few words.
    pub(super) fn check(&self, fit: Fit, config: &TrainConfig) -> Result<(), &'static str> {
        if self.fit != fit {
            return Err("one of another fit");
        }
        let begun = self.config.with_products_of(config);
        match begun == *config || begun.is_lengthened_by(config) {
            true => Ok(()),
            false => Err("one of other settings"),
        }
    }
}
