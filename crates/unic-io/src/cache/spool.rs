//! Frames on their way into a file whose format needs their number first.

use crate::{
    atomic::{parent_folder, without_path},
    error::{Error, Result},
    frames::check_vertex_count,
};
use glam::Vec3;
use std::{
    fs::File,
    io::{BufReader, BufWriter, Read, Seek, Write},
    path::{Path, PathBuf},
};

/// Bytes that are buffered on the way to the disk.
const BUFFER_BYTES: usize = 1 << 16;

/// Positions of a mesh in every frame, collected in an unnamed temporary file.
///
/// Memory holds no frames. The system removes the file when the program ends, however it ends.
#[derive(Debug)]
pub(crate) struct FrameSpool {
    target: PathBuf,
    file: BufWriter<File>,
    vertex_count: usize,
    len: usize,
}

impl FrameSpool {
    /// Starts an empty spool for the file `target`, in whose folder the frames are collected.
    ///
    /// # Errors
    /// The folder cannot be created or written to.
    pub(crate) fn create(target: &Path, vertex_count: usize) -> Result<Self> {
        let folder = parent_folder(target);
        std::fs::create_dir_all(folder).map_err(Error::io(folder, "create folder"))?;
        // In the target's folder and not in the system's: the frames may be larger than `/tmp`.
        let file = tempfile::tempfile_in(folder)
            .map_err(without_path)
            .map_err(Error::io(target, "create"))?;
        Ok(Self {
            target: target.to_path_buf(),
            file: BufWriter::with_capacity(BUFFER_BYTES, file),
            vertex_count,
            len: 0,
        })
    }

    /// Number of vertices of every frame.
    pub(crate) fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// Another number of vertices; a full disk.
    pub(crate) fn push(&mut self, frame: &[Vec3]) -> Result<()> {
        check_vertex_count(&self.target, self.vertex_count, frame)?;
        (self.file.write_all(bytemuck::cast_slice(frame))).map_err(Error::io(&self.target, "write"))?;
        self.len += 1;
        Ok(())
    }

    /// Ends the collection.
    ///
    /// # Errors
    /// A full disk.
    pub(crate) fn finish(self) -> Result<SpooledFrames> {
        let file = (self.file.into_inner()).map_err(|e| Error::io(&self.target, "write")(e.into_error()))?;
        Ok(SpooledFrames {
            target: self.target,
            file,
            vertex_count: self.vertex_count,
            len: self.len,
        })
    }
}

/// Frames of a [`FrameSpool`] that is complete. They can be read any number of times.
#[derive(Debug)]
pub(crate) struct SpooledFrames {
    target: PathBuf,
    file: File,
    vertex_count: usize,
    len: usize,
}

impl SpooledFrames {
    /// Number of frames.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Bytes of all frames from the first on: little-endian f32.
    ///
    /// # Errors
    /// The temporary file cannot be read.
    pub(crate) fn bytes(&mut self) -> Result<impl Read + use<'_>> {
        (self.file.rewind()).map_err(Error::io(&self.target, "read back the frames of"))?;
        Ok(BufReader::with_capacity(BUFFER_BYTES, &self.file))
    }

    /// Calls `use_frame` with the number and positions of each frame, in order.
    ///
    /// # Errors
    /// The temporary file cannot be read; those of `use_frame`.
    pub(crate) fn for_each(&mut self, mut use_frame: impl FnMut(usize, &[Vec3]) -> Result<()>) -> Result<()> {
        let mut frame = vec![Vec3::ZERO; self.vertex_count];
        let (len, target) = (self.len, self.target.clone());
        let mut bytes = self.bytes()?;
        for t in 0..len {
            (bytes.read_exact(bytemuck::cast_slice_mut(&mut frame)))
                .map_err(Error::io(&target, "read back the frames of"))?;
            use_frame(t, &frame)?;
        }
        Ok(())
    }
}
