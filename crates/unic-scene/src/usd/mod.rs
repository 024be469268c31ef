//! USD files, by openusd: the composed stage, with its own schemas' meaning computed here.

mod animation;
mod mesh;
mod points;
mod resolver;
mod sampled;
mod skeleton;
mod stage;
mod units;
mod value;
mod xform;

use crate::{
    fault::Fault,
    request::{Content, Request},
    scene::{Mesh, Scene},
};
use skeleton::Skeleton;
use stage::Prims;
use std::path::Path;
use units::Conversion;
use xform::Xforms;

/// Reads a file.
pub(crate) fn read(path: &Path, request: &Request) -> Result<Scene, Fault> {
    let prims = Prims::open(path)?;
    let conversion = Conversion::of(&prims.stage, request.assumed)?;
    let mut scene = Scene {
        generator: prims.generator(),
        units: conversion.description.clone(),
        notes: conversion.notes.clone(),
        ..Scene::default()
    };
    let xforms = Xforms::read(&prims, conversion.metres_y_up, &mut scene)?;
    let skeletons = skeleton::read(&prims, &xforms, &mut scene)?;
    for (index, prim) in prims.meshes.iter().enumerate() {
        let mesh = mesh::Binding::of(&prims, prim, &skeletons)?;
        scene.meshes.push(match request.content {
            Content::Skinned if mesh.skeleton.is_some() => mesh.with_shape(&prims, &skeletons)?,
            Content::Points(asked) if asked == index => {
                points::with_samples(&mesh, &prims, &xforms, &conversion)?
            }
            _ => mesh.outline(&prims)?,
        });
    }
    animation::read(
        &prims,
        &xforms,
        &skeletons,
        &conversion,
        request.content,
        &mut scene,
    )?;
    Ok(scene)
}

/// A mesh whose shape is not read.
fn outline(name: String, vertices: usize, samples: usize, skin: Option<usize>) -> Mesh {
    Mesh {
        name,
        vertices,
        triangles: 0,
        samples,
        skin,
        shape: None,
        points: None,
    }
}

/// Skeleton of a path.
fn skeleton_at<'a>(skeletons: &'a [Skeleton], path: &openusd::sdf::Path) -> Option<(usize, &'a Skeleton)> {
    skeletons
        .iter()
        .enumerate()
        .find(|(_, skeleton)| skeleton.path == *path)
}
