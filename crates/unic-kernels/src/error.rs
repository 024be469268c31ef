//! What a kernel refuses.

use thiserror::Error;

/// Why a kernel refused its input. Nothing has been written when one is returned.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum KernelError {
    /// A slice has the wrong number of elements.
    #[error("{what} holds {found} numbers, expected {expected}")]
    Length {
        /// Name of the slice.
        what: &'static str,
        /// Elements that the shape and the batch ask for.
        expected: usize,
        /// Elements given.
        found: usize,
    },
    /// A size of the field's shape lies outside its range.
    #[error("field shape: {what} is {found}, expected {min} to {max}")]
    Size {
        /// Name of the size.
        what: &'static str,
        /// Smallest value accepted.
        min: usize,
        /// Largest value accepted.
        max: usize,
        /// Value given.
        found: usize,
    },
    /// Backward was given activations of another field or another batch.
    #[error("saved activations belong to {found}, expected {expected}")]
    Saved {
        /// The batch of this call, in words.
        expected: String,
        /// The batch of the last forward, in words.
        found: String,
    },
    /// The processor lacks the instruction set asked for.
    #[error("this processor does not run {0:?}")]
    Instructions(crate::InstructionSet),
}

/// Refuses a slice whose length differs from `expected`.
pub(crate) fn expect_length(what: &'static str, expected: usize, found: usize) -> Result<(), KernelError> {
    if expected == found {
        return Ok(());
    }
    Err(KernelError::Length {
        what,
        expected,
        found,
    })
}
