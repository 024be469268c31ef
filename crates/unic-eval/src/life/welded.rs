//! Rest mesh of a garment with closed seams, without what has no area.

use glam::Vec3;
use unic_core::{mesh::TriMesh, topology::weld};

/// Rest mesh of a garment whose vertices at one place are one vertex. It has no degenerate faces
/// and no vertices without faces.
#[derive(Clone, Debug)]
pub(super) struct WeldedMesh {
    /// Garment vertex of each of the N welded vertices: the first one at its place.
    pub(super) vertices: Vec<u32>,
    /// Rest shape of the N vertices, metres.
    pub(super) rest: TriMesh,
}

impl WeldedMesh {
    /// Welds the rest mesh of a garment.
    pub(super) fn new(rest: &TriMesh) -> Self {
        let welded = weld(&rest.vertices);
        let faces = rest.faces.iter().map(|face| face.map(|v| welded[v as usize]));
        let faces: Vec<[u32; 3]> = faces.filter(|face| has_area(&rest.vertices, face)).collect();
        let mut vertices: Vec<u32> = faces.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let mut index = vec![0; rest.vertices.len()];
        for (i, &vertex) in vertices.iter().enumerate() {
            index[vertex as usize] = i as u32;
        }
        let rest = TriMesh {
            vertices: vertices.iter().map(|&v| rest.vertices[v as usize]).collect(),
            faces: faces.iter().map(|face| face.map(|v| index[v as usize])).collect(),
            uvs: None,
        };
        Self { vertices, rest }
    }

    /// Returns the welded vertex of each vertex of the rest mesh that this one was made of, or none for
    /// a vertex without a face that has an area.
    pub(super) fn indices(&self, rest: &TriMesh) -> Vec<Option<u32>> {
        let index = |first: &u32| self.vertices.binary_search(first).ok();
        let welded = weld(&rest.vertices);
        welded
            .iter()
            .map(|first| index(first).map(|i| i as u32))
            .collect()
    }

    /// Returns the positions of the N welded vertices among those of all garment vertices.
    pub(super) fn gather<'a>(&'a self, positions: &'a [Vec3]) -> impl Iterator<Item = Vec3> + 'a {
        self.vertices.iter().map(|&v| positions[v as usize])
    }
}

/// Returns whether a face has an area above zero. It is false for positions that are not finite.
fn has_area(vertices: &[Vec3], face: &[u32; 3]) -> bool {
    let [a, b, c] = face.map(|v| vertices[v as usize].as_dvec3());
    (b - a).cross(c - a).length_squared() > 0.0
}
