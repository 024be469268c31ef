//! Units of quantities.

use serde::Serialize;

/// Unit of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Unit {
    /// Metres.
    #[serde(rename = "m")]
    Metres,
    /// Metres a second.
    #[serde(rename = "m/s")]
    MetresPerSecond,
    /// Degrees.
    #[serde(rename = "°")]
    Degrees,
    /// Degrees a second.
    #[serde(rename = "°/s")]
    DegreesPerSecond,
}

impl Unit {
    /// Returns the excess over a range that is too small to report.
    pub(super) fn margin(self) -> f32 {
        match self {
            Unit::Metres => 0.03,
            Unit::MetresPerSecond => 0.15,
            Unit::Degrees => 7.0,
            Unit::DegreesPerSecond => 60.0,
        }
    }

    /// Returns the symbol of the unit.
    pub(super) fn symbol(self) -> &'static str {
        match self {
            Unit::Metres => "m",
            Unit::MetresPerSecond => "m/s",
            Unit::Degrees => "°",
            Unit::DegreesPerSecond => "°/s",
        }
    }

    /// Returns the number of digits after the point in texts.
    pub(super) fn digits(self) -> usize {
        match self {
            Unit::Metres | Unit::MetresPerSecond => 2,
            Unit::Degrees | Unit::DegreesPerSecond => 0,
        }
    }
}
