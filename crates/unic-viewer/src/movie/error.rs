use std::{
    io,
    ops::RangeInclusive,
    path::{Path, PathBuf},
};
use unic_raster::RasterError;

/// Reason why a movie cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MovieError {
    /// The path has an extension that is no movie's.
    #[error(
        "{path}: expected a movie (.gif, .mp4) or a folder of frames (no extension, or a / at the end), \
         found .{found}"
    )]
    Extension {
        /// Path of the movie.
        path: PathBuf,
        /// Extension without its dot.
        found: String,
    },
    /// The program is built without the feature `mp4`.
    #[error(
        "{path}: .mp4 needs a build with the feature `mp4`; write a folder of frames, and run \
         `ffmpeg -framerate FPS -i FOLDER/frame_%05d.png -pix_fmt yuv420p {path}`"
    )]
    WithoutMp4 {
        /// Path of the movie.
        path: PathBuf,
    },
    /// The frame rate is out of range.
    #[error(
        "{path}: expected {} to {} frames per second, found {found}",
        expected.start(),
        expected.end()
    )]
    FrameRate {
        /// Path of the movie.
        path: PathBuf,
        /// Rates that a movie may have, frames per second.
        expected: RangeInclusive<f32>,
        /// Rate asked for, frames per second.
        found: f32,
    },
    /// A file is where the folder goes, or a folder where the file goes.
    #[error("{path}: expected a {expected}, found a {found}")]
    Kind {
        /// Path of the movie.
        path: PathBuf,
        /// Kind that the movie is.
        expected: &'static str,
        /// Kind of what is there.
        found: &'static str,
    },
    /// The folder holds frames that may not be replaced.
    #[error("{path}: expected a folder without frames, found {found}")]
    FramesExist {
        /// Path of the folder.
        path: PathBuf,
        /// Name of one of the frames.
        found: String,
    },
    /// A picture has another size than the movie.
    #[error(
        "{path}: expected pictures of {} x {} pixels, found {} x {} in picture {picture}",
        expected[0], expected[1], found[0], found[1]
    )]
    ImageSize {
        /// Path of the movie.
        path: PathBuf,
        /// Number of pictures before it.
        picture: usize,
        /// Width and height of the movie, pixels.
        expected: [u32; 2],
        /// Width and height of the picture, pixels.
        found: [u32; 2],
    },
    /// The movie has no pictures.
    #[error("{path}: expected at least one picture, found none")]
    NoPictures {
        /// Path of the movie.
        path: PathBuf,
    },
    /// A GIF or a PNG cannot be encoded.
    #[error("{path}: {source}")]
    Raster {
        /// Path of the movie.
        path: PathBuf,
        /// Error of the encoder.
        source: RasterError,
    },
    /// An MP4 cannot be encoded.
    #[error("{path}: cannot encode the movie: {reason}")]
    Mp4 {
        /// Path of the movie.
        path: PathBuf,
        /// Message of the encoder.
        reason: String,
    },
    /// A file cannot be written.
    #[error("{path}: cannot {action}: {source}")]
    Io {
        /// Path of the movie or of one of its folders.
        path: PathBuf,
        /// Verb for what was tried.
        action: &'static str,
        /// Error of the operating system.
        source: io::Error,
    },
}

impl MovieError {
    pub(super) fn io(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io {
            path: path.into(),
            action,
            source,
        }
    }

    pub(super) fn raster(path: &Path) -> impl FnOnce(RasterError) -> Self {
        move |source| Self::Raster {
            path: path.into(),
            source,
        }
    }

    #[cfg(feature = "mp4")]
    pub(super) fn mp4<E: ToString>(path: &Path) -> impl Fn(E) -> Self {
        move |error| Self::Mp4 {
            path: path.into(),
            reason: error.to_string(),
        }
    }
}
