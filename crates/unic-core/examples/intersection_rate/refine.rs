//! Refinement of a mesh to any number of vertices, with the same shape.

use glam::Vec3;
use std::collections::HashMap;
use unic_core::{mesh::TriMesh, skinning::SkinningWeights};

/// Mesh with vertices added at the midpoints of edges.
pub(crate) struct Refined {
    pub(crate) mesh: TriMesh,
    /// Two earlier vertices between which each added vertex lies, in order.
    parents: Vec<[u32; 2]>,
}

impl Refined {
    /// Splits the longest edges until the mesh has a number of vertices.
    pub(crate) fn new(mesh: &TriMesh, vertices: usize) -> Self {
        let mut refined = Self {
            mesh: TriMesh::new(mesh.vertices.clone(), mesh.faces.clone()).expect("a sound mesh"),
            parents: Vec::new(),
        };
        while refined.mesh.vertices.len() < vertices {
            refined.split_longest(vertices);
        }
        refined
    }

    /// Splits the longest edges, at most one of each face.
    fn split_longest(&mut self, vertices: usize) {
        let mut faces_of_edge: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
        for (face, &[a, b, c]) in self.mesh.faces.iter().enumerate() {
            for [u, v] in [[a, b], [b, c], [c, a]] {
                faces_of_edge.entry([u.min(v), u.max(v)]).or_default().push(face);
            }
        }
        let length =
            |[a, b]: [u32; 2]| self.mesh.vertices[a as usize].distance(self.mesh.vertices[b as usize]);
        let mut edges: Vec<_> = faces_of_edge
            .into_iter()
            .map(|(e, f)| (length(e), e, f))
            .collect();
        edges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut touched = vec![false; self.mesh.faces.len()];
        for (_, edge, faces) in edges {
            if self.mesh.vertices.len() == vertices {
                break;
            }
            if !faces.iter().any(|&face| touched[face]) {
                faces.iter().for_each(|&face| touched[face] = true);
                self.split(edge, &faces);
            }
        }
    }

    fn split(&mut self, [a, b]: [u32; 2], faces: &[usize]) {
        let middle = self.mesh.vertices.len() as u32;
        let sum = self.mesh.vertices[a as usize] + self.mesh.vertices[b as usize];
        self.mesh.vertices.push(sum * 0.5);
        self.parents.push([a, b]);
        for &face in faces {
            let with = |end: u32| self.mesh.faces[face].map(|v| if v == end { middle } else { v });
            let halves = [with(a), with(b)];
            self.mesh.faces[face] = halves[0];
            self.mesh.faces.push(halves[1]);
        }
    }

    /// Positions of all vertices from those of the coarse mesh.
    pub(crate) fn positions(&self, coarse: &[Vec3]) -> Vec<Vec3> {
        let mut positions = coarse.to_vec();
        for &[a, b] in &self.parents {
            positions.push((positions[a as usize] + positions[b as usize]) * 0.5);
        }
        positions
    }

    /// Skinning weights of all vertices from those of the coarse mesh.
    pub(crate) fn weights(&self, coarse: &SkinningWeights) -> SkinningWeights {
        let mut rows: Vec<Vec<(usize, f32)>> = (0..coarse.len()).map(|v| coarse.row(v).collect()).collect();
        for &[a, b] in &self.parents {
            let mut row: HashMap<usize, f32> = HashMap::new();
            for &(joint, weight) in rows[a as usize].iter().chain(&rows[b as usize]) {
                *row.entry(joint).or_default() += 0.5 * weight;
            }
            rows.push(row.into_iter().collect());
        }
        let rows = rows.into_iter().map(Vec::into_iter);
        SkinningWeights::from_rows(coarse.joint_count(), rows).expect("means of sound weights")
    }
}
