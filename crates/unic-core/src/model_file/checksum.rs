//! The checksum of a model file: CRC-32 of all of its bytes, in the file itself.
//!
//! Its digits count as zeros in the sum. They stand in the header, in front of everything that users name.

use super::{ModelFileError, metadata};
use serde_json::Value;

/// Treatment of a model file's checksum when the file is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrity {
    /// Files whose bytes have changed since they were written are refused; files without a checksum are read.
    #[default]
    Check,
    /// Nobody looks: for an engine whose packages have checksums of their own. A changed weight that is still a
    /// finite number is not noticed.
    Skip,
}

/// The digits before the sum is known, and in the bytes that are summed.
pub(super) const UNKNOWN: &str = "crc32:00000000";

/// CRC-32 of ISO 3309, as in zip and PNG: `zlib.crc32` in Python.
fn checksum(bytes: &[u8], digits: usize) -> String {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&bytes[..digits]);
    hasher.update(UNKNOWN.as_bytes());
    hasher.update(&bytes[digits + UNKNOWN.len()..]);
    format!("crc32:{:08x}", hasher.finalize())
}

/// Where a checksum stands in the header of a file.
fn place(bytes: &[u8], checksum: &str) -> Option<usize> {
    let length = u64::from_le_bytes(*bytes.first_chunk()?);
    let end = usize::try_from(length).ok()?.checked_add(8)?;
    let header = bytes.get(..end)?;
    header
        .windows(checksum.len())
        .position(|w| w == checksum.as_bytes())
}

/// Puts the checksum of a file in the place of [`UNKNOWN`].
pub(super) fn seal(mut bytes: Vec<u8>) -> Result<Vec<u8>, ModelFileError> {
    let digits = place(&bytes, UNKNOWN).ok_or(ModelFileError::NotUnic)?;
    let sum = checksum(&bytes, digits);
    bytes[digits..digits + sum.len()].copy_from_slice(sum.as_bytes());
    Ok(bytes)
}

/// Compares a file with the checksum that its metadata gives.
pub(super) fn check(bytes: &[u8], metadata: &Value) -> Result<Option<String>, ModelFileError> {
    let expected = match &metadata["checksum"] {
        Value::Null => return Ok(None),
        Value::String(text) if text.len() == UNKNOWN.len() && text.starts_with("crc32:") => text,
        other => return Err(ModelFileError::UnknownChecksum(other.to_string())),
    };
    let digits = place(bytes, expected).ok_or_else(|| ModelFileError::UnknownChecksum(expected.clone()))?;
    let found = checksum(bytes, digits);
    if found == *expected {
        return Ok(Some(found));
    }
    let expected = expected.clone();
    Err(ModelFileError::Damaged { expected, found })
}

/// Checks the bytes of a model file against its checksum, `crc32:` and eight hexadecimal digits, without reading the
/// model. `None` is a file that has no checksum.
///
/// # Errors
/// Bytes that are no model or one of another version, bytes that have changed since they were written, a checksum of
/// another kind.
pub fn verify_checksum(bytes: &[u8]) -> Result<Option<String>, ModelFileError> {
    check(bytes, &metadata(bytes)?)
}
