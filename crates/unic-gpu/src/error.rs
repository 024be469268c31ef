//! What a device, a model or a caller cannot do.

use thiserror::Error;
use unic_core::animator::AnimatorError;

/// Why there is no answer from the device.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum GpuError {
    /// No driver that could compute.
    #[error("GPU: expected an adapter that computes, found none: {0}")]
    NoAdapter(String),
    /// An adapter that gives no device, or a device that does not do as it is asked.
    #[error("GPU: {0}")]
    Device(String),
    /// A device without a feature.
    #[error("GPU: {what} needs the feature {feature}, which the device does not have")]
    Feature {
        /// What needs it.
        what: &'static str,
        /// wgpu's name of it.
        feature: &'static str,
    },
    /// A model beyond what the device's limits allow.
    #[error("GPU: {what} may be at most {most} here, found {found}")]
    TooLarge {
        /// What is counted.
        what: &'static str,
        /// The most that this device can do.
        most: usize,
        /// In this model.
        found: usize,
    },
    /// Input that does not belong to the model.
    #[error(transparent)]
    Input(#[from] AnimatorError),
}
