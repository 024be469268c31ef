//! Errors of the kernels.

use thiserror::Error;

/// An invalid input of a kernel. A kernel that returns an error has written nothing.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum KernelError {
    /// A slice with the wrong number of elements.
    #[error("{what} holds {found} numbers, expected {expected}")]
    Length {
        /// Name of the slice.
        what: &'static str,
        /// Number of elements that the shape and the batch require.
        expected: usize,
        /// Number of elements of the slice.
        found: usize,
    },
    /// A size of the field's shape outside its range.
    #[error("field shape: {what} is {found}, expected {min} to {max}")]
    Size {
        /// Name of the size.
        what: &'static str,
        /// Smallest valid value.
        min: usize,
        /// Largest valid value.
        max: usize,
        /// Value of the shape.
        found: usize,
    },
    /// Saved activations of another field or of a batch of another size.
    #[error("saved activations belong to {found}, expected {expected}")]
    Saved {
        /// Field and batch of this call, in words.
        expected: String,
        /// Field and batch of the last forward pass, in words.
        found: String,
    },
    /// An instruction set that the processor does not have.
    #[error("this processor does not run {0:?}")]
    Instructions(crate::InstructionSet),
}

/// Returns an error when the length of a slice differs from `expected`.
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
