//! MDD point caches, as LightWave, Blender and Maya read and write them.
//!
//! All numbers are big-endian.
//!
//! | offset | type | content |
//! |---|---|---|
//! | 0 | i32 | number of frames T |
//! | 4 | i32 | number of points V |
//! | 8 | T f32 | time of each frame, seconds |
//! | 8 + 4 T | T V 3 f32 | x, y, z of all points, frame after frame |

use crate::{
    atomic::AtomicFile,
    cache::FrameSpool,
    error::{Error, Result},
    foreign_formats::{PartlyReadFormat, partly_read},
    frame_rate::{check_frame_rate, whole_rate},
    frames::VertexFrames,
};
use glam::Vec3;
use std::{
    io::Write,
    path::{Path, PathBuf},
};

/// Length of the two counts, bytes.
const COUNTS_LENGTH: usize = 8;
/// Largest difference between the times of uniform frames and their mean rate, in frames. Times are
/// f32, which hold a long animation to a thousandth of a frame.
const UNIFORM: f64 = 0.1;

/// A point cache; positions are in the unit and axes of the program that wrote it.
#[derive(Clone, Debug)]
pub struct Mdd {
    /// Time of each frame, seconds.
    pub times: Vec<f32>,
    /// Positions of all points in every frame.
    pub frames: VertexFrames,
}

impl Mdd {
    /// Frames per second, if the times are at equal distances. A rate within 0.02 % of a whole
    /// number is rounded to it.
    pub fn fps(&self) -> Option<f32> {
        let [first, .., last] = *self.times.as_slice() else {
            return None;
        };
        let steps = self.times.len() - 1;
        let mean = (f64::from(last) - f64::from(first)) / steps as f64;
        let off = |(i, time): (usize, &f32)| (f64::from(*time) - f64::from(first)) / mean - i as f64;
        let is_uniform = self
            .times
            .iter()
            .enumerate()
            .all(|time| off(time).abs() < UNIFORM);
        let fps = whole_rate(1.0 / mean);
        (is_uniform && check_frame_rate(fps).is_ok()).then_some(fps as f32)
    }
}

/// Returns whether a file is an MDD cache, by its extension: the format has no signature.
pub(crate) fn is_mdd(path: &Path) -> bool {
    partly_read(path) == Some(PartlyReadFormat::Mdd)
}

/// Reads a point cache.
///
/// # Errors
/// No such file, a size that contradicts the counts.
pub fn read_mdd(path: &Path) -> Result<Mdd> {
    let bytes = std::fs::read(path).map_err(Error::io(path, "open"))?;
    let mut words = bytes.chunks_exact(4).map(|word| {
        // Four bytes each, by `chunks_exact`.
        let mut big_endian = [0; 4];
        big_endian.copy_from_slice(word);
        big_endian
    });
    let mut count = || words.next().map(i32::from_be_bytes);
    let (Some(frames), Some(points)) = (count(), count()) else {
        return Err(Error::content(path, "an MDD point cache", "fewer than 8 bytes"));
    };
    let size = |frames: usize, points: usize| {
        let floats = points.checked_mul(3)?.checked_add(1)?.checked_mul(frames)?;
        floats.checked_mul(4)?.checked_add(COUNTS_LENGTH)
    };
    let counts = match (usize::try_from(frames), usize::try_from(points)) {
        (Ok(frames), Ok(points)) if points > 0 => Some((frames, points)),
        _ => None,
    };
    let counts = counts.filter(|&(frames, points)| size(frames, points) == Some(bytes.len()));
    let Some((len, points)) = counts else {
        let expected = format!("an MDD point cache of {frames} frames of {points} points");
        return Err(Error::content(path, expected, format!("{} bytes", bytes.len())));
    };
    let mut floats = words.map(f32::from_be_bytes);
    let times: Vec<f32> = floats.by_ref().take(len).collect();
    let frames = VertexFrames::new(floats.collect(), len, points);
    // The size is checked above, so that the positions fill the frames.
    let frames = frames.ok_or_else(|| Error::content(path, "positions of all frames", "others"))?;
    Ok(Mdd { times, frames })
}

/// Writer of a point cache, one frame at a time. The file appears when it is complete.
///
/// Frames are collected in an unnamed temporary file of the same folder: the times of all frames
/// come before the first position.
#[derive(Debug)]
pub struct MddWriter {
    path: PathBuf,
    frames: FrameSpool,
    fps: f32,
}

