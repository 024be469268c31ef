//! Measures of one band of wavelengths.

use crate::metrics::number;
use serde::{Deserialize, Serialize};

/// Wrinkles of one band of wavelengths. Names and order of the fields are a public JSON contract.
///
/// The signal of a vertex is its distance along the normal between two smoothings of the garment.
/// Sums run over vertices, weighted by their rest areas, and over about ten frames a second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BandMetrics {
    /// Shortest wavelength, cm.
    pub from_cm: u32,
    /// Longest wavelength, cm. `None` in the coarsest band.
    pub to_cm: Option<u32>,
    /// RMS signal, divided by the truth's. 1 wrinkles as much as the truth.
    #[serde(deserialize_with = "number")]
    pub amplitude_ratio: f64,
    /// Standard deviation over time of the signal of each vertex, divided by the truth's. 1 moves
    /// as much as the truth.
    #[serde(deserialize_with = "number")]
    pub living_ratio: f64,
    /// Correlation of the signal with the truth's, both minus their means over time. `None` where
    /// one is constant.
    pub correlation: Option<f64>,
    /// Correlation of the signal with itself one second later. `None` where no clip lasts two
    /// seconds, and where the signal is constant.
    pub autocorrelation_1s: Option<f64>,
    /// Correlation of the truth's signal with itself one second later, likewise.
    pub autocorrelation_1s_truth: Option<f64>,
}

impl BandMetrics {
    /// Returns the wavelengths as text, such as "3-6" or "> 24", in cm.
    pub fn name(&self) -> String {
        match (self.from_cm, self.to_cm) {
            (from, None) => format!("> {from}"),
            (0, Some(to)) => format!("< {to}"),
            (from, Some(to)) => format!("{from}-{to}"),
        }
    }
}
