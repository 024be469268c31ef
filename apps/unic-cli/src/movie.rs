//! Movies as outputs of commands.

use crate::outputs::{Existing, Outputs};
use anyhow::Result;
use std::path::Path;
use unic_io::atomic::CleanupGuard;
use unic_raster::Image;
use unic_viewer::{EarlierFrames, MovieFormat, MovieWriter};

/// Checks the path of a movie before a command begins to work.
///
/// # Errors
/// A name of another format, a movie that exists without `--overwrite`, a path that is an input.
pub(crate) fn check(outputs: Outputs, path: &Path, overwrite: bool) -> Result<()> {
    match format(path, overwrite)? {
        // The writer of frames checks the folder.
        MovieFormat::Frames(_) => outputs.folder(path, []).check(Existing::Resumed),
        MovieFormat::Gif | MovieFormat::Mp4 => outputs.file(path).check(Existing::of(overwrite)),
    }
}

fn format(path: &Path, overwrite: bool) -> Result<MovieFormat> {
    Ok(match (MovieFormat::from_path(path)?, overwrite) {
        (MovieFormat::Frames(_), true) => MovieFormat::Frames(EarlierFrames::Replace),
        (format, _) => format,
    })
}

/// Movie that leaves nothing when the program is stopped.
pub(crate) struct Movie {
    writer: MovieWriter,
    _cleanup: CleanupGuard,
}

impl Movie {
    /// Starts a movie of pictures of `size` (width, height) pixels at `fps` a second.
    ///
    /// # Errors
    /// A path that cannot be written, or that [`check`] refuses.
    pub(crate) fn create(path: &Path, overwrite: bool, fps: f32, size: [u32; 2]) -> Result<Self> {
        let writer = MovieWriter::create(path, format(path, overwrite)?, fps, size)?;
        let _cleanup = CleanupGuard::new(writer.temporary_path());
        Ok(Self { writer, _cleanup })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// A picture of another size, a file that cannot be written.
    pub(crate) fn push(&mut self, image: &Image) -> Result<()> {
        Ok(self.writer.push(image)?)
    }

    /// Completes the movie and gives it its name.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn finish(self) -> Result<()> {
        Ok(self.writer.finish()?)
    }
}
