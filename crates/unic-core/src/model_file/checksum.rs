//! Checksum of a model file: CRC-32 of all of its bytes, stored in its header.
//!
//! The checksum's own digits count as zeros. They stand before every text that users choose.

use super::{ModelFileError, metadata};
use serde_json::Value;

/// Treatment of a model file's checksum when the file is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrity {
    /// Refuses files whose bytes have changed since they were written. Reads files without a
    /// checksum.
    #[default]
    Check,
    /// Ignores the checksum, for engines whose packages have their own. A damaged weight that is
    /// still a finite number stays undetected.
    Skip,
}

/// Text of a checksum that is not yet computed, which replaces it in the bytes that are summed.
pub(super) const UNKNOWN: &str = "crc32:00000000";

/// Computes the checksum of a file whose own checksum stands at offset `at`.
///
/// It is the CRC-32 of ISO 3309, as in zip and PNG: `zlib.crc32` in Python.
fn checksum(bytes: &[u8], at: usize) -> String {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&bytes[..at]);
    hasher.update(UNKNOWN.as_bytes());
    hasher.update(&bytes[at + UNKNOWN.len()..]);
    format!("crc32:{:08x}", hasher.finalize())
}

/// Finds the offset of a checksum in the header of a file.
fn find(bytes: &[u8], checksum: &str) -> Option<usize> {
    // A safetensors file begins with the length of its header, eight bytes, little-endian.
    let length = u64::from_le_bytes(*bytes.first_chunk()?);
    // The length of a damaged file may be any number.
    let end = usize::try_from(length).ok()?.checked_add(8)?;
    let header = bytes.get(..end)?;
    header
        .windows(checksum.len())
        .position(|w| w == checksum.as_bytes())
}

/// Replaces [`UNKNOWN`] by the checksum of the file.
pub(super) fn write_checksum(mut bytes: Vec<u8>) -> Result<Vec<u8>, ModelFileError> {
    let at = find(&bytes, UNKNOWN).ok_or(ModelFileError::NotUnic)?;
    let sum = checksum(&bytes, at);
    bytes[at..at + sum.len()].copy_from_slice(sum.as_bytes());
    Ok(bytes)
}

/// Compares a file with the checksum in its metadata and returns it, if there is one.
pub(super) fn check(bytes: &[u8], metadata: &Value) -> Result<Option<String>, ModelFileError> {
    let expected = match &metadata["checksum"] {
        Value::Null => return Ok(None),
        Value::String(text) if text.len() == UNKNOWN.len() && text.starts_with("crc32:") => text,
        other => return Err(ModelFileError::UnknownChecksum(other.to_string())),
    };
    let at = find(bytes, expected).ok_or_else(|| ModelFileError::UnknownChecksum(expected.clone()))?;
    let found = checksum(bytes, at);
    if found == *expected {
        return Ok(Some(found));
    }
    let expected = expected.clone();
    Err(ModelFileError::Damaged { expected, found })
}

/// Compares the bytes of a model file with its checksum, without reading the model.
///
/// Returns the checksum, `crc32:` and eight hexadecimal digits, or `None` for a file without one.
///
/// # Errors
/// Bytes that are not a model of this format version, bytes that have changed since they were
/// written, a checksum of another algorithm.
pub fn verify_checksum(bytes: &[u8]) -> Result<Option<String>, ModelFileError> {
    check(bytes, &metadata(bytes)?)
}