impl MddWriter {
    /// Starts a cache of `points` vertices. Frame t is at t / `fps` seconds.
    ///
    /// # Errors
    /// More points than the format can count; the folder cannot be written to.
    pub fn create(path: &Path, points: usize, fps: f32) -> Result<Self> {
        count(path, "points", points)?;
        Ok(Self {
            path: path.to_path_buf(),
            frames: FrameSpool::create(path, points)?,
            fps,
        })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// Another number of vertices; a full disk.
    pub fn push(&mut self, frame: &[Vec3]) -> Result<()> {
        self.frames.push(frame)
    }

    /// Writes the file and gives it its final name.
    ///
    /// # Errors
    /// More frames than the format can count; the file cannot be written.
    pub fn finish(self) -> Result<()> {
        let points = count(&self.path, "points", self.frames.vertex_count())?;
        let mut frames = self.frames.finish()?;
        let len = count(&self.path, "frames", frames.len())?;
        let mut file = AtomicFile::create(&self.path)?;
        let failed = |e| Error::io(&self.path, "write")(e);
        let mut write = |word: [u8; 4]| file.write_all(&word).map_err(failed);
        write(len.to_be_bytes())?;
        write(points.to_be_bytes())?;
        for t in 0..len {
            // Divided in f64, so that late frames are no further off than f32 demands.
            write(((f64::from(t) / f64::from(self.fps)) as f32).to_be_bytes())?;
        }
        frames.for_each(|_, frame| {
            let floats = frame.iter().flat_map(|position| position.to_array());
            floats.map(f32::to_be_bytes).try_for_each(&mut write)
        })?;
        file.finish()
    }
}

/// Returns a count as the format stores it.
fn count(path: &Path, noun: &str, count: usize) -> Result<i32> {
    i32::try_from(count)
        .map_err(|_| Error::content(path, format!("at most 2147483647 {noun}"), count.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(times: &[f32], points: i32, values: &[f32]) -> Vec<u8> {
        let counts = [times.len() as i32, points].map(i32::to_be_bytes);
        let floats = times.iter().chain(values).map(|x| x.to_be_bytes());
        counts.into_iter().chain(floats).flatten().collect()
    }

    #[test]
    fn big_endian_frames_and_times_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mdd");
        let values: Vec<f32> = (0..12).map(|i| i as f32 * 0.5).collect();
        std::fs::write(&path, bytes(&[1.0 / 24.0, 2.0 / 24.0], 2, &values)).unwrap();
        let cache = read_mdd(&path).unwrap();
        assert_eq!(cache.fps(), Some(24.0));
        assert_eq!((cache.frames.len(), cache.frames.vertex_count()), (2, 2));
        assert_eq!(cache.frames.frame(1)[0], Vec3::new(3.0, 3.5, 4.0));
        let read = crate::read_vertex_cache(&path).unwrap();
        assert_eq!((read.fps, read.frames.len()), (Some(24.0), 2));
    }

    #[test]
    fn times_without_a_rate_give_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mdd");
        for times in [
            &[0.0, 0.1, 0.5][..],
            &[0.0],
            &[0.0, 0.0],
            &[0.0, f32::NAN],
            &[1.0, 0.5],
        ] {
            std::fs::write(&path, bytes(times, 1, &vec![0.0; 3 * times.len()])).unwrap();
            assert_eq!(read_mdd(&path).unwrap().fps(), None, "{times:?}");
        }
    }

    #[test]
    fn a_written_cache_has_big_endian_words_and_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mdd");
        let frames = [[Vec3::X, Vec3::splat(0.1)], [Vec3::Y, Vec3::NEG_Z]];
        let mut writer = MddWriter::create(&path, 2, 24.0).unwrap();
        frames.iter().for_each(|frame| writer.push(frame).unwrap());
        assert!(writer.push(&[Vec3::X]).is_err());
        assert!(!path.exists());
        writer.finish().unwrap();
        let values: Vec<f32> = frames.iter().flatten().flat_map(|p| p.to_array()).collect();
        assert_eq!(
            std::fs::read(&path).unwrap(),
            bytes(&[0.0, 1.0 / 24.0], 2, &values)
        );
        let cache = read_mdd(&path).unwrap();
        assert_eq!(cache.fps(), Some(24.0));
        assert!(cache.frames.iter().eq(frames.iter().map(|f| f.as_slice())));
    }

    #[test]
    fn counts_that_contradict_the_file_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mdd");
        let good = bytes(&[0.0, 0.1], 1, &[0.0; 6]);
        for (at, value) in [(0, 3), (0, -1), (0, i32::MAX), (4, 0), (4, -1), (4, i32::MAX)] {
            let mut bytes = good.clone();
            bytes[at..at + 4].copy_from_slice(&i32::to_be_bytes(value));
            std::fs::write(&path, bytes).unwrap();
            assert!(read_mdd(&path).is_err(), "{value} at {at}");
        }
        for length in 0..good.len() {
            std::fs::write(&path, &good[..length]).unwrap();
            assert!(read_mdd(&path).is_err(), "{length} bytes");
        }
    }
}
