//! Alembic files of several animated meshes, read and written by crate `ogawa`.
//!
//! Written files have positions in world space, metres, +Y up. Frame 0 is at 0 seconds. Faces and
//! texture coordinates are the same in all frames, and programs compute the normals. Files that are
//! read keep their unit and axes, which the format does not state.

mod read;
mod write;

pub use read::{AlembicAnimation, AlembicReader};
pub use write::AlembicWriter;

use crate::error::Error;
use std::path::Path;

/// Adds the path of the file to an error of crate `ogawa`.
fn with_path(path: &Path) -> impl FnOnce(ogawa::Error) -> Error {
    move |error| match error {
        ogawa::Error::Io { action, source } => Error::io(path, action)(source),
        ogawa::Error::Argument {
            argument,
            expected,
            found,
        } => Error::content(path, format!("{argument}: {expected}"), found),
        ogawa::Error::Damaged { expected, found, .. } | ogawa::Error::Content { expected, found, .. } => {
            Error::content(path, expected, found)
        }
    }
}
