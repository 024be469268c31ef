//! Movies from successive pictures: a GIF, an MP4 or a folder of PNG frames.

mod error;
mod format;
mod frames;
#[cfg(feature = "mp4")]
mod mp4;
mod target;
#[cfg(feature = "mp4")]
mod yuv;

pub use error::MovieError;
pub use format::{EarlierFrames, MovieFormat};

use frames::FrameFolder;
use std::{
    ops::RangeInclusive,
    path::{Path, PathBuf},
};
use target::TargetFile;
use unic_io::atomic::CleanupGuard;
use unic_raster::{GifWriter, Image};

/// Frame rates that a movie may have, frames per second.
const RATES: RangeInclusive<f32> = 0.1..=1_000.0;

/// Writes a movie, one picture at a time, in constant memory.
///
/// The movie is written under a temporary name beside its path, which
/// [`finish`](MovieWriter::finish) replaces by its own. A writer that is dropped before that leaves
/// nothing. So does one whose [`push`](MovieWriter::push) has failed.
///
/// ```
/// use unic_raster::Image;
/// use unic_viewer::{MovieFormat, MovieWriter};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("dusk.gif");
/// let mut movie = MovieWriter::create(&path, MovieFormat::from_path(&path)?, 20.0, [64, 36])?;
/// for grey in (100..200).rev() {
///     movie.push(&Image::filled(64, 36, [grey; 3])?)?;
/// }
/// movie.finish()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct MovieWriter {
    path: PathBuf,
    size: [u32; 2],
    /// Number of pictures written.
    pictures: usize,
    sink: Sink,
    /// Removes the unfinished movie when the program is stopped.
    _cleanup: CleanupGuard,
}

/// Writer of one format.
enum Sink {
    // Boxed, since the writers differ in size.
    Gif(Box<GifWriter<TargetFile>>),
    #[cfg(feature = "mp4")]
    Mp4(Box<mp4::Mp4Writer>),
    Frames(FrameFolder),
}

impl MovieWriter {
    /// Starts a movie of `[width, height]` pixels with `fps` pictures per second.
    ///
    /// Missing folders are created. A movie file of that name is replaced at the end;
    /// [`EarlierFrames`] tells what happens to frames. A folder of frames stores no frame rate.
    ///
    /// # Errors
    /// - [`MovieError::FrameRate`] unless `fps` is within 0.1 to 1000.
    /// - [`MovieError::Raster`] or [`MovieError::Mp4`] for a size that the format does not have.
    /// - [`MovieError::WithoutMp4`] for an MP4 without the feature `mp4`.
    /// - [`MovieError::Kind`] for a movie file over a folder, or a folder over a file.
    /// - [`MovieError::FramesExist`] for a folder whose frames may not be replaced.
    /// - [`MovieError::Io`] if the file cannot be created.
    pub fn create(
        path: impl AsRef<Path>,
        format: MovieFormat,
        fps: f32,
        size: [u32; 2],
    ) -> Result<Self, MovieError> {
        let path = path.as_ref();
        if !RATES.contains(&fps) {
            return Err(MovieError::FrameRate {
                path: path.into(),
                expected: RATES,
                found: fps,
            });
        }
        let sink = match format {
            MovieFormat::Gif => {
                let writer = GifWriter::new(TargetFile::create(path)?, size, fps);
                Sink::Gif(Box::new(writer.map_err(MovieError::raster(path))?))
            }
            #[cfg(feature = "mp4")]
            MovieFormat::Mp4 => Sink::Mp4(Box::new(mp4::Mp4Writer::create(path, size, fps)?)),
            #[cfg(not(feature = "mp4"))]
            MovieFormat::Mp4 => return Err(MovieError::WithoutMp4 { path: path.into() }),
            MovieFormat::Frames(earlier) => Sink::Frames(FrameFolder::create(path, earlier)?),
        };
        let _cleanup = CleanupGuard::new(sink.temporary_path());
        Ok(Self {
            path: path.into(),
            size,
            pictures: 0,
            sink,
            _cleanup,
        })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// - [`MovieError::ImageSize`] for a picture of another size, which is not added.
    /// - [`MovieError::Raster`], [`MovieError::Mp4`] or [`MovieError::Io`] if it cannot be written.
    pub fn push(&mut self, image: &Image) -> Result<(), MovieError> {
        let found = [image.width(), image.height()];
        if found != self.size {
            return Err(MovieError::ImageSize {
                path: self.path.clone(),
                picture: self.pictures,
                expected: self.size,
                found,
            });
        }
        match &mut self.sink {
            Sink::Gif(writer) => writer.push(image).map_err(MovieError::raster(&self.path))?,
            #[cfg(feature = "mp4")]
            Sink::Mp4(writer) => writer.push(image)?,
            Sink::Frames(folder) => folder.push(self.pictures, image)?,
        }
        self.pictures += 1;
        Ok(())
    }

    /// Completes the movie and gives it its name.
    ///
    /// # Errors
    /// - [`MovieError::NoPictures`] for a movie without pictures.
    /// - [`MovieError::Raster`], [`MovieError::Mp4`] or [`MovieError::Io`] if it cannot be written.
    pub fn finish(self) -> Result<(), MovieError> {
        if self.pictures == 0 {
            return Err(MovieError::NoPictures { path: self.path });
        }
        match self.sink {
            Sink::Gif(writer) => {
                let file = writer.finish().map_err(MovieError::raster(&self.path))?;
                file.finish()
            }
            #[cfg(feature = "mp4")]
            Sink::Mp4(writer) => writer.finish(),
            Sink::Frames(folder) => folder.finish(),
        }
    }

    /// Number of pictures so far.
    pub fn pictures(&self) -> usize {
        self.pictures
    }

    /// File or folder that holds the movie until [`finish`](MovieWriter::finish).
    ///
    /// A program that exits without dropping the writer removes it.
    pub fn temporary_path(&self) -> &Path {
        self.sink.temporary_path()
    }
}

impl Sink {
    fn temporary_path(&self) -> &Path {
        match self {
            Self::Gif(writer) => writer.get_ref().temporary_path(),
            #[cfg(feature = "mp4")]
            Self::Mp4(writer) => writer.temporary_path(),
            Self::Frames(folder) => folder.temporary_path(),
        }
    }
}
