//! Meshes of FBX files.

use super::name_of;
use crate::{
    fault::Fault,
    request::Content,
    scene::{Mesh, Scene, Shape},
};
use glam::DVec3;

/// Adds the meshes of a file, with shapes of those with a skin if they are asked for.
/// `places` are those of the file's skins in the scene.
pub(super) fn read(
    file: &ufbx::Scene,
    content: Content,
    places: &[Option<usize>],
    scene: &mut Scene,
) -> Result<(), Fault> {
    for mesh in file.meshes.iter() {
        // A mesh that no node shows is not a part of the scene.
        let Some(node) = mesh.element.instances.first() else {
            continue;
        };
        let name = name_of(&node.element, "node");
        let place = |skin: &ufbx::SkinDeformer| *places.get(skin.element.typed_id as usize)?;
        let skins = mesh.skin_deformers.iter();
        let (skin, place) = skins.filter_map(|skin| Some((skin, place(skin)?))).next().unzip();
        let is_asked = match content {
            Content::Skinned => skin.is_some(),
            // The points of FBX meshes do not change; callers say so.
            Content::Outline | Content::Motion | Content::Points(_) => false,
        };
        if !mesh.cache_deformers.is_empty() {
            scene
                .notes
                .push(format!("the point cache of the mesh {name} is not read"));
        }
        if let Some(skin) = skin
            && skin.skinning_method != ufbx::SkinningMethod::Linear
            && is_asked
        {
            scene.notes.push(format!(
                "the mesh {name} asks for another skinning than linear blending, which is used"
            ));
        }
        scene.meshes.push(Mesh {
            vertices: mesh.num_vertices,
            triangles: mesh.num_triangles,
            samples: 0,
            skin: place,
            shape: is_asked
                .then(|| shape(mesh, skin.map(|skin| &**skin)))
                .transpose()?,
            points: None,
            name,
        });
    }
    Ok(())
}

fn shape(mesh: &ufbx::Mesh, skin: Option<&ufbx::SkinDeformer>) -> Result<Shape, Fault> {
    let points = mesh.vertices.iter();
    Ok(Shape {
        points: points.map(|v| DVec3::new(v.x, v.y, v.z).as_vec3()).collect(),
        faces: faces(mesh)?,
        weights: match skin {
            Some(skin) => weights(mesh.num_vertices, skin)?,
            None => Vec::new(),
        },
    })
}

/// Cuts the polygons into triangles.
fn faces(mesh: &ufbx::Mesh) -> Result<Vec<[u32; 3]>, Fault> {
    let mut faces = Vec::with_capacity(mesh.num_triangles);
    let mut corners = vec![0; 3 * mesh.max_face_triangles];
    let vertex = |corner: u32| mesh.vertex_indices.get(corner as usize).copied();
    for face in mesh.faces.iter() {
        let triangles = ufbx::triangulate_face(&mut corners, mesh, *face) as usize;
        for triangle in corners.chunks_exact(3).take(triangles) {
            let [Some(a), Some(b), Some(c)] = [triangle[0], triangle[1], triangle[2]].map(vertex) else {
                return Err(Fault::new("faces of vertices of the mesh", "others"));
            };
            faces.push([a, b, c]);
        }
    }
    Ok(faces)
}

/// Entries of (index among the joints, weight) for each vertex.
fn weights(vertices: usize, skin: &ufbx::SkinDeformer) -> Result<Vec<Vec<(u16, f32)>>, Fault> {
    let wrong = |found: String| Fault::new(format!("weights of {vertices} vertices"), found);
    if skin.vertices.len() < vertices {
        return Err(wrong(skin.vertices.len().to_string()));
    }
    let row = |vertex: &ufbx::SkinVertex| -> Option<Vec<(u16, f32)>> {
        let begin = vertex.weight_begin as usize;
        let end = begin.checked_add(vertex.num_weights as usize)?;
        let entries = skin.weights.get(begin..end)?.iter();
        entries
            .filter(|entry| entry.weight != 0.0)
            .map(|entry| Some((u16::try_from(entry.cluster_index).ok()?, entry.weight as f32)))
            .collect()
    };
    let rows = skin.vertices.iter().take(vertices);
    rows.map(|vertex| row(vertex).ok_or_else(|| wrong("weights outside the file's list".into())))
        .collect()
}
