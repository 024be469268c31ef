//! Errors of files.

use std::{io, path::Path, path::PathBuf};
use thiserror::Error;
use unic_core::{
    mesh::MeshError, motion_matching::DatabaseFileError, printable::printable_excerpt,
    skeleton::SkeletonError, skinning::WeightsError,
};

/// Result of reading or writing a file.
pub type Result<T> = std::result::Result<T, Error>;

/// Failure to read or write a file.
///
/// Each message is one sentence: the file, what was expected, what was found. Text that comes from
/// a file is escaped and shortened, so that a damaged file cannot garble a terminal.
#[derive(Debug, Error)]
pub enum Error {
    /// The operating system refused an operation.
    // The path comes first in all messages, as in those of compilers.
    #[error("{path}: cannot {action}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The operation, a verb: "read", "create", ...
        action: &'static str,
        /// The system's reason.
        source: io::Error,
    },
    /// The content does not have the form that its format or its place demands.
    #[error(
        "{path}: expected {}, found {}",
        printable_excerpt(expected),
        printable_excerpt(found)
    )]
    Content {
        /// The file.
        path: PathBuf,
        /// The content that the reader accepts.
        expected: String,
        /// The content of the file.
        found: String,
    },
    /// One array of an npz or npy file has the wrong shape, type or values.
    #[error(
        "{path}: array `{}`: expected {}, found {}",
        printable_excerpt(array),
        printable_excerpt(expected),
        printable_excerpt(found)
    )]
    Array {
        /// The file.
        path: PathBuf,
        /// Name of the array.
        array: String,
        /// The shape, type or values that the reader accepts.
        expected: String,
        /// The shape, type or values of the array.
        found: String,
    },
    /// The joints of a skeleton do not form a tree.
    #[error("{path}: {source}")]
    Skeleton {
        /// The file.
        path: PathBuf,
        /// The fault of the skeleton.
        source: SkeletonError,
    },
    /// Skinning weights have faults.
    #[error("{path}: {source}")]
    Weights {
        /// The file.
        path: PathBuf,
        /// The fault of the weights.
        source: WeightsError,
    },
    /// Bytes are no motion database.
    #[error("{path}: {source}")]
    MotionDatabase {
        /// The file.
        path: PathBuf,
        /// The fault of the bytes.
        source: DatabaseFileError,
    },
    /// A mesh has faults.
    #[error("{path}: {source}")]
    Mesh {
        /// The file.
        path: PathBuf,
        /// The fault of the mesh.
        source: MeshError,
    },
}

impl Error {
    /// Replaces the path of an I/O error by `path`; other errors stay as they are.
    ///
    /// Writers that pass through temporary files use it: a user knows the final name, and the
    /// temporary file is gone when the message is read.
    #[must_use]
    pub fn with_path(self, path: &Path) -> Self {
        match self {
            Error::Io { action, source, .. } => Error::Io {
                path: path.to_path_buf(),
                action,
                source,
            },
            // Errors about content name the file that was read, which is no temporary one.
            other => other,
        }
    }

    /// Returns a closure for `map_err` on I/O results; `action` is a verb.
    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> Error {
        let path = path.to_path_buf();
        move |source| Error::Io { path, action, source }
    }

    /// Returns an [`Error::Content`].
    pub(crate) fn content(path: &Path, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Error::Content {
            path: path.to_path_buf(),
            expected: expected.into(),
            found: found.into(),
        }
    }
}
