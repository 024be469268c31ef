//! Skeletons of UsdSkel.

use super::{stage::Prims, value, xform::Xforms};
use crate::{
    fault::Fault,
    scene::{Local, Node, Scene, Skin},
};
use glam::DMat4;
use openusd::sdf;
use std::collections::HashMap;

/// A skeleton whose joints are nodes of the scene and whose skin is that of the same index.
pub(super) struct Skeleton {
    pub(super) path: sdf::Path,
    /// Paths of the joints within the skeleton, as `hips/spine`.
    pub(super) joints: Vec<String>,
    /// Node of the first joint; the others follow.
    pub(super) first_node: usize,
    /// `parent_from_joint` of the rest pose.
    pub(super) rest: Vec<Local>,
}

impl Skeleton {
    /// Index of a joint for each name; none for names that the skeleton lacks.
    pub(super) fn places(&self, names: &[String]) -> Vec<Option<usize>> {
        let own: HashMap<&str, usize> = (self.joints.iter().enumerate())
            .map(|(index, name)| (name.as_str(), index))
            .collect();
        names.iter().map(|name| own.get(name.as_str()).copied()).collect()
    }
}

/// Reads the skeletons, and adds nodes and a skin for each of them to the scene.
pub(super) fn read(prims: &Prims, xforms: &Xforms, scene: &mut Scene) -> Result<Vec<Skeleton>, Fault> {
    let mut skeletons = Vec::new();
    for path in &prims.skeletons {
        let joints = prims.tokens(path, "joints")?;
        let binds = matrices(prims, path, "bindTransforms", joints.len())?;
        let rest = matrices(prims, path, "restTransforms", joints.len())?;
        let parents = parents(&joints);
        let binds = binds.or_else(|| rest.as_deref().map(|rest| placed(rest, &parents)));
        let Some(binds) = binds.filter(|binds| !binds.is_empty()) else {
            // The meshes of the file may be what is asked for.
            let note = format!("the skeleton {path} has no joints with a bind pose and is left out");
            scene.notes.push(note);
            continue;
        };
        let rest: Vec<Local> = (rest.unwrap_or_else(|| relative(&binds, &parents)).iter())
            .map(|matrix| Local::from_matrix(matrix.as_mat4()))
            .collect();
        let first_node = scene.nodes.len();
        for (joint, parent) in parents.iter().enumerate() {
            let name = joints[joint].rsplit('/').next().unwrap_or_default();
            scene.nodes.push(Node {
                name: name.to_owned(),
                parent: parent.map(|parent| first_node + parent).or(xforms.node(path)),
                local: rest[joint],
            });
        }
        scene.skins.push(Skin {
            joints: (first_node..scene.nodes.len()).collect(),
            inverse_binds: binds.iter().map(|bind| bind.inverse().as_mat4()).collect(),
            // The format speaks of the world at bind time, writers of the skeleton's own space.
            world_from_mesh: None,
        });
        skeletons.push(Skeleton {
            path: path.clone(),
            joints,
            first_node,
            rest,
        });
    }
    Ok(skeletons)
}

/// Matrices of the joints; none if the attribute is missing.
fn matrices(prims: &Prims, path: &sdf::Path, name: &str, joints: usize) -> Result<Option<Vec<DMat4>>, Fault> {
    let Some(list) = prims.value(path, name)?.and_then(value::matrices) else {
        return Ok(None);
    };
    match list.len() == joints {
        true => Ok(Some(list)),
        false => Err(Fault::new(
            format!("{name} of {joints} joints at {path}"),
            list.len().to_string(),
        )),
    }
}

/// Parent of each joint: the nearest one whose path its own begins with.
fn parents(joints: &[String]) -> Vec<Option<usize>> {
    let places: HashMap<&str, usize> = (joints.iter().enumerate())
        .map(|(index, name)| (name.as_str(), index))
        .collect();
    let parent = |name: &String| {
        let mut above = std::iter::successors(name.rsplit_once('/'), |(path, _)| path.rsplit_once('/'));
        above.find_map(|(path, _)| places.get(path).copied())
    };
    joints.iter().map(parent).collect()
}

/// Matrices relative to the parents, of those relative to one space.
fn relative(placed: &[DMat4], parents: &[Option<usize>]) -> Vec<DMat4> {
    let own = placed.iter().zip(parents);
    own.map(|(matrix, parent)| match parent {
        Some(parent) => placed[*parent].inverse() * *matrix,
        None => *matrix,
    })
    .collect()
}

/// Matrices relative to the space of the roots, of those relative to the parents. Parents have
/// shorter paths, so the way up ends.
fn placed(relative: &[DMat4], parents: &[Option<usize>]) -> Vec<DMat4> {
    let place = |joint: usize| {
        let above = std::iter::successors(Some(joint), |joint| parents[*joint]);
        above.fold(DMat4::IDENTITY, |product, joint| relative[joint] * product)
    };
    (0..relative.len()).map(place).collect()
}
