//! Meshes whose points change over time.

use super::{RiggedFormat, file::SceneFile, request};
use crate::{
    error::{Error, Result},
    frames::VertexFrames,
    mesh_names::{listed, named},
};
use std::path::Path;
use unic_core::mesh::TriMesh;
use unic_scene::{Assumed, Content, Mesh};

/// Animation of the points of one mesh; metres, +Y up, world space.
#[derive(Clone, Debug)]
pub struct ScenePoints {
    /// Name of the mesh.
    pub name: String,
    /// Points of every frame.
    pub frames: VertexFrames,
    /// Frames per second, if the file tells.
    pub fps: Option<f32>,
    /// First frame with its faces.
    pub mesh: TriMesh,
    /// Descriptions of what was converted, one sentence each.
    pub notes: Vec<String>,
}

/// Reads the animated points of one mesh: the one of the name `object`, else the only one that has
/// another number of vertices than the character's body.
///
/// # Errors
/// A damaged file; no such mesh, several; a mesh whose points do not change.
pub fn read_scene_points(
    path: &Path,
    format: RiggedFormat,
    object: Option<&str>,
    body_vertices: usize,
    assumed: &Assumed,
) -> Result<ScenePoints> {
    let outline = SceneFile::read(path, format, &request(Content::Outline, assumed))?;
    let meshes = &outline.scene.meshes;
    let index = match object {
        Some(name) => named(path, &outline.mesh_names(), name)?,
        None => only_but(&outline, body_vertices)?,
    };
    let name = &meshes[index].name;
    refuse_still(&outline, &meshes[index], format)?;
    let file = SceneFile::read(path, format, &request(Content::Points(index), assumed))?;
    let mut notes = file.scene.notes;
    if meshes.len() > 1 {
        notes.push(format!("mesh {name} of {} in the file", meshes.len()));
    }
    let mesh = file.scene.meshes.into_iter().nth(index);
    let points = mesh.and_then(|mesh| Some((mesh.shape?, mesh.points?)));
    let Some((shape, points)) = points.filter(|(_, points)| !points.frames.is_empty()) else {
        return Err(Error::content(
            path,
            format!("the points of the mesh {name}"),
            "none",
        ));
    };
    let (count, vertices) = (points.frames.len(), shape.points.len());
    let first = points.frames[0].clone();
    let data: Vec<f32> = (points.frames.iter().flatten())
        .flat_map(|point| point.to_array())
        .collect();
    let Some(frames) = VertexFrames::new(data, count, vertices) else {
        return Err(Error::content(
            path,
            "a mesh with vertices",
            format!("none in {name}"),
        ));
    };
    let mesh = TriMesh::new(first, shape.faces).map_err(|source| Error::Mesh {
        path: path.to_path_buf(),
        source,
    })?;
    Ok(ScenePoints {
        name: name.clone(),
        frames,
        fps: points.fps,
        mesh,
        notes,
    })
}

/// Returns the only mesh whose points change, or the only one of those with another number of
/// vertices than the body.
fn only_but(file: &SceneFile, body_vertices: usize) -> Result<usize> {
    let meshes = &file.scene.meshes;
    let animated = || meshes.iter().enumerate().filter(|(_, mesh)| mesh.samples > 1);
    let indices: Vec<usize> = animated().map(|(index, _)| index).collect();
    let others: Vec<usize> = animated()
        .filter(|(_, mesh)| mesh.vertices != body_vertices)
        .map(|(index, _)| index)
        .collect();
    let names = || listed(&file.mesh_names());
    match (meshes.as_slice(), indices.as_slice(), others.as_slice()) {
        ([], _, _) => Err(file.error("a mesh whose points change over time", "no mesh")),
        // Refused with its reason by the caller.
        ([_], _, _) => Ok(0),
        (_, [], _) => {
            let found = format!("none of that kind among {}", names());
            Err(file.error("a mesh whose points change over time", found))
        }
        (_, [mesh], _) | (_, _, [mesh]) => Ok(*mesh),
        _ => {
            let found = format!("{}; --object names the garment", names());
            Err(file.error("one animated mesh beside that of the character", found))
        }
    }
}

fn refuse_still(file: &SceneFile, mesh: &Mesh, format: RiggedFormat) -> Result<()> {
    if mesh.samples > 1 {
        return Ok(());
    }
    let expected = format!("a mesh whose points change over time, for {}", mesh.name);
    let found = match (format, mesh.skin) {
        (RiggedFormat::Usd, None) => "one whose points stay".to_owned(),
        (RiggedFormat::Usd, Some(_)) => {
            "one that a skeleton moves: export its points in every frame".to_owned()
        }
        (RiggedFormat::Fbx | RiggedFormat::Gltf, _) => {
            let name = format.name();
            format!("{name}, of which no points over time are read: export Alembic, USD or PC2")
        }
    };
    Err(file.error(expected, found))
}
