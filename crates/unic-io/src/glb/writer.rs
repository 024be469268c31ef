//! One frame after the other into a GLB.

use super::{
    binary::Binary,
    body::{self, SkinnedMesh},
    document::Document,
    seams::Seams,
    shapes::Morphs,
    tracks::Tracks,
};
use crate::{
    error::{Error, Result},
    frames::check_vertex_count,
};
use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::{character::Character, mesh::TriMesh, skeleton::Pose};

/// Most frames of one file. Each is a morph target, and readers hold all targets in memory: ten
/// seconds at 30 frames a second are what they take well.
pub const MAX_FRAMES: usize = 300;

/// Positions and normals of all frames may take this many bytes, which leaves room below the 4 GiB
/// of the format for everything else.
const MAX_FRAME_BYTES: u64 = 3 << 30;

/// What is animated, and for how long.
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
    /// Number of frames that will come, 1 to [`MAX_FRAMES`].
    pub frames: usize,
}

/// Writes a GLB, one frame at a time, atomically; the [module](super) tells what is in it.
///
/// Frames wait in an unnamed file of the same folder; memory holds two frames of the garment and the
/// poses.
#[derive(Debug)]
pub struct GlbWriter {
    path: PathBuf,
    name: String,
    fps: f32,
    frames: usize,
    garment_vertices: usize,
    binary: Binary,
    body: SkinnedMesh,
    morphs: Morphs,
    tracks: Tracks,
}

impl GlbWriter {
    /// Starts a file; everything that can be wrong with the scene is found here.
    ///
    /// # Errors
    /// No frame or more than [`MAX_FRAMES`], so many vertices that the file would outgrow 4 GiB, a
    /// frame rate that is not positive, a mesh without triangles or with broken indices, skinning
    /// weights of another body, a folder that cannot be written to.
    pub fn create(path: &Path, scene: &GlbScene<'_>) -> Result<Self> {
        check_timing(path, scene)?;
        check_weights(path, scene.character)?;
        let seams = Seams::new(path, scene.garment)?;
        check_size(path, scene.frames, seams.len())?;
        let body_seams = Seams::new(path, &scene.character.body)?;
        let mut binary = Binary::create(path)?;
        Ok(Self {
            path: path.to_path_buf(),
            name: scene.name.to_owned(),
            fps: scene.fps,
            frames: scene.frames,
            garment_vertices: scene.garment.vertices.len(),
            body: body::write(scene.character, &body_seams, &mut binary)?,
            morphs: Morphs::new(seams, scene.garment.faces.clone()),
            tracks: Tracks::new(&scene.character.skeleton),
            binary,
        })
    }

    /// Adds a frame: the pose of the body, and one position a vertex of the garment, metres, world
    /// space.
    ///
    /// # Errors
    /// More frames than announced, another number of vertices or joints, numbers that are not finite,
    /// a full disk.
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
        self.morphs.push(garment, &mut self.binary)?;
        self.tracks.push(pose);
        Ok(())
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    /// Fewer frames than announced; the file cannot be written.
    pub fn finish(self) -> Result<()> {
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
            "1 to {MAX_FRAMES} frames in a .glb (.pc2, .npz and folders of OBJ files hold any number)"
        );
        return Err(Error::content(path, expected, scene.frames.to_string()));
    }
    // Times must ascend, which the reciprocal of an extreme rate would not.
    if !(scene.fps >= 1e-3 && scene.fps <= 1e6) {
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
    let bytes = (frames as u64).saturating_mul(vertices as u64 * 2 * size_of::<Vec3>() as u64);
    if bytes <= MAX_FRAME_BYTES {
        return Ok(());
    }
    let expected = format!("at most {MAX_FRAME_BYTES} bytes of frames in a .glb");
    let found = format!("{bytes} for {frames} frames of {vertices} vertices");
    Err(Error::content(path, expected, found))
}
