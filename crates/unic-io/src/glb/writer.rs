//! Writing a GLB frame by frame.

use super::{
    binary::BinaryWriter,
    body::{self, SkinnedMesh},
    document::Document,
    file_mesh::FileMesh,
    morphs::MorphWriter,
    tracks::JointTracks,
};
use crate::{
    error::{Error, Result},
    frames::check_vertex_count,
};
use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::{Pose, character::Character, mesh::TriMesh};

/// Largest number of frames of one file. Each frame is a morph target, and readers hold all targets
/// in memory: they handle ten seconds at 30 fps well.
pub const MAX_FRAMES: usize = 300;

/// Largest size of the positions and normals of all frames, bytes. The rest of the file fits
/// between this and the 4 GiB of the format.
const MAX_FRAME_BYTES: u64 = 3 << 30;

/// Frame rates whose frame times ascend in f32 over [`MAX_FRAMES`] frames, Hz.
const FRAME_RATES: std::ops::RangeInclusive<f32> = 1e-3..=1e6;

/// Content and length of an animation.
#[derive(Clone, Copy, Debug)]
pub struct GlbScene<'a> {
    /// Name of the animation and of the scene.
    pub name: &'a str,
    /// The body, its skeleton and its skinning weights.
    pub character: &'a Character,
    /// Triangles and texture coordinates of the garment; its own positions are not written.
    pub garment: &'a TriMesh,
    /// Frames per second.
    pub fps: f32,
    /// Number of frames that will be pushed, 1 to [`MAX_FRAMES`].
    pub frames: usize,
}

/// Writer of a GLB, one frame at a time. The file appears when it is complete; [`crate::glb`]
/// describes its content.
///
/// Frames are collected in an unnamed temporary file of the same folder. Memory holds two frames of
/// the garment and all poses.
#[derive(Debug)]
pub struct GlbWriter {
    path: PathBuf,
    name: String,
    fps: f32,
    frames: usize,
    garment_vertices: usize,
    binary: BinaryWriter,
    body: SkinnedMesh,
    morphs: MorphWriter,
    tracks: JointTracks,
}

impl GlbWriter {
    /// Starts a file. All faults of the scene are reported here, before the first frame.
    ///
    /// # Errors
    /// No frame or more than [`MAX_FRAMES`]; a file of more than 4 GiB; a frame rate outside 0.001
    /// to 1,000,000 Hz; a mesh without triangles or with indices out of range; skinning weights of
    /// another body; a folder that cannot be written to.
    pub fn create(path: &Path, scene: &GlbScene<'_>) -> Result<Self> {
        // All checks come before the first byte is written.
        check_timing(path, scene)?;
        check_weights(path, scene.character)?;
        let garment = FileMesh::new(path, scene.garment)?;
        check_size(path, scene.frames, garment.split.len())?;
        let body_mesh = FileMesh::new(path, &scene.character.body)?;
        let mut binary = BinaryWriter::create(path)?;
        Ok(Self {
            path: path.to_path_buf(),
            name: scene.name.to_owned(),
            fps: scene.fps,
            frames: scene.frames,
            garment_vertices: scene.garment.vertices.len(),
            body: body::write(scene.character, &body_mesh, &mut binary)?,
            morphs: MorphWriter::new(garment),
            tracks: JointTracks::new(&scene.character.skeleton),
            binary,
        })
    }

    /// Adds a frame: the pose of the body, and one position for each vertex of the garment, in
    /// metres, world space.
    ///
    /// # Errors
    /// More frames than announced; another number of vertices or joints; numbers that are not
    /// finite; a full disk.
    pub fn push(&mut self, pose: &Pose, garment: &[Vec3]) -> Result<()> {
        if self.tracks.len() == self.frames {
            return Err(self.wrong_count("a further one".into()));
        }
        check_vertex_count(&self.path, self.garment_vertices, garment)?;
        self.check_pose(pose)?;
        if let Some(vertex) = garment.iter().position(|p| !p.is_finite()) {
            let found = format!("vertex {vertex} without one in frame {}", self.tracks.len());
            return Err(Error::content(&self.path, "finite positions", found));
        }
        // The garment first: if the disk is full, the number of poses still is that of complete
        // frames.
        self.morphs.push(garment, &mut self.binary)?;
        self.tracks.push(pose);
        Ok(())
    }

    /// Completes the file and gives it its final name.
    ///
    /// # Errors
    /// Fewer frames than announced; the file cannot be written.
    pub fn finish(self) -> Result<()> {
        // The poses count the frames: each push adds one.
        let found = self.tracks.len();
        if found != self.frames {
            return Err(self.wrong_count(found.to_string()));
        }
        let Some(garment) = self.morphs.finish() else {
            return Err(Error::content(&self.path, "at least one frame", "none"));
        };
        let document = Document {
            name: self.name,
            fps: self.fps,
            body: self.body,
            garment,
            tracks: self.tracks,
        };
        document.write(&self.path, self.binary)
    }

    fn wrong_count(&self, found: String) -> Error {
        Error::content(&self.path, format!("{} frames", self.frames), found)
    }

    fn check_pose(&self, pose: &Pose) -> Result<()> {
        let (expected, found) = (self.tracks.joint_count(), pose.local.len());
        if expected != found {
            let expected = format!("poses of {expected} joints");
            return Err(Error::content(&self.path, expected, format!("one of {found}")));
        }
        match pose.is_valid() {
            true => Ok(()),
            false => Err(Error::content(
                &self.path,
                "finite poses with unit rotations",
                format!("another one in frame {}", self.tracks.len()),
            )),
        }
    }
}

fn check_timing(path: &Path, scene: &GlbScene<'_>) -> Result<()> {
    if !(1..=MAX_FRAMES).contains(&scene.frames) {
        let expected = format!(
            "1 to {MAX_FRAMES} frames in a .glb (.abc, .pc2, .npz and folders of OBJ files hold any number)"
        );
        return Err(Error::content(path, expected, scene.frames.to_string()));
    }
    // `contains` is false for NaN.
    if !FRAME_RATES.contains(&scene.fps) {
        let expected = "a frame rate of 0.001 to 1000000 Hz";
        return Err(Error::content(path, expected, scene.fps.to_string()));
    }
    Ok(())
}

fn check_weights(path: &Path, character: &Character) -> Result<()> {
    let (vertices, joints) = (character.body.vertices.len(), character.skeleton.len());
    let (rows, columns) = (character.weights.len(), character.weights.joint_count());
    if (rows, columns) == (vertices, joints) {
        return Ok(());
    }
    let expected = format!("skinning weights of {vertices} vertices and {joints} joints");
    Err(Error::content(
        path,
        expected,
        format!("some of {rows} and {columns}"),
    ))
}

fn check_size(path: &Path, frames: usize, vertices: usize) -> Result<()> {
    // A position and a normal for each vertex and frame. Saturating, because the number of frames
    // comes from a caller.
    let bytes = (frames as u64).saturating_mul(vertices as u64 * 2 * size_of::<Vec3>() as u64);
    if bytes <= MAX_FRAME_BYTES {
        return Ok(());
    }
    let expected = format!("at most {MAX_FRAME_BYTES} bytes of frames in a .glb");
    let found = format!("{bytes} for {frames} frames of {vertices} vertices");
    Err(Error::content(path, expected, found))
}
