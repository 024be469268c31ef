//! Errors of Alembic files.

use std::{borrow::Cow, io};
use thiserror::Error;

/// Result of reading or writing an archive.
pub type Result<T> = std::result::Result<T, Error>;

/// Failure to read or write an archive.
///
/// Each message is one sentence. Text that comes from a file is escaped and shortened.
#[derive(Debug, Error)]
pub enum Error {
    /// The operating system refused an operation.
    #[error("cannot {action}: {source}")]
    Io {
        /// The operation, a verb: "read", "create", ...
        action: &'static str,
        /// The system's reason.
        source: io::Error,
    },
    /// The bytes at an offset contradict the format.
    #[error("byte {offset}: expected {expected}, found {found}")]
    Damaged {
        /// Offset from the start of the file, bytes.
        offset: u64,
        /// The content that the format demands.
        expected: Cow<'static, str>,
        /// The content of the file.
        found: String,
    },
    /// An object or a property has other content than its schema demands.
    #[error("{place}: expected {expected}, found {found}")]
    Content {
        /// Full name of the object or of the property.
        place: String,
        /// The content that the reader accepts.
        expected: Cow<'static, str>,
        /// The content of the file.
        found: String,
    },
    /// An argument of the caller is outside its range.
    #[error("{argument}: expected {expected}, found {found}")]
    Argument {
        /// The argument.
        argument: &'static str,
        /// The accepted values.
        expected: Cow<'static, str>,
        /// The value.
        found: String,
    },
}

impl Error {
    /// Wraps an error of the system.
    pub(crate) fn io(action: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { action, source }
    }

    pub(crate) fn damaged(
        offset: u64,
        expected: impl Into<Cow<'static, str>>,
        found: impl Into<String>,
    ) -> Self {
        Self::Damaged {
            offset,
            expected: expected.into(),
            found: found.into(),
        }
    }

    pub(crate) fn content(
        place: &str,
        expected: impl Into<Cow<'static, str>>,
        found: impl Into<String>,
    ) -> Self {
        Self::Content {
            place: excerpt(place),
            expected: expected.into(),
            found: found.into(),
        }
    }

    pub(crate) fn argument(
        argument: &'static str,
        expected: impl Into<Cow<'static, str>>,
        found: impl ToString,
    ) -> Self {
        Self::Argument {
            argument,
            expected: expected.into(),
            found: found.to_string(),
        }
    }
}

/// Largest number of characters of a file's text in a message.
const EXCERPT_CHARACTERS: usize = 80;

/// Escapes and shortens text of a file, so that it cannot garble a terminal.
pub(crate) fn excerpt(text: &str) -> String {
    let mut shown: String = text
        .chars()
        .take(EXCERPT_CHARACTERS)
        .flat_map(char::escape_debug)
        .collect();
    if text.chars().nth(EXCERPT_CHARACTERS).is_some() {
        shown.push('…');
    }
    shown
}
