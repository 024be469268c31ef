//! What can be wrong with a file.

use std::{io, path::Path, path::PathBuf};
use thiserror::Error;
use unic_core::{mesh::MeshError, shown::shortened, skeleton::SkeletonError, skinning::WeightsError};

/// Result of reading or writing a file.
pub type Result<T> = std::result::Result<T, Error>;

/// One sentence each: the file, what was expected, what was found; what a file says is escaped and cut.
#[derive(Debug, Error)]
pub enum Error {
    /// The operating system refused.
    #[error("{path}: cannot {action}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// A verb: "read", "create", ...
        action: &'static str,
        /// Why.
        source: io::Error,
    },
    /// The content is not what its format or its place demands.
    #[error("{path}: expected {}, found {}", shortened(expected), shortened(found))]
    Content {
        /// The file.
        path: PathBuf,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// One array of an npz or npy file has the wrong shape, type or values.
    #[error(
        "{path}: array `{}`: expected {}, found {}",
        shortened(array),
        shortened(expected),
        shortened(found)
    )]
    Array {
        /// The file.
        path: PathBuf,
        /// Name of the array.
        array: String,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A skeleton that is no tree.
    #[error("{path}: {source}")]
    Skeleton {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: SkeletonError,
    },
    /// Skinning weights that cannot be used.
    #[error("{path}: {source}")]
    Weights {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: WeightsError,
    },
    /// A mesh that cannot be used.
    #[error("{path}: {source}")]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: MeshError,
    },
}

impl Error {
    /// The same failure of the file that the user knows: what passes through temporary files fails in
    /// one that is gone by the time that its name is read.
    #[must_use]
    pub fn of(self, path: &Path) -> Self {
        match self {
            Error::Io { action, source, .. } => Error::Io {
                path: path.to_path_buf(),
                action,
                source,
            },
            other => other,
        }
    }

    /// A closure for `map_err` on I/O results.
    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> Error {
        let path = path.to_path_buf();
        move |source| Error::Io { path, action, source }
    }

    pub(crate) fn content(path: &Path, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Error::Content {
            path: path.to_path_buf(),
            expected: expected.into(),
            found: found.into(),
        }
    }
}
