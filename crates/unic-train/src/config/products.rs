//! Number format of the factors in the field's matrix products.

use super::TrainConfig;
use serde::{Deserialize, Serialize};

/// Number format that the factors of the field's matrix products are rounded to. Sums, parameters
/// and their updates are f32 in either case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Products {
    /// f32: no rounding. Available on every processor and device.
    #[default]
    F32,
    /// bf16, on the CPU's matrix units (Intel AMX): about three times as fast. Refused on other
    /// machines.
    Bf16,
}

impl TrainConfig {
    /// Returns these settings with the product format of `other`. A resumed run may change the
    /// format, as it may change the device.
    pub fn with_products_of(&self, other: &Self) -> Self {
        let mut config = self.clone();
        config.optimiser.products = other.optimiser.products;
        config
    }
}
