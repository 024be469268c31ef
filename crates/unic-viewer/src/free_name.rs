//! Names of files that a window writes.

use std::path::PathBuf;

/// First of `PREFIX_0001.ENDING`, `PREFIX_0002.ENDING`, … that is no file of the current folder.
pub(crate) fn free_name(prefix: &str, ending: &str) -> PathBuf {
    let name = |i: u64| PathBuf::from(format!("{prefix}_{i:04}.{ending}"));
    let is_free = |path: &PathBuf| !path.exists();
    // No folder holds so many files.
    (1..).map(name).find(is_free).unwrap_or_else(|| name(0))
}
