//! The options `--precision` and `--precision-error`.

use super::{PrecisionName, parse};
use crate::output::print_status;
use clap::ValueEnum;
use std::sync::Once;
use unic_core::{Model, Precision};

/// Growth of a model's error that may be paid for speed, percent, unless a user says otherwise.
const ALLOWED_PERCENT: f32 = (100.0 * Model::ALLOWED_PRECISION_ERROR) as f32;

/// Precision of a model's networks.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct PrecisionArgs {
    /// Precision of the model's networks.
    #[arg(long, value_enum, default_value_t = PrecisionChoice::Auto)]
    precision: PrecisionChoice,
    /// Growth of the model's error that --precision auto may cost, percent of the error in f32, on
    /// the motion on which training has measured both.
    #[arg(long, value_name = "PERCENT", value_parser = parse::percent, default_value_t = ALLOWED_PERCENT)]
    precision_error: f32,
}

/// Precision by name, or the program's choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PrecisionChoice {
    /// Fastest one by the features of the processor, of those that keep within --precision-error.
    Auto,
    /// Single precision.
    F32,
    /// 8 significant bits: matrix units where the processor has them.
    Bf16,
    /// Whole numbers of 16 bits.
    Int16,
    /// Whole numbers of 8 bits.
    Int8,
}

impl PrecisionChoice {
    /// Precision that was asked for by name.
    fn named(self) -> Option<PrecisionName> {
        match self {
            Self::Auto => None,
            Self::F32 => Some(PrecisionName::F32),
            Self::Bf16 => Some(PrecisionName::Bf16),
            Self::Int16 => Some(PrecisionName::Int16),
            Self::Int8 => Some(PrecisionName::Int8),
        }
    }
}

impl PrecisionArgs {
    /// Gives a model the precision. Warns once about one that is slower and less exact than f32.
    pub(crate) fn apply(self, model: Model) -> Model {
        let Some(name) = self.precision.named() else {
            let precision = model.fastest_precision(f64::from(self.precision_error) / 100.0);
            return model.with_precision(precision);
        };
        static WARNING: Once = Once::new();
        WARNING.call_once(|| warn_if_slow(name, model.config().field.width));
        model.with_precision(name.into())
    }
}

/// Warns about a precision that is slower and less exact than f32 on this machine, for fields of so
/// many channels.
pub(crate) fn warn_if_slow(name: PrecisionName, width: usize) {
    if Precision::from(name).is_slower_than_f32(width) {
        let text = format!(
            "warning: {name} is slower than f32 on this processor for a field of {width} channels, and less exact"
        );
        print_status(&text);
    }
}

#[cfg(feature = "viewer")]
impl Default for PrecisionArgs {
    fn default() -> Self {
        Self {
            precision: PrecisionChoice::Auto,
            precision_error: ALLOWED_PERCENT,
        }
    }
}
