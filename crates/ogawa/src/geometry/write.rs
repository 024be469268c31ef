//! Writing meshes, one frame at a time.

use super::mesh_writer::{MeshDescription, MeshWriter};
use crate::{
    archive::{Metadata, ObjectTree, TimeSampling, write_archive},
    container::ContainerWriter,
    error::{Error, Result},
    file::NewFile,
};
use std::{
    io::{Seek, Write},
    path::Path,
};

/// Program that the archive names.
const APPLICATION: &str = concat!("ogawa ", env!("CARGO_PKG_VERSION"));

/// Times of the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTiming {
    /// Frames per second, greater than 0.
    pub fps: f64,
    /// Time of frame 0, seconds.
    pub start: f64,
}

/// Index of a mesh in its [`ArchiveWriter`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshId(usize);

/// Writer of an archive of animated meshes. Frames of the meshes may be pushed in any order.
///
/// Memory holds one frame of each mesh, and 24 bytes for each further one. Each mesh is written as
/// `/NAME/NAMEShape`, below a transform that moves nothing.
#[derive(Debug)]
pub struct ArchiveWriter<W> {
    file: ContainerWriter<W>,
    timing: FrameTiming,
    meshes: Vec<MeshWriter>,
}

impl ArchiveWriter<NewFile> {
    /// Starts a file, which appears under its name with [`ArchiveWriter::save`].
    ///
    /// # Errors
    /// The folder cannot be written to, and the errors of [`ArchiveWriter::new`].
    pub fn create(path: impl AsRef<Path>, timing: FrameTiming) -> Result<Self> {
        check_timing(timing)?;
        Self::new(NewFile::create(path.as_ref())?, timing)
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(self) -> Result<()> {
        self.finish()?.save()
    }
}

impl<W: Write + Seek> ArchiveWriter<W> {
    /// Starts an archive in an empty file.
    ///
    /// # Errors
    /// A frame rate that is not positive, times that are not finite, or a failure to write.
    pub fn new(sink: W, timing: FrameTiming) -> Result<Self> {
        check_timing(timing)?;
        Ok(Self {
            file: ContainerWriter::new(sink)?,
            timing,
            meshes: Vec::new(),
        })
    }

    /// Adds a mesh.
    ///
    /// # Errors
    /// An unusable or known name; faces of vertices that the mesh does not have; another number of
    /// texture coordinates than vertices or corners; a failure to write.
    pub fn add_mesh(&mut self, mesh: &MeshDescription<'_>) -> Result<MeshId> {
        if self.meshes.iter().any(|known| known.name() == mesh.name) {
            return Err(Error::argument("name", "one for each mesh", mesh.name));
        }
        self.meshes.push(MeshWriter::new(&mut self.file, mesh)?);
        Ok(MeshId(self.meshes.len() - 1))
    }

    /// Adds a frame to a mesh: one position for each vertex.
    ///
    /// # Errors
    /// Another number of positions than vertices, positions that are not finite, missing normals of
    /// a mesh whose frames have some, or a failure to write.
    pub fn push(&mut self, mesh: MeshId, positions: &[[f32; 3]]) -> Result<()> {
        self.push_frame(mesh, positions, None)
    }

    /// Adds a frame to a mesh: one position and one normal for each vertex.
    ///
    /// # Errors
    /// Another number of positions or normals than vertices, numbers that are not finite, normals of
    /// a mesh whose first frame has none, or a failure to write.
    pub fn push_with_normals(
        &mut self,
        mesh: MeshId,
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
    ) -> Result<()> {
        self.push_frame(mesh, positions, Some(normals))
    }

    fn push_frame(&mut self, id: MeshId, positions: &[[f32; 3]], normals: Option<&[[f32; 3]]>) -> Result<()> {
        let Some(mesh) = self.meshes.get_mut(id.0) else {
            return Err(Error::argument(
                "mesh",
                format!("one of {} meshes", self.meshes.len()),
                id.0,
            ));
        };
        mesh.push(&mut self.file, positions, normals)
    }

    /// Writes all tables and returns the file, which holds a complete archive.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<W> {
        let samplings = [
            TimeSampling::default(),
            TimeSampling::Uniform {
                start: self.timing.start,
                step: 1.0 / self.timing.fps,
            },
        ];
        let mut file = self.file;
        let meshes = self.meshes.into_iter().map(|mesh| mesh.object(&mut file));
        let fps = format!("{:.6}", self.timing.fps);
        let metadata = [
            ("FramesPerTimeUnit", fps.as_str()),
            ("_ai_Application", APPLICATION),
        ];
        let top = ObjectTree {
            metadata: Metadata::of(&metadata),
            children: meshes.collect::<Result<_>>()?,
            ..ObjectTree::default()
        };
        write_archive(file, top, &samplings)
    }
}

fn check_timing(timing: FrameTiming) -> Result<()> {
    let FrameTiming { fps, start } = timing;
    let step = 1.0 / fps;
    if !(fps > 0.0 && fps.is_finite() && step.is_finite()) {
        return Err(Error::argument("fps", "a positive number", fps));
    }
    match start.is_finite() {
        true => Ok(()),
        false => Err(Error::argument("start", "a finite time", start)),
    }
}
