//! Skinned characters and their motion in glTF 2.0 files, `.glb` and `.gltf`.
//!
//! Files are in metres, +Y up, as captures are. A character is the only skinned mesh of its file in
//! its bind pose, whose joints get the axes of the world: the bind pose is the zero pose. Vertices
//! that a file repeats along the seams of its texture are welded. A motion is the first animation of
//! its file. On the file's own character it is exact; on others it is retargeted as BVH is.
//!
//! Not read: sparse data, data under an extension that the file requires (Draco, meshopt), morph
//! targets, scales that differ by axis.

mod accessor;
mod animation;
mod container;
mod joint_nodes;
mod motion;
mod rest_space;
mod rig;
mod scene;
mod skin;

pub(crate) use motion::{GltfTransfer, read_motion};

use crate::{
    error::Result,
    foreign_formats::{PartlyReadFormat, partly_read},
};
use container::Container;
use motion::AnimatedRig;
use rig::RiggedBody;
use std::path::Path;
use unic_core::character::Character;

/// A character from a glTF file.
#[derive(Clone, Debug)]
pub struct GltfCharacter {
    /// Body, skeleton and skinning weights; metres, +Y up.
    pub character: Character,
    /// Name of the mesh.
    pub name: String,
    /// Vertex of the body for each vertex of the file: copies along seams have one.
    pub vertex_of_file: Vec<u32>,
    /// Descriptions of what was converted, one sentence each.
    pub notes: Vec<String>,
}

/// Summary of the first animation of a file.
#[derive(Clone, Debug)]
pub(crate) struct GltfAnimationSummary {
    pub(crate) frames: usize,
    pub(crate) fps: f32,
    pub(crate) notes: Vec<String>,
}

/// Counts of a file.
#[derive(Clone, Debug)]
pub(crate) struct GltfContents {
    /// Program that wrote the file, if it says so.
    pub(crate) generator: Option<String>,
    /// Names of the meshes with a skin.
    pub(crate) skinned: Vec<String>,
    /// Number of meshes without one.
    pub(crate) other_meshes: usize,
    /// Names of the animations.
    pub(crate) animations: Vec<String>,
}

/// Returns whether a file is glTF, by its first bytes or its extension.
pub(crate) fn is_gltf(path: &Path) -> bool {
    partly_read(path) == Some(PartlyReadFormat::Gltf)
}

/// Reads the only skinned mesh of a file as a character.
///
/// # Errors
/// A damaged file; no skinned mesh, several; a mesh, skeleton or weights with faults.
pub fn read_gltf_character(path: &Path) -> Result<GltfCharacter> {
    let body = RiggedBody::read(&Container::read(path)?)?;
    Ok(GltfCharacter {
        character: body.character,
        name: body.name,
        vertex_of_file: body.vertex_of_file,
        notes: body.rig.notes,
    })
}

/// Summarises the first animation of a file.
///
/// # Errors
/// Those of [`read_motion`].
pub(crate) fn summarise_animation(path: &Path) -> Result<GltfAnimationSummary> {
    let animated = AnimatedRig::read(&Container::read(path)?, None)?;
    Ok(GltfAnimationSummary {
        frames: animated.timeline.frames,
        fps: animated.timeline.fps,
        notes: animated.notes,
    })
}

/// Lists what a file holds.
///
/// # Errors
/// A damaged file.
pub(crate) fn contents(path: &Path) -> Result<GltfContents> {
    let container = Container::read(path)?;
    let document = &container.document;
    let meshes = || document.nodes().filter(|node| node.mesh().is_some());
    let skinned = meshes().filter(|node| node.skin().is_some());
    let name = |animation: ::gltf::Animation| animation.name().unwrap_or("without a name").to_owned();
    Ok(GltfContents {
        generator: document.as_json().asset.generator.clone(),
        skinned: skinned.map(|node| skin::name(&node)).collect(),
        other_meshes: meshes().filter(|node| node.skin().is_none()).count(),
        animations: document.animations().map(name).collect(),
    })
}
