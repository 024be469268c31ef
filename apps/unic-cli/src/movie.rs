//! Movies as outputs of commands.

use crate::{
    failure::Usage,
    outputs::{Existing, Outputs},
};
use anyhow::Result;
use std::path::Path;
use unic_viewer::{EarlierFrames, MovieError, MovieFormat, MovieWriter};

/// Checks the path of a movie before a command begins to work.
///
/// # Errors
/// A name of another format, a movie that exists without `--overwrite`, a path that is an input.
pub(crate) fn check(outputs: Outputs, path: &Path, existing: Existing) -> Result<()> {
    match format(path, existing)? {
        // The writer of frames checks the folder.
        MovieFormat::Frames(_) => outputs.folder(path, []).check(Existing::Resumed),
        MovieFormat::Gif | MovieFormat::Mp4 => outputs.file(path).check(existing),
    }
}

fn format(path: &Path, existing: Existing) -> Result<MovieFormat> {
    Ok(match (MovieFormat::from_path(path)?, existing) {
        (MovieFormat::Frames(_), Existing::Replaced) => MovieFormat::Frames(EarlierFrames::Replace),
        (format, _) => format,
    })
}

/// Starts a movie of pictures of `size` (width, height) pixels at `fps` a second.
///
/// # Errors
/// A path that cannot be written, frames that exist without `--overwrite`, a path that [`check`]
/// refuses.
pub(crate) fn create(path: &Path, existing: Existing, fps: f32, size: [u32; 2]) -> Result<MovieWriter> {
    MovieWriter::create(path, format(path, existing)?, fps, size).map_err(|error| match error {
        MovieError::FramesExist { .. } => Usage(format!("{error}; --overwrite replaces them")).into(),
        error => error.into(),
    })
}
