//! Skinned characters and their motion in glTF, FBX and USD files.
//!
//! A character is the only skinned mesh of its file in its bind pose, whose joints get the axes of
//! the world: the bind pose is the zero pose. Vertices that a glTF file repeats along the seams of
//! its texture are welded. A motion is the first animation of its file. On the file's own character it
//! is exact; on others it is retargeted as BVH is. The result is in metres, +Y up.
//!
//! Not read: morph targets, scales that differ by axis.
//!
//! FBX and USD are read by libraries that damaged files can crash. Programs that read files of others
//! call [`unic_scene::guard::use_child`] at their start.

mod body;
mod file;
mod joint_nodes;
mod motion;
mod points;
mod rest_space;
mod rig;
mod weld;

pub(crate) use motion::{RiggedTransfer, read_joints_of_motion, read_motion};
pub use points::{ScenePoints, read_scene_points};

use crate::{
    error::{Error, Result},
    foreign_formats::{PartlyReadFormat, partly_read},
};
use body::RiggedBody;
use file::SceneFile;
use motion::AnimatedRig;
use std::path::Path;
use unic_core::character::Character;
use unic_scene::{Assumed, Content, Request};

/// Statements about a file with a rig that it does not make itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct CharacterOptions<'a> {
    /// Unit and axis of USD files without them.
    pub assumed: Assumed,
    /// Name of the body's mesh in a file of several skinned meshes.
    pub body: Option<&'a str>,
}

/// A character from a file with a rig.
#[derive(Clone, Debug)]
pub struct RiggedCharacter {
    /// Body, skeleton and skinning weights; metres, +Y up.
    pub character: Character,
    /// Name of the mesh.
    pub name: String,
    /// Descriptions of what was converted, one sentence each.
    pub notes: Vec<String>,
}

/// Format of a file with a rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RiggedFormat {
    /// `.glb` and `.gltf`.
    Gltf,
    /// `.fbx`.
    Fbx,
    /// `.usd`, `.usda`, `.usdc` and `.usdz`.
    Usd,
}

impl RiggedFormat {
    /// Finds the format of a file by its first bytes or its extension.
    pub fn of(path: &Path) -> Option<Self> {
        match partly_read(path)? {
            PartlyReadFormat::Gltf => Some(Self::Gltf),
            PartlyReadFormat::Fbx => Some(Self::Fbx),
            PartlyReadFormat::Usd => Some(Self::Usd),
            PartlyReadFormat::Alembic | PartlyReadFormat::Mdd | PartlyReadFormat::Pickle => None,
        }
    }

    /// Name of the format.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gltf => "glTF",
            Self::Fbx => "FBX",
            Self::Usd => "USD",
        }
    }
}

/// Summary of the first animation of a file.
#[derive(Clone, Debug)]
pub(crate) struct AnimationSummary {
    pub(crate) frames: usize,
    pub(crate) fps: f32,
    pub(crate) notes: Vec<String>,
}

/// Counts of a file.
#[derive(Clone, Debug)]
pub(crate) struct SceneContents {
    /// Program that wrote the file, if it says so.
    pub(crate) generator: Option<String>,
    /// Unit and up axis of the file.
    pub(crate) units: String,
    /// Names of the meshes with a skin.
    pub(crate) skinned: Vec<String>,
    /// Other meshes.
    pub(crate) others: Vec<OtherMesh>,
    /// Names of the animations.
    pub(crate) animations: Vec<String>,
    pub(crate) notes: Vec<String>,
}

/// A mesh without a skin.
#[derive(Clone, Debug)]
pub(crate) struct OtherMesh {
    pub(crate) name: String,
    pub(crate) vertices: usize,
    /// Number of samples of its points over time.
    pub(crate) samples: usize,
}

fn request(content: Content, assumed: &Assumed) -> Request {
    Request {
        content,
        assumed: *assumed,
    }
}

/// Reads one skinned mesh of a file as a character.
///
/// # Errors
/// A damaged file; no skinned mesh, several of which none is chosen; a mesh, skeleton or weights with
/// faults.
pub fn read_rigged_character(
    path: &Path,
    format: RiggedFormat,
    options: &CharacterOptions<'_>,
) -> Result<RiggedCharacter> {
    let file = SceneFile::read(path, format, &request(Content::Skinned, &options.assumed))?;
    let body = RiggedBody::read(&file, options.body)?;
    let notes = file.scene.notes.iter().chain(&body.rig.notes);
    Ok(RiggedCharacter {
        notes: notes.cloned().collect(),
        character: body.character,
        name: body.name,
    })
}

/// Summarises the first animation of a file.
///
/// # Errors
/// Those of [`read_motion`].
pub(crate) fn summarise_animation(path: &Path, format: RiggedFormat) -> Result<AnimationSummary> {
    let file = SceneFile::read(path, format, &request(Content::Motion, &Assumed::default()))?;
    let animated = AnimatedRig::new(&file)?;
    Ok(AnimationSummary {
        frames: animated.motion.frames,
        fps: animated.motion.fps,
        notes: animated.notes,
    })
}

/// Returns whether a file has a skinned mesh, and not joints alone.
///
/// # Errors
/// A damaged file, one of another format.
pub fn has_skinned_mesh(path: &Path) -> Result<bool> {
    match RiggedFormat::of(path) {
        Some(format) => Ok(!contents(path, format)?.skinned.is_empty()),
        None => Err(Error::content(path, "a glTF, FBX or USD file", "another")),
    }
}

/// Lists what a file holds.
///
/// # Errors
/// A damaged file.
pub(crate) fn contents(path: &Path, format: RiggedFormat) -> Result<SceneContents> {
    let file = SceneFile::read(path, format, &request(Content::Outline, &Assumed::default()))?;
    let meshes = &file.scene.meshes;
    let skinned = meshes.iter().filter(|mesh| mesh.skin.is_some());
    let others = meshes.iter().filter(|mesh| mesh.skin.is_none());
    let other = |mesh: &unic_scene::Mesh| OtherMesh {
        name: mesh.name.clone(),
        vertices: mesh.vertices,
        samples: mesh.samples,
    };
    Ok(SceneContents {
        skinned: skinned.map(|mesh| mesh.name.clone()).collect(),
        others: others.map(other).collect(),
        generator: file.scene.generator,
        units: file.scene.units,
        animations: file.scene.animations,
        notes: file.scene.notes,
    })
}
