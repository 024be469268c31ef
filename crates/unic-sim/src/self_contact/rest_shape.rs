//! The garment at rest: adjacency, and distances that layers have by design.

use crate::body::corners_of;
use glam::Vec3;
use unic_core::{mesh::TriMesh, surface::Triangle, topology::edges};

/// The garment at rest, which is constant during a simulation.
#[derive(Clone, Debug)]
pub(super) struct RestShape {
    /// Positions at rest, metres.
    vertices: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
    /// Row starts of `neighbours`: those of vertex i are `neighbours[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
    /// Mean edge length, metres.
    pub(super) mean_edge_m: f32,
}

impl RestShape {
    pub(super) fn new(rest: &TriMesh) -> Self {
        let edges = edges(&rest.faces);
        // Both directions of each edge, sorted: the rows of a compressed adjacency list.
        let mut pairs: Vec<[u32; 2]> = edges.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        pairs.sort_unstable();
        let row = |v: u32| pairs.partition_point(|&[at, _]| at < v) as u32;
        let length = |&[a, b]: &[u32; 2]| rest.vertices[a as usize].distance(rest.vertices[b as usize]);
        Self {
            starts: (0..=rest.vertices.len() as u32).map(row).collect(),
            neighbours: pairs.into_iter().map(|[_, other]| other).collect(),
            mean_edge_m: edges.iter().map(length).sum::<f32>() / edges.len().max(1) as f32,
            vertices: rest.vertices.clone(),
            faces: rest.faces.clone(),
        }
    }

    pub(super) fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// Returns whether a vertex is a corner of the face or joined to one by an edge.
    #[inline]
    pub(super) fn is_neighbour(&self, vertex: u32, face: [u32; 3]) -> bool {
        let row = self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize;
        face.contains(&vertex) || self.neighbours[row].iter().any(|other| face.contains(other))
    }

    /// Returns the distance between a vertex and a face at rest, metres.
    pub(super) fn distance(&self, vertex: u32, face: [u32; 3]) -> f32 {
        let corners = corners_of(&self.vertices, face);
        let hit = Triangle::new(corners).closest(self.vertices[vertex as usize]);
        hit.squared_distance.sqrt()
    }
}
