//! Vertices that a file repeats along the seams of its texture.

use glam::Vec3;
use std::collections::HashMap;
use unic_core::character::FileMesh;
use unic_scene::Shape;

/// Mesh of which vertices at one place with equal weights are one.
pub(super) struct Welded {
    pub(super) vertices: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
    /// Entries of (index among the skin's joints, weight) for each vertex.
    pub(super) weights: Vec<Vec<(u16, f32)>>,
    /// Vertex for each vertex of the file.
    vertex_of_file: Vec<u32>,
}

impl Welded {
    /// Takes the vertices of a mesh that has a skin as they are.
    pub(super) fn as_it_is(shape: &Shape) -> Self {
        Self {
            vertices: shape.points.clone(),
            faces: shape.faces.clone(),
            weights: shape.weights.clone(),
            vertex_of_file: (0..shape.points.len() as u32).collect(),
        }
    }

    /// Welds a mesh that has a skin.
    pub(super) fn new(shape: &Shape) -> Self {
        let mut welded = Self {
            vertices: Vec::new(),
            faces: Vec::new(),
            weights: Vec::new(),
            vertex_of_file: Vec::new(),
        };
        let mut vertices: HashMap<Vec<u32>, u32> = HashMap::new();
        for (position, row) in shape.points.iter().zip(&shape.weights) {
            // Adding zero makes -0 and 0 one place.
            let place = (*position + Vec3::ZERO).to_array().map(f32::to_bits);
            let weights = row
                .iter()
                .flat_map(|(joint, weight)| [u32::from(*joint), weight.to_bits()]);
            let key: Vec<u32> = place.into_iter().chain(weights).collect();
            let next = welded.vertices.len() as u32;
            let vertex = *vertices.entry(key).or_insert(next);
            if vertex == next {
                welded.vertices.push(*position);
                welded.weights.push(row.clone());
            }
            welded.vertex_of_file.push(vertex);
        }
        let vertex = |corner: u32| welded.vertex_of_file.get(corner as usize).copied();
        for corners in &shape.faces {
            // Triangles that the weld closes have no area.
            if let [Some(a), Some(b), Some(c)] = corners.map(vertex)
                && a != b
                && b != c
                && c != a
            {
                welded.faces.push([a, b, c]);
            }
        }
        welded
    }

    /// Mesh of a file with these faces, if vertices of it were welded.
    pub(super) fn file_mesh(&self, faces: &[[u32; 3]]) -> Option<FileMesh> {
        (self.vertices.len() < self.vertex_of_file.len()).then(|| FileMesh {
            body_vertices: self.vertex_of_file.clone(),
            faces: faces.to_vec(),
        })
    }
}
