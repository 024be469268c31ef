//! The body of a file: its skinned mesh with its skeleton.

use super::{
    RiggedFormat,
    file::SceneFile,
    rig::{Binds, Rig},
    weld::Welded,
};
use crate::error::{Error, Result};
use glam::Vec3;
use std::collections::{HashMap, HashSet};
use unic_core::{character::Character, mesh::TriMesh, skinning::SkinningWeights};
use unic_scene::Skin;

/// A character with the vertices of its file.
pub(super) struct RiggedBody {
    pub(super) character: Character,
    pub(super) rig: Rig,
    /// Name of the mesh.
    pub(super) name: String,
}

impl RiggedBody {
    /// Makes the skinned mesh that is called `body`, or the only one, with its skeleton.
    ///
    /// # Errors
    /// No such mesh, several; several roots without a node above them; scales that differ by
    /// axis, mirrored meshes; vertices without weight.
    pub(super) fn read(file: &SceneFile, body: Option<&str>) -> Result<Self> {
        let mesh = file.skinned(body)?;
        let skin = mesh.skin.and_then(|skin| file.scene.skins.get(skin));
        let (Some(skin), Some(shape)) = (skin, &mesh.shape) else {
            return Err(file.error("a skinned mesh", "none"));
        };
        if shape.faces.is_empty() {
            return Err(file.error("a skinned mesh with triangles", "none"));
        }
        // Texture coordinates of FBX and USD belong to corners, so that their vertices have no copies.
        let welded = match file.format {
            RiggedFormat::Gltf => Welded::new(shape),
            RiggedFormat::Fbx | RiggedFormat::Usd => Welded::as_it_is(shape),
        };
        let weighted = weighted_nodes(skin, &welded);
        let (mut rig, rest_from_mesh) = Rig::new(file, Binds::of_skin(skin), &weighted)?;
        let file_mesh = welded.file_mesh(&shape.faces);
        if let Some(mesh) = &file_mesh {
            rig.notes.push(format!(
                "{} of {} vertices remain where copies along seams are welded",
                welded.vertices.len(),
                mesh.body_vertices.len()
            ));
        }
        let vertices: Vec<Vec3> = (welded.vertices.iter())
            .map(|v| rest_from_mesh.transform_point3(*v))
            .collect();
        let body = TriMesh::new(vertices, welded.faces).map_err(|source| Error::Mesh {
            path: file.path.clone(),
            source,
        })?;
        let weights = weights(skin, &welded.weights, &rig).map_err(|source| Error::Weights {
            path: file.path.clone(),
            source,
        })?;
        Ok(Self {
            character: Character {
                body,
                skeleton: rig.skeleton(file)?,
                weights,
                file_mesh,
            },
            rig,
            name: mesh.name.clone(),
        })
    }
}

/// Nodes that move a vertex.
fn weighted_nodes(skin: &Skin, welded: &Welded) -> HashSet<usize> {
    let entries = welded.weights.iter().flatten();
    entries
        .filter_map(|(joint, _)| skin.joints.get(usize::from(*joint)).copied())
        .collect()
}

/// Weights by the joints of a rig, of which some of the skin's may be missing.
fn weights(
    skin: &Skin,
    rows: &[Vec<(u16, f32)>],
    rig: &Rig,
) -> std::result::Result<SkinningWeights, unic_core::skinning::WeightsError> {
    let places: HashMap<usize, usize> = rig.places();
    // A joint that was left out has no weights.
    let joint = |joint: u16| {
        let node = skin.joints.get(usize::from(joint))?;
        places.get(node)
    };
    let rows = rows.iter().map(|row| {
        let entries = row.iter().filter_map(|(j, weight)| Some((*joint(*j)?, *weight)));
        entries.collect::<Vec<_>>().into_iter()
    });
    SkinningWeights::from_rows(rig.joints.len(), rows)
}
