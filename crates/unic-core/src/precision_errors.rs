//! Error of a model in each precision, and the fastest precision that it allows.

use crate::{
    model::{About, Model},
    network::Precision,
};
use serde::{Deserialize, Serialize};

/// Root mean square error of a model in each precision, in free running, as measured at the end of
/// its training (key `precision` of `about.training`): on the first 10 s of a validation clip, which
/// a fit on all clips has seen. Intersections are not handled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PrecisionErrors {
    /// Error with [`Precision::F32`], millimetres.
    pub f32: f64,
    /// Error with [`Precision::Bf16`], millimetres. None, here and below, for one that is not finite.
    pub bf16: Option<f64>,
    /// Error with [`Precision::Int16`], millimetres.
    pub int16: Option<f64>,
    /// Error with [`Precision::Int8`], millimetres.
    pub int8: Option<f64>,
}

impl PrecisionErrors {
    /// Key of the errors in [`About::training`].
    pub const KEY: &str = "precision";

    /// Reads the errors that a model's file records. None where its training has measured none.
    pub fn of(about: &About) -> Option<Self> {
        serde_json::from_value(about.training[Self::KEY].clone()).ok()
    }

    /// Error with a precision, millimetres.
    pub fn mm(&self, precision: Precision) -> Option<f64> {
        match precision {
            Precision::F32 => Some(self.f32),
            Precision::Bf16 => self.bf16,
            Precision::Int16 => self.int16,
            Precision::Int8 => self.int8,
        }
    }

    /// Whether the error with a precision exceeds that of f32 by no more than a share `allowed` of
    /// it.
    pub fn allows(&self, precision: Precision, allowed: f64) -> bool {
        let most = (1.0 + allowed) * self.f32;
        precision == Precision::F32 || self.mm(precision).is_some_and(|error| error <= most)
    }
}

impl Model {
    /// Growth of the error that a precision may cost unless a program says otherwise, as a share.
    pub const ALLOWED_PRECISION_ERROR: f64 = 0.01;

    /// Returns the fastest precision of this machine whose error in free running, as the model's
    /// training has measured it, exceeds that of f32 by a share of at most `allowed`.
    ///
    /// The speed follows from the features of the processor ([`Precision::fastest_first`]) and never
    /// from timing, so that a machine gives the same bytes on every run. A model whose training has
    /// measured no errors has f32.
    pub fn fastest_precision(&self, allowed: f64) -> Precision {
        let Some(errors) = PrecisionErrors::of(self.about()) else {
            return Precision::F32;
        };
        let fastest = Precision::fastest_first(self.config().field.width);
        let found = fastest.into_iter().find(|&p| errors.allows(p, allowed));
        found.unwrap_or(Precision::F32)
    }
}
