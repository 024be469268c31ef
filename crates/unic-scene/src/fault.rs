//! Reasons why a file is not read.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Failure to read a scene, without the name of the file.
///
/// Texts may hold words of the file: whoever prints them escapes and shortens them.
#[derive(Clone, Debug, PartialEq, Eq, Error, Serialize, Deserialize)]
#[error("expected {expected}, found {found}")]
pub struct Fault {
    /// Content that the reader accepts.
    pub expected: String,
    /// Content of the file.
    pub found: String,
}

impl Fault {
    /// Makes a fault.
    pub fn new(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self {
            expected: expected.into(),
            found: found.into(),
        }
    }
}
