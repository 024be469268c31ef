//! Writing vertex animations, one frame at a time.

use super::spool::FrameSpool;
use crate::{
    atomic::{TemporaryFolder, parent_folder},
    error::{Error, Result},
    frames::check_vertex_count,
    mdd::MddWriter,
    npz::NpzWriter,
    obj,
    pc2::Pc2Writer,
};
use glam::Vec3;
use std::{
    fs::File,
    io::BufWriter,
    path::{Path, PathBuf},
};
use unic_core::mesh::TriMesh;

/// Writer of a vertex animation in the format that the extension of its path names.
///
/// Nothing appears under that path before [`VertexCacheWriter::finish`].
#[derive(Debug)]
pub enum VertexCacheWriter {
    /// A `.pc2` file: positions only.
    Pc2(Pc2Writer),
    /// A `.mdd` file: positions and times.
    Mdd(MddWriter),
    /// A `.npz` file: positions, faces and frame rate.
    Npz(NpzAnimationWriter),
    /// A folder with one OBJ file for each frame, for a path without an extension.
    ObjFolder(ObjFolderWriter),
}

impl VertexCacheWriter {
    /// Starts an animation of `mesh`, whose own positions are not written.
    ///
    /// # Errors
    /// Another extension than `.pc2`, `.mdd`, `.npz` or none; the folder cannot be written to.
    pub fn create(path: &Path, mesh: &TriMesh, fps: f32) -> Result<Self> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            // The format has no frame rate.
            Some("pc2") => Pc2Writer::create(path, mesh.vertices.len(), 0.0, 1.0).map(Self::Pc2),
            Some("mdd") => MddWriter::create(path, mesh.vertices.len(), fps).map(Self::Mdd),
            Some("npz") => NpzAnimationWriter::create(path, mesh, fps).map(Self::Npz),
            None => ObjFolderWriter::create(path, mesh).map(Self::ObjFolder),
            Some(other) => Err(Error::content(
                path,
                "a path that ends in .pc2, .mdd, .npz or in no ending (a folder of OBJ files)",
                format!(".{other}"),
            )),
        }
    }

    /// Adds a frame: one position for each vertex of the mesh, metres.
    ///
    /// # Errors
    /// Another number of vertices; the file cannot be written.
    pub fn push(&mut self, frame: &[Vec3]) -> Result<()> {
        match self {
            Self::Pc2(writer) => writer.push(frame),
            Self::Mdd(writer) => writer.push(frame),
            Self::Npz(writer) => writer.push(frame),
            Self::ObjFolder(writer) => writer.push(frame),
        }
    }

    /// Completes the animation.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<()> {
        match self {
            Self::Pc2(writer) => writer.finish(),
            Self::Mdd(writer) => writer.finish(),
            Self::Npz(writer) => writer.finish(),
            Self::ObjFolder(writer) => writer.finish(),
        }
    }
}

/// Writer of a `.npz` file with `vertices` (T, V, 3) f32, `faces` (F, 3) i32 and `fps`.
///
/// Frames are collected in an unnamed temporary file of the same folder: T stands at the start of
/// the compressed array, where it cannot be changed later.
#[derive(Debug)]
pub struct NpzAnimationWriter {
    path: PathBuf,
    frames: FrameSpool,
    faces: Vec<[u32; 3]>,
    fps: f32,
}

impl NpzAnimationWriter {
    /// Starts a file.
    ///
    /// # Errors
    /// The folder cannot be written to.
    pub fn create(path: &Path, mesh: &TriMesh, fps: f32) -> Result<Self> {
        Ok(Self {
            path: path.to_path_buf(),
            frames: FrameSpool::create(path, mesh.vertices.len())?,
            faces: mesh.faces.clone(),
            fps,
        })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// Another number of vertices; the file cannot be written.
    pub fn push(&mut self, frame: &[Vec3]) -> Result<()> {
        self.frames.push(frame)
    }

    /// Completes the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<()> {
        let vertex_count = self.frames.vertex_count();
        let mut frames = self.frames.finish()?;
        let mut npz = NpzWriter::create(&self.path)?;
        let shape = [frames.len(), vertex_count, 3];
        npz.f32s_from("vertices", &shape, &mut frames.bytes()?)?;
        let faces: Vec<i32> = self.faces.as_flattened().iter().map(|&i| i as i32).collect();
        npz.i32s("faces", &[self.faces.len(), 3], &faces)?;
        npz.f64s("fps", &[], &[f64::from(self.fps)])?;
        npz.finish()
    }
}

/// Writer of `frame_0000.obj`, `frame_0001.obj`, ... in a folder that appears when it is complete.
#[derive(Debug)]
pub struct ObjFolderWriter {
    folder: TemporaryFolder,
    target: PathBuf,
    mesh: TriMesh,
    len: usize,
}

impl ObjFolderWriter {
    /// Starts a folder that will be called `target`.
    ///
    /// # Errors
    /// `target` exists; its parent folder cannot be written to.
    pub fn create(target: &Path, mesh: &TriMesh) -> Result<Self> {
        // A rename replaces a file but not a folder with content.
        if target.exists() {
            return Err(Error::content(target, "no such folder yet", "one of this name"));
        }
        let parent = parent_folder(target);
        std::fs::create_dir_all(parent).map_err(Error::io(parent, "create folder"))?;
        let folder = TemporaryFolder::create_in(parent);
        let folder = folder.map_err(Error::io(target, "create"))?;
        Ok(Self {
            folder,
            target: target.to_path_buf(),
            mesh: mesh.clone(),
            len: 0,
        })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// Another number of vertices; the file cannot be written.
    pub fn push(&mut self, frame: &[Vec3]) -> Result<()> {
        check_vertex_count(&self.target, self.mesh.vertices.len(), frame)?;
        let name = format!("frame_{:04}.obj", self.len);
        // Errors name the file in the final folder, not in the temporary one.
        let shown = self.target.join(&name);
        let file = File::create(self.folder.path().join(&name)).map_err(Error::io(&shown, "create"))?;
        let mut file = BufWriter::new(file);
        obj::write_mesh(&mut file, &self.mesh, frame).map_err(Error::io(&shown, "write"))?;
        let file = (file.into_inner()).map_err(|e| Error::io(&shown, "write")(e.into_error()))?;
        // Synced one by one: the rename of the folder must not outrun the content of its files.
        file.sync_all().map_err(Error::io(&shown, "sync"))?;
        self.len += 1;
        Ok(())
    }

    /// Gives the folder its final name.
    ///
    /// # Errors
    /// The folder cannot be renamed.
    pub fn finish(self) -> Result<()> {
        let target = self.target;
        (self.folder.persist(&target)).map_err(Error::io(&target, "rename to"))
    }
}
