//! Vertex positions over time: in memory or mapped from a file.

use crate::{
    atomic::AtomicFile,
    error::{Error, Result},
    npy::{self, Dim, DtypeKind, Header},
};
use glam::Vec3;
use memmap2::Mmap;
use std::{
    fmt,
    fs::File,
    io::{Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

/// Positions of V vertices in each of T frames, in metres, world space.
///
/// Clones share the data. Mapped frames take no memory of their own: the operating system loads
/// pages when they are read, so that a clip may be larger than the memory.
#[derive(Clone)]
pub struct VertexFrames {
    storage: Arc<Storage>,
    len: usize,
    vertex_count: usize,
}

/// Frames of a garment: one position for each vertex of the rest shape.
pub type GarmentFrames = VertexFrames;

enum Storage {
    Owned(Vec<f32>),
    /// A mapped file whose floats begin at byte `offset`, a multiple of four.
    Mapped {
        map: Mmap,
        offset: usize,
    },
}

/// Place of one position among [`VertexFrames`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameVertex {
    /// Index of the frame.
    pub frame: usize,
    /// Index of the vertex.
    pub vertex: usize,
}

impl VertexFrames {
    /// Makes `len` frames from numbers x, y, z of all vertices, frame after frame.
    ///
    /// Returns `None` unless there are `len` × `vertex_count` × 3 numbers and at least one vertex.
    pub fn new(data: Vec<f32>, len: usize, vertex_count: usize) -> Option<Self> {
        let expected = len.checked_mul(vertex_count)?.checked_mul(3)?;
        (vertex_count > 0 && data.len() == expected).then(|| Self {
            storage: Arc::new(Storage::Owned(data)),
            len,
            vertex_count,
        })
    }

    /// Opens a `.npy` file of shape (T, V, 3). Little-endian f32 in C order are mapped; all other
    /// types and orders are read and converted.
    ///
    /// # Errors
    /// No such file, another shape, a size that contradicts the header.
    pub fn open_npy(path: &Path) -> Result<Self> {
        let header = npy::read_npy_header(path)?;
        let &[len, vertex_count, 3] = header.shape.as_slice() else {
            let found = format!("shape {}", npy::shape_text(&header.shape));
            return Err(Error::content(path, "an array of shape (T, V, 3)", found));
        };
        if vertex_count == 0 {
            return Err(Error::content(path, "at least one vertex a frame", "none"));
        }
        if is_mappable(&header) {
            return Self::map(path, header.length, len, vertex_count);
        }
        // Exact dimensions: the file may have been replaced since its header was read.
        let dims = [Dim::Is(len), Dim::Is(vertex_count), Dim::Is(3)];
        let data = npy::read_npy::<f32>(path, &dims)?.data;
        Ok(Self {
            storage: Arc::new(Storage::Owned(data)),
            len,
            vertex_count,
        })
    }

    /// Maps a file of little-endian f32 that begin at byte `offset`, a multiple of four.
    ///
    /// # Errors
    /// The file cannot be mapped, or has another size than `len` frames need.
    pub(crate) fn map(path: &Path, offset: usize, len: usize, vertex_count: usize) -> Result<Self> {
        let file = File::open(path).map_err(Error::io(path, "open"))?;
        // SAFETY: the mapping is read-only. Files of this crate are replaced by renaming, which
        // leaves the mapped one as it is; a program that cuts or overwrites the file in place
        // while it is mapped breaks the promise, as with every mapped file.
        let map = unsafe { Mmap::map(&file) }.map_err(Error::io(path, "map"))?;
        let expected = (len.checked_mul(vertex_count))
            .and_then(|n| n.checked_mul(12))
            .and_then(|n| n.checked_add(offset));
        let aligned = offset.is_multiple_of(4);
        if expected != Some(map.len()) || !aligned {
            let expected = format!("{len} frames of {vertex_count} vertices from byte {offset} on");
            return Err(Error::content(path, expected, format!("{} bytes", map.len())));
        }
        Ok(Self {
            storage: Arc::new(Storage::Mapped { map, offset }),
            len,
            vertex_count,
        })
    }

    /// Number of frames T.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns whether there are no frames.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Number of vertices V.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Returns whether the frames are mapped from a file.
    pub fn is_mapped(&self) -> bool {
        matches!(*self.storage, Storage::Mapped { .. })
    }

    /// One frame.
    ///
    /// # Panics
    /// When `t` is not below [`VertexFrames::len`].
    pub fn frame(&self, t: usize) -> &[Vec3] {
        assert!(t < self.len, "frame {t} of {}", self.len);
        // `Vec3` is three f32 without padding, so that the cast costs nothing.
        let floats = 3 * self.vertex_count;
        bytemuck::cast_slice(&self.numbers()[t * floats..(t + 1) * floats])
    }

    /// All frames in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[Vec3]> {
        (0..self.len).map(|t| self.frame(t))
    }

    /// Returns the place of the first position that is NaN or infinite.
    pub fn first_non_finite(&self) -> Option<FrameVertex> {
        self.iter().enumerate().find_map(|(frame, positions)| {
            let vertex = positions.iter().position(|v| !v.is_finite())?;
            Some(FrameVertex { frame, vertex })
        })
    }

    /// Numbers x, y, z of all vertices, frame after frame.
    pub fn numbers(&self) -> &[f32] {
        match &*self.storage {
            Storage::Owned(data) => data,
            // The cast cannot fail: maps begin at a page and `offset` is a multiple of four.
            Storage::Mapped { map, offset } => bytemuck::cast_slice(&map[*offset..]),
        }
    }
}

