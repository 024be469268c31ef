//! Settings that are chosen by name.

use crate::error::{Error, Result};

/// Finds the value of a name.
///
/// # Errors
/// A name that is none of them.
pub(crate) fn choose<T: Copy>(what: &str, name: &str, values: &[(&str, T)]) -> Result<T> {
    if let Some((_, value)) = values.iter().find(|(known, _)| *known == name) {
        return Ok(*value);
    }
    let known: Vec<String> = values.iter().map(|(name, _)| format!("'{name}'")).collect();
    Err(Error::value(
        what,
        format!("one of {}", known.join(", ")),
        format!("'{name}'"),
    ))
}
