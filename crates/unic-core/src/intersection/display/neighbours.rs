//! Which places of a garment are connected.

use crate::topology::{edges, weld};
use glam::Vec3;

/// The places of a garment, which may hold several vertices of a seam, and the edges between them.
#[derive(Clone, Debug)]
pub(super) struct Neighbours {
    /// The first vertex at the place of each vertex stands for the place.
    place_of_vertex: Vec<u32>,
    /// Neighbours of place i are `around[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    around: Vec<u32>,
}

impl Neighbours {
    pub(super) fn new(vertices: &[Vec3], faces: &[[u32; 3]]) -> Self {
        let place_of_vertex = weld(vertices);
        let welded: Vec<_> = (faces.iter())
            .map(|f| f.map(|v| place_of_vertex[v as usize]))
            .collect();
        let mut directed: Vec<[u32; 2]> = (edges(&welded).into_iter())
            .flat_map(|[a, b]| [[a, b], [b, a]])
            .collect();
        directed.sort_unstable();
        let count = |place: u32| directed.partition_point(|&[from, _]| from < place) as u32;
        Self {
            starts: (0..=vertices.len() as u32).map(count).collect(),
            around: directed.iter().map(|&[_, to]| to).collect(),
            place_of_vertex,
        }
    }

    pub(super) fn place(&self, vertex: usize) -> usize {
        self.place_of_vertex[vertex] as usize
    }

    /// Mean over the neighbours of a place; zero without any.
    pub(super) fn mean(&self, place: usize, values: &[Vec3]) -> Vec3 {
        let around = &self.around[self.starts[place] as usize..self.starts[place + 1] as usize];
        let sum: Vec3 = around.iter().map(|&i| values[i as usize]).sum();
        sum / around.len().max(1) as f32
    }
}
