//! Saved states as bytes: the same ones from every interface.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `unicstat` |
//! | 4 | version of this form, little-endian as all numbers |
//! | 4 | CRC-32 of the model's file |
//! | 4 | CRC-32 of what follows |
//! | rest | [`AnimatorState`] in the form of postcard |

use super::AnimatorState;
use thiserror::Error;

const MAGIC: [u8; 8] = *b"unicstat";
const VERSION: u32 = 3;
const HEADER: usize = 20;

/// Error: bytes that are not a saved state of the model.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("saved state: expected {expected}, found {found}")]
pub struct SavedStateError {
    /// Bytes that the reader accepts, in words.
    pub expected: String,
    /// Difference of the given bytes, in words.
    pub found: String,
}

impl SavedStateError {
    fn new(expected: &str, found: impl Into<String>) -> Self {
        Self {
            expected: expected.to_owned(),
            found: found.into(),
        }
    }
}

impl AnimatorState {
    /// Writes the state to `saved`, whose memory is used again. `model` is the CRC-32 of the model's
    /// file.
    ///
    /// # Errors
    /// A state that cannot be written; none is known.
    pub fn save(&self, model: u32, saved: &mut Vec<u8>) -> Result<(), SavedStateError> {
        let mut bytes = std::mem::take(saved);
        bytes.clear();
        bytes.extend_from_slice(&MAGIC);
        for number in [VERSION, model, 0] {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        let mut bytes = postcard::to_extend(self, bytes)
            .map_err(|e| SavedStateError::new("one that can be written", e.to_string()))?;
        let (header, content) = bytes.split_at_mut(HEADER);
        header[16..].copy_from_slice(&crc32fast::hash(content).to_le_bytes());
        *saved = bytes;
        Ok(())
    }

    /// Reads a state that [`save`](Self::save) has written for the same model.
    ///
    /// # Errors
    /// Bytes that are no state, are damaged, or are of another model.
    pub fn from_saved(saved: &[u8], model: u32) -> Result<Self, SavedStateError> {
        let error = |expected, found: &str| Err(SavedStateError::new(expected, found));
        let Some((header, content)) = saved.split_at_checked(HEADER) else {
            return error("at least 20 bytes", &saved.len().to_string());
        };
        let number = |at: usize| {
            let bytes = header.get(at..at + 4).and_then(|b| b.try_into().ok());
            u32::from_le_bytes(bytes.unwrap_or_default())
        };
        if !header.starts_with(&MAGIC) {
            return error("bytes that begin with `unicstat`", "others");
        }
        if number(8) != VERSION {
            return error(&format!("version {VERSION}"), &number(8).to_string());
        }
        if number(12) != model {
            return error("a state of this model", "one of another");
        }
        if number(16) != crc32fast::hash(content) {
            return error("undamaged bytes", "another checksum");
        }
        match postcard::take_from_bytes(content) {
            Ok((state, [])) => Ok(state),
            Ok((_, rest)) => error("no bytes after the state", &rest.len().to_string()),
            Err(e) => error("a complete state", &e.to_string()),
        }
    }
}
