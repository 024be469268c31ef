//! PC2 point caches, as Blender and 3ds Max read and write them.
//!
//! All numbers are little-endian.
//!
//! | offset | type | content |
//! |---|---|---|
//! | 0 | 12 bytes | `POINTCACHE2\0` |
//! | 12 | i32 | version, 1 |
//! | 16 | i32 | number of points |
//! | 20 | f32 | start frame |
//! | 24 | f32 | frames of the scene for each sample |
//! | 28 | i32 | number of samples |
//! | 32 | f32 | x, y, z of all points, sample after sample |

use crate::{
    atomic::AtomicFile,
    error::{Error, Result},
    frames::{VertexFrames, check_vertex_count},
};
use glam::Vec3;
use std::{
    fs::File,
    io::{Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

const MAGIC: &[u8; 12] = b"POINTCACHE2\0";
const HEADER_LENGTH: usize = 32;

/// A point cache; positions are in the unit and axes of the program that wrote it.
#[derive(Clone, Debug)]
pub struct Pc2 {
    /// Frame number of the first sample.
    pub start_frame: f32,
    /// Frames of the scene from one sample to the next; 1 if every frame has a sample.
    pub frames_per_sample: f32,
    /// One frame for each sample, mapped from the file.
    pub frames: VertexFrames,
}

/// Opens a point cache.
///
/// # Errors
/// No such file, no point cache, a size that contradicts the header.
pub fn read_pc2(path: &Path) -> Result<Pc2> {
    let header = Pc2Header::read(path)?;
    Ok(Pc2 {
        start_frame: header.start_frame,
        frames_per_sample: header.frames_per_sample,
        // The header is 32 bytes long, which aligns the floats behind it for mapping.
        frames: VertexFrames::map(path, HEADER_LENGTH, header.samples, header.points)?,
    })
}

struct Pc2Header {
    points: usize,
    start_frame: f32,
    frames_per_sample: f32,
    samples: usize,
}

impl Pc2Header {
    fn read(path: &Path) -> Result<Self> {
        let mut bytes = Vec::new();
        let file = File::open(path).map_err(Error::io(path, "open"))?;
        (file.take(HEADER_LENGTH as u64).read_to_end(&mut bytes)).map_err(Error::io(path, "read"))?;
        let Ok(bytes) = <[u8; HEADER_LENGTH]>::try_from(bytes) else {
            return Err(Error::content(path, "a PC2 point cache", "fewer than 32 bytes"));
        };
        if &bytes[..12] != MAGIC {
            let found = "a file that does not begin with POINTCACHE2";
            return Err(Error::content(path, "a PC2 point cache", found));
        }
        Self::parse(path, &bytes)
    }

    fn parse(path: &Path, bytes: &[u8; HEADER_LENGTH]) -> Result<Self> {
        let word = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        let int = |at: usize| i32::from_le_bytes(word(at));
        let float = |at: usize| f32::from_le_bytes(word(at));
        if int(12) != 1 {
            return Err(Error::content(
                path,
                "version 1 of PC2",
                format!("version {}", int(12)),
            ));
        }
        // Negative counts fail the conversion. Start frame and rate are shown only, so that any
        // number is accepted.
        match (usize::try_from(int(16)), usize::try_from(int(28))) {
            (Ok(points), Ok(samples)) if points > 0 => Ok(Self {
                points,
                start_frame: float(20),
                frames_per_sample: float(24),
                samples,
            }),
            _ => Err(Error::content(
                path,
                "at least one point and a count of samples",
                format!("{} points and {} samples", int(16), int(28)),
            )),
        }
    }
}

/// Writer of a point cache, one frame at a time. The file appears when it is complete.
#[derive(Debug)]
pub struct Pc2Writer {
    file: AtomicFile,
    path: PathBuf,
    points: usize,
    samples: i32,
}

/// Offset of the number of samples in the header, bytes. It is written last.
const SAMPLES_OFFSET: u64 = 28;

impl Pc2Writer {
    /// Starts a cache of `points` vertices. The first sample belongs to frame `start_frame`, and
    /// each further one is `frames_per_sample` frames of the scene later.
    ///
    /// # Errors
    /// More points than the format can count; the folder cannot be written to.
    pub fn create(path: &Path, points: usize, start_frame: f32, frames_per_sample: f32) -> Result<Self> {
        let Ok(count) = i32::try_from(points) else {
            let found = points.to_string();
            return Err(Error::content(path, "at most 2147483647 points", found));
        };
        let mut writer = Self {
            file: AtomicFile::create(path)?,
            path: path.to_path_buf(),
            points,
            samples: 0,
        };
        writer.write(MAGIC)?;
        writer.write(&1_i32.to_le_bytes())?;
        writer.write(&count.to_le_bytes())?;
        writer.write(&start_frame.to_le_bytes())?;
        writer.write(&frames_per_sample.to_le_bytes())?;
        // No samples until the number is known; `finish` writes it.
        writer.write(&0_i32.to_le_bytes())?;
        Ok(writer)
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// Another number of vertices; more frames than the format can count; the file cannot be
    /// written.
    pub fn push(&mut self, frame: &[Vec3]) -> Result<()> {
        check_vertex_count(&self.path, self.points, frame)?;
        let Some(samples) = self.samples.checked_add(1) else {
            return Err(Error::content(&self.path, "at most 2147483647 frames", "more"));
        };
        self.write(bytemuck::cast_slice(frame))?;
        self.samples = samples;
        Ok(())
    }

    /// Writes the number of samples and gives the file its final name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> Result<()> {
        (self.file.seek(SeekFrom::Start(SAMPLES_OFFSET))).map_err(Error::io(&self.path, "write"))?;
        let samples = self.samples;
        self.write(&samples.to_le_bytes())?;
        self.file.finish()
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.write_all(bytes).map_err(Error::io(&self.path, "write"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_cache_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pc2");
        let mut writer = Pc2Writer::create(&path, 2, 1.0, 1.0).unwrap();
        let frames = [[Vec3::X, Vec3::Y], [Vec3::Z, Vec3::splat(0.1)]];
        frames.iter().for_each(|f| writer.push(f).unwrap());
        writer.finish().unwrap();
        let cache = read_pc2(&path).unwrap();
        assert_eq!((cache.start_frame, cache.frames_per_sample), (1.0, 1.0));
        assert!(cache.frames.iter().eq(frames.iter().map(|f| f.as_slice())));
    }

    #[test]
    fn more_frames_than_the_header_can_count_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = Pc2Writer::create(&folder.path().join("a.pc2"), 1, 0.0, 1.0).unwrap();
        writer.samples = i32::MAX;
        assert!(writer.push(&[Vec3::X]).is_err());
    }

    #[test]
    fn headers_that_contradict_the_file_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pc2");
        Pc2Writer::create(&path, 3, 0.0, 1.0).unwrap().finish().unwrap();
        let good = std::fs::read(&path).unwrap();
        for (at, value) in [(12, 2), (16, 0), (16, -1), (28, -1), (28, i32::MAX)] {
            let mut bytes = good.clone();
            bytes[at..at + 4].copy_from_slice(&i32::to_le_bytes(value));
            std::fs::write(&path, bytes).unwrap();
            assert!(read_pc2(&path).is_err(), "{value} at {at}");
        }
    }
}
