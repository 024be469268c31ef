//! Names of the meshes of a file, of which a user chooses one.

use crate::error::{Error, Result};
use std::path::Path;

/// Number of names that an error lists.
const LISTED: usize = 12;

/// Finds the mesh of a name: its full name, such as `/rig/coat/coatShape`, its own or that of its
/// parent.
///
/// # Errors
/// No such mesh, several.
pub(crate) fn named(path: &Path, names: &[String], name: &str) -> Result<usize> {
    if let Some(mesh) = names.iter().position(|full| full == name) {
        return Ok(mesh);
    }
    let is_called = |full: &String| full.rsplit('/').take(2).any(|part| part == name);
    let found: Vec<usize> = (0..names.len()).filter(|mesh| is_called(&names[*mesh])).collect();
    match found.as_slice() {
        [mesh] => Ok(*mesh),
        _ => {
            let expected = format!("one mesh of the name {name} among {}", listed(names));
            Err(Error::content(path, expected, found.len().to_string()))
        }
    }
}

/// Names for a sentence.
pub(crate) fn listed(names: &[String]) -> String {
    match names.split_at_checked(LISTED) {
        Some((first, more)) if !more.is_empty() => {
            format!("{} and {} more", first.join(", "), more.len())
        }
        _ => names.join(", "),
    }
}
