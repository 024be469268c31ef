//! What the field is computed in.

use super::TrainConfig;
use crate::{error::TrainError, processor::Processor};
use serde::{Deserialize, Serialize};
use unic_kernels::InstructionSet;

/// What the factors of the field's products are rounded to; sums, parameters and their updates are f32.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Products {
    /// Nothing: f32, on every processor and device.
    #[default]
    F32,
    /// bf16, on the CPU's matrix units (Intel AMX), about three times as fast; refused where there are none.
    Bf16,
}

impl TrainConfig {
    /// These settings with the products of others: what a run is computed in may change where it goes on, as the
    /// device may.
    pub fn with_products_of(&self, other: &Self) -> Self {
        let mut config = self.clone();
        config.optimiser.products = other.optimiser.products;
        config
    }
}

impl Products {
    /// Can this machine compute them on a processor?
    ///
    /// # Errors
    /// [`TrainError::Products`] where it cannot.
    pub(crate) fn check(self, processor: Processor) -> Result<(), TrainError> {
        match self {
            Self::Bf16 if processor != Processor::Cpu || !InstructionSet::Amx.is_available() => {
                Err(TrainError::Products { processor })
            }
            _ => Ok(()),
        }
    }
}
