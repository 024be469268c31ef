//! Errors of devices, models and input.

use thiserror::Error;
use unic_core::AnimatorError;

/// Error of a computation on a device.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum GpuError {
    /// No adapter with compute shaders.
    #[error("GPU: expected an adapter that computes, found none: {0}")]
    NoAdapter(String),
    /// Adapter without a device, or a failure of the device.
    #[error("GPU: {0}")]
    Device(String),
    /// Feature that the device does not have.
    #[error("GPU: {what} needs the feature {feature}, which the device does not have")]
    Feature {
        /// Name of the part that needs the feature.
        what: &'static str,
        /// Name of the feature in wgpu.
        feature: &'static str,
    },
    /// Model that exceeds the limits of the device.
    #[error("GPU: expected at most {limit} for {what}, found {found}")]
    TooLarge {
        /// Name of the quantity.
        what: &'static str,
        /// Largest value on this device.
        limit: usize,
        /// Value of the model.
        found: usize,
    },
    /// Input that does not fit the model.
    #[error(transparent)]
    Input(#[from] AnimatorError),
}
