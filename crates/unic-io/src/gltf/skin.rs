//! Skins, and meshes with the weights of their vertices.

use super::{container::Container, nodes};
use crate::error::Result;
use glam::{Mat4, Vec3};
use gltf::{Primitive, Semantic, accessor::Dimensions, mesh::Mode};
use unic_scene::{Content, Mesh, Shape, Skin};

/// Largest number of sets of four joints a vertex.
const MAX_SETS: u32 = 4;

/// Reads the skins that state the matrices of their bind pose. Also returns the place of each skin
/// of the file among them.
///
/// # Errors
/// Too few matrices, no joints, damaged data.
pub(super) fn skins(container: &Container) -> Result<(Vec<Skin>, Vec<Option<usize>>)> {
    let (mut skins, mut places) = (Vec::new(), Vec::new());
    for skin in container.document.skins() {
        let Some(binds) = skin.inverse_bind_matrices() else {
            places.push(None);
            continue;
        };
        let joints: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
        let binds = container.floats(&binds, Dimensions::Mat4)?;
        if binds.count < joints.len() || joints.is_empty() || joints.len() > usize::from(u16::MAX) {
            let expected = format!(
                "an inverse bind matrix for each of 1 to 65535 joints, here {}",
                joints.len()
            );
            return Err(container.error(expected, binds.count.to_string()));
        }
        let inverse_binds = binds.values.chunks_exact(16).map(Mat4::from_cols_slice);
        places.push(Some(skins.len()));
        skins.push(Skin {
            inverse_binds: inverse_binds.take(joints.len()).collect(),
            joints,
            world_from_mesh: None,
        });
    }
    Ok((skins, places))
}

/// Reads the meshes, one for each node that shows one; with shapes of those with a skin if they are
/// asked for. `places` and `skins` are those of [`skins`].
///
/// # Errors
/// A skinned mesh without matrices of its bind pose, meshes of lines or points, joints out of range,
/// damaged data.
pub(super) fn meshes(
    container: &Container,
    content: Content,
    skins: &[Skin],
    places: &[Option<usize>],
) -> Result<Vec<Mesh>> {
    let mut meshes = Vec::new();
    for node in container.document.nodes() {
        let Some(mesh) = node.mesh() else {
            continue;
        };
        let skin = node
            .skin()
            .map(|skin| places.get(skin.index()).copied().flatten());
        if skin == Some(None) && content != Content::Motion {
            return Err(container.error("inverse bind matrices of the skin", "none"));
        }
        let skin = skin.flatten();
        let joints = skin
            .and_then(|skin| skins.get(skin))
            .map(|skin| skin.joints.len());
        let shape = match (content, joints) {
            (Content::Skinned, Some(joints)) => Some(shape(container, &mesh, joints)?),
            _ => None,
        };
        let counted = || vertices(&mesh);
        meshes.push(Mesh {
            vertices: shape.as_ref().map_or_else(counted, |shape| shape.points.len()),
            triangles: shape.as_ref().map_or(0, |shape| shape.faces.len()),
            samples: 0,
            skin,
            shape,
            points: None,
            name: nodes::name(&node),
        });
    }
    Ok(meshes)
}

/// Number of vertices of a mesh, as its accessors state it.
fn vertices(mesh: &gltf::Mesh) -> usize {
    let positions = mesh.primitives().filter_map(|p| p.get(&Semantic::Positions));
    positions.fold(0, |sum, accessor| sum.saturating_add(accessor.count()))
}

fn shape(container: &Container, mesh: &gltf::Mesh, joints: usize) -> Result<Shape> {
    let mut shape = Shape::default();
    for primitive in mesh.primitives() {
        add(&mut shape, container, &primitive, joints)?;
    }
    Ok(shape)
}

/// Appends a primitive, a part of the mesh with one material.
fn add(shape: &mut Shape, container: &Container, primitive: &Primitive, joints: usize) -> Result<()> {
    if primitive.mode() != Mode::Triangles {
        let found = format!("{:?}", primitive.mode());
        return Err(container.error("a skinned mesh of triangles", found));
    }
    let Some(positions) = primitive.get(&Semantic::Positions) else {
        return Err(container.error("positions of the mesh", "none"));
    };
    let positions = container.floats(&positions, Dimensions::Vec3)?;
    let first = shape.points.len() as u32;
    shape
        .weights
        .extend(influences(container, primitive, positions.count, joints)?);
    shape
        .points
        .extend(positions.values.chunks_exact(3).map(Vec3::from_slice));
    let indices = match primitive.indices() {
        Some(indices) => container.integers(&indices, Dimensions::Scalar)?,
        // Without indices every three vertices are a triangle.
        None => (0..positions.count as u32).collect(),
    };
    let vertex = |corner: u32| ((corner as usize) < positions.count).then(|| first + corner);
    for corners in indices.chunks_exact(3) {
        let [Some(a), Some(b), Some(c)] = [corners[0], corners[1], corners[2]].map(vertex) else {
            let expected = format!("indices below {}", positions.count);
            return Err(container.error(expected, format!("{corners:?}")));
        };
        shape.faces.push([a, b, c]);
    }
    Ok(())
}

/// Reads the joints and weights of each vertex of a primitive.
fn influences(
    container: &Container,
    primitive: &Primitive,
    vertices: usize,
    joint_count: usize,
) -> Result<Vec<Vec<(u16, f32)>>> {
    let mut rows = vec![Vec::new(); vertices];
    for set in 0..MAX_SETS {
        let (joints, weights) = (
            primitive.get(&Semantic::Joints(set)),
            primitive.get(&Semantic::Weights(set)),
        );
        let (Some(joints), Some(weights)) = (joints, weights) else {
            break;
        };
        let joints = container.integers(&joints, Dimensions::Vec4)?;
        let weights = container.floats(&weights, Dimensions::Vec4)?;
        if weights.count != vertices || joints.len() != weights.values.len() {
            let expected = format!("joints and weights of {vertices} vertices");
            return Err(container.error(expected, format!("{} and {}", joints.len() / 4, weights.count)));
        }
        for (entry, (joint, weight)) in joints.into_iter().zip(weights.values).enumerate() {
            if weight == 0.0 {
                continue;
            }
            let in_range = u16::try_from(joint)
                .ok()
                .filter(|j| usize::from(*j) < joint_count);
            let Some(joint) = in_range else {
                let expected = format!("joints below {joint_count}");
                return Err(container.error(expected, joint.to_string()));
            };
            // Four entries for each vertex, by the count above.
            rows[entry / 4].push((joint, weight));
        }
    }
    Ok(rows)
}