impl fmt::Debug for VertexFrames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.is_mapped() { "mapped" } else { "owned" };
        write!(f, "VertexFrames({} x {}, {kind})", self.len, self.vertex_count)
    }
}

fn is_mappable(header: &Header) -> bool {
    let dtype = header.dtype;
    dtype.kind == DtypeKind::Float
        && dtype.size == 4
        && !dtype.big_endian
        && !header.fortran_order
        // Numpy aligns headers to 64 bytes, other writers may not.
        && header.length.is_multiple_of(4)
}

/// Writer of a `.npy` file of shape (T, V, 3), f32, one frame at a time. The file appears when it
/// is complete.
#[derive(Debug)]
pub struct VertexFramesWriter {
    file: AtomicFile,
    path: PathBuf,
    vertex_count: usize,
    len: usize,
}

/// Bytes reserved for the header, which is written again once T is known. Two numbers of twenty
/// digits fit, so that the header never grows over the first frame.
const HEADER_LENGTH: usize = 128;

impl VertexFramesWriter {
    /// Starts a file of frames of `vertex_count` vertices.
    ///
    /// # Errors
    /// The folder cannot be written to.
    pub fn create(path: &Path, vertex_count: usize) -> Result<Self> {
        let mut writer = Self {
            file: AtomicFile::create(path)?,
            path: path.to_path_buf(),
            vertex_count,
            len: 0,
        };
        writer.write_header()?;
        Ok(writer)
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// Another number of vertices; the file cannot be written.
    pub fn push(&mut self, frame: &[Vec3]) -> Result<()> {
        check_vertex_count(&self.path, self.vertex_count, frame)?;
        self.write(bytemuck::cast_slice(frame))?;
        self.len += 1;
        Ok(())
    }

    /// Number of frames so far.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns whether no frame has been added yet.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Writes the number of frames and gives the file its name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> Result<()> {
        // The first header was written for zero frames.
        (self.file.seek(SeekFrom::Start(0))).map_err(Error::io(&self.path, "write"))?;
        self.write_header()?;
        self.file.finish()
    }

    fn write_header(&mut self) -> Result<()> {
        let shape = [self.len, self.vertex_count, 3];
        self.write(&npy::padded_header_bytes("<f4", &shape, HEADER_LENGTH))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.write_all(bytes).map_err(Error::io(&self.path, "write"))
    }
}

/// Checks that a frame has `expected` positions.
///
/// # Errors
/// Another number of positions.
pub(crate) fn check_vertex_count<T>(path: &Path, expected: usize, frame: &[T]) -> Result<()> {
    // A frame of another length would shift all further frames of the file.
    if frame.len() == expected {
        return Ok(());
    }
    let expected = format!("frames of {expected} vertices");
    Err(Error::content(path, expected, format!("one of {}", frame.len())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streamed_frames_are_mapped_on_reading() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        let frame = |t: usize| [Vec3::splat(t as f32), Vec3::new(1.0, 2.0, t as f32 * 0.5)];
        let mut writer = VertexFramesWriter::create(&path, 2).unwrap();
        for t in 0..1000 {
            writer.push(&frame(t)).unwrap();
        }
        assert!(writer.push(&[Vec3::ZERO]).is_err());
        assert!(!path.exists());
        writer.finish().unwrap();
        let frames = VertexFrames::open_npy(&path).unwrap();
        assert!(frames.is_mapped());
        assert_eq!((frames.len(), frames.vertex_count()), (1000, 2));
        for (t, found) in frames.iter().enumerate() {
            assert_eq!(found, frame(t));
        }
    }

    #[test]
    fn first_non_finite_position_has_its_frame_and_vertex() {
        let mut data = vec![0.0; 2 * 3 * 3];
        data[13] = f32::NAN;
        let frames = VertexFrames::new(data, 2, 3).unwrap();
        assert_eq!(
            frames.first_non_finite(),
            Some(FrameVertex { frame: 1, vertex: 1 })
        );
        assert!(VertexFrames::new(vec![0.0; 5], 1, 2).is_none());
    }
}
