//! Scenes of glTF 2.0 files, `.glb` and `.gltf`.
//!
//! Files are in metres, +Y up, as scenes are. Not read: sparse data, data under an extension that the
//! file requires (Draco, meshopt), morph targets.

mod accessor;
mod animation;
mod container;
mod humanoid;
mod nodes;
mod skin;

pub(crate) use humanoid::humanoid_bones;

use crate::error::Result;
use animation::NodeAnimation;
use container::Container;
use std::path::Path;
use unic_scene::{Content, Request, Scene};

/// Reads the parts of a file that are asked for.
///
/// # Errors
/// A damaged file; parts that the file lacks.
pub(crate) fn read(path: &Path, request: &Request) -> Result<Scene> {
    let container = Container::read(path)?;
    let document = &container.document;
    let nodes = nodes::read(&container)?;
    let (skins, places) = skin::skins(&container)?;
    let meshes = skin::meshes(&container, request.content, &skins, &places)?;
    let motion = match request.content {
        Content::Motion => {
            Some(NodeAnimation::read(&container)?.motion(&container, &nodes, request.assumed.fps)?)
        }
        Content::Outline | Content::Skinned | Content::Points(_) => None,
    };
    let name = |animation: ::gltf::Animation| animation.name().unwrap_or("without a name").to_owned();
    let scene = Scene {
        generator: document.as_json().asset.generator.clone(),
        units: "metres, Y up, by the format".to_owned(),
        nodes,
        skins,
        meshes,
        animations: document.animations().map(name).collect(),
        motion,
        notes: Vec::new(),
    };
    match scene.check() {
        Ok(()) => Ok(scene),
        Err(fault) => Err(container.error(fault.expected, fault.found)),
    }
}
