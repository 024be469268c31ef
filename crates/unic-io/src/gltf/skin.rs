//! Skinned meshes: the vertices, triangles and weights of a body.

use super::container::Container;
use crate::error::Result;
use glam::{Mat4, Vec3};
use gltf::{Node, Primitive, Semantic, accessor::Dimensions, mesh::Mode};
use std::collections::HashMap;

/// Largest number of sets of four joints a vertex.
const MAX_SETS: u32 = 4;
/// Number of names that an error lists.
const LISTED_NAMES: usize = 12;

/// A mesh with its skin, in the space of the mesh.
pub(super) struct SkinnedMesh {
    pub(super) name: String,
    /// Vertices of which those at one place with equal weights are one.
    pub(super) vertices: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
    /// Entries of (index among `joints`, weight) for each vertex.
    pub(super) weights: Vec<Vec<(u16, f32)>>,
    /// Vertex for each vertex of the file, which repeats those along seams of its texture.
    pub(super) vertex_of_file: Vec<u32>,
    /// Nodes of the joints.
    pub(super) joints: Vec<usize>,
    /// `joint_from_mesh` of each joint at bind time.
    pub(super) inverse_binds: Vec<Mat4>,
}

impl SkinnedMesh {
    /// Reads the only skinned mesh of a file.
    ///
    /// # Errors
    /// None, several; a skin without inverse bind matrices; meshes without triangles or weights;
    /// joints out of range.
    pub(super) fn read(container: &Container) -> Result<Self> {
        let skinned: Vec<Node> = (container.document.nodes())
            .filter(|node| node.skin().is_some() && node.mesh().is_some())
            .collect();
        let node = match skinned.as_slice() {
            [node] => node,
            [] => return Err(container.error("a skinned mesh", "none")),
            several => {
                let found = format!("{}: export the body alone", names(several));
                return Err(container.error("one skinned mesh", found));
            }
        };
        let (Some(skin), Some(mesh)) = (node.skin(), node.mesh()) else {
            return Err(container.error("a skinned mesh", "none"));
        };
        let joints: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
        let Some(binds) = skin.inverse_bind_matrices() else {
            return Err(container.error("inverse bind matrices of the skin", "none"));
        };
        let binds = container.floats(&binds, Dimensions::Mat4)?;
        if binds.count < joints.len() || joints.is_empty() || joints.len() > usize::from(u16::MAX) {
            let expected = format!(
                "an inverse bind matrix for each of 1 to 65535 joints, here {}",
                joints.len()
            );
            return Err(container.error(expected, binds.count.to_string()));
        }
        let inverse_binds = binds.values.chunks_exact(16).map(Mat4::from_cols_slice);
        let mut read = Self {
            name: name(node),
            vertices: Vec::new(),
            faces: Vec::new(),
            weights: Vec::new(),
            vertex_of_file: Vec::new(),
            inverse_binds: inverse_binds.take(joints.len()).collect(),
            joints,
        };
        let mut welded = HashMap::new();
        for primitive in mesh.primitives() {
            read.add(container, &primitive, &mut welded)?;
        }
        match read.faces.is_empty() {
            true => Err(container.error("a skinned mesh with triangles", "none")),
            false => Ok(read),
        }
    }

    /// Appends a primitive, a part of the mesh with one material.
    fn add(
        &mut self,
        container: &Container,
        primitive: &Primitive,
        welded: &mut HashMap<Vec<u32>, u32>,
    ) -> Result<()> {
        if primitive.mode() != Mode::Triangles {
            let found = format!("{:?}", primitive.mode());
            return Err(container.error("a skinned mesh of triangles", found));
        }
        let Some(positions) = primitive.get(&Semantic::Positions) else {
            return Err(container.error("positions of the mesh", "none"));
        };
        let positions = container.floats(&positions, Dimensions::Vec3)?;
        let influences = self.influences(container, primitive, positions.count)?;
        let first = self.vertex_of_file.len();
        for (position, row) in positions.values.chunks_exact(3).zip(influences) {
            let position = Vec3::from_slice(position);
            // Adding zero makes -0 and 0 one place.
            let place = (position + Vec3::ZERO).to_array().map(f32::to_bits);
            let weights = row
                .iter()
                .flat_map(|(joint, weight)| [u32::from(*joint), weight.to_bits()]);
            let key: Vec<u32> = place.into_iter().chain(weights).collect();
            let next = self.vertices.len() as u32;
            let vertex = *welded.entry(key).or_insert(next);
            if vertex == next {
                self.vertices.push(position);
                self.weights.push(row);
            }
            self.vertex_of_file.push(vertex);
        }
        let indices = match primitive.indices() {
            Some(indices) => container.integers(&indices, Dimensions::Scalar)?,
            // Without indices every three vertices are a triangle.
            None => (0..positions.count as u32).collect(),
        };
        for corners in indices.chunks_exact(3) {
            let vertex = |corner: u32| {
                let own = self.vertex_of_file.get(first..)?;
                own.get(corner as usize).copied()
            };
            let [Some(a), Some(b), Some(c)] = [corners[0], corners[1], corners[2]].map(vertex) else {
                let expected = format!("indices below {}", positions.count);
                return Err(container.error(expected, format!("{corners:?}")));
            };
            // Triangles that the weld closes have no area.
            if a != b && b != c && c != a {
                self.faces.push([a, b, c]);
            }
        }
        Ok(())
    }

    /// Reads the joints and weights of each vertex of a primitive.
    fn influences(
        &self,
        container: &Container,
        primitive: &Primitive,
        vertices: usize,
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
                    .filter(|j| usize::from(*j) < self.joints.len());
                let Some(joint) = in_range else {
                    let expected = format!("joints below {}", self.joints.len());
                    return Err(container.error(expected, joint.to_string()));
                };
                // Four entries for each vertex, by the count above.
                rows[entry / 4].push((joint, weight));
            }
        }
        Ok(rows)
    }
}

pub(super) fn name(node: &Node) -> String {
    let name = node.name().filter(|name| !name.is_empty());
    name.map_or_else(|| format!("node_{}", node.index()), str::to_owned)
}

fn names(nodes: &[Node]) -> String {
    let names: Vec<String> = nodes.iter().map(name).collect();
    match names.split_at_checked(LISTED_NAMES) {
        Some((first, more)) if !more.is_empty() => format!("{} and {} more", first.join(", "), more.len()),
        _ => names.join(", "),
    }
}
