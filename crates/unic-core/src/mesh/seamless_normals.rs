//! Normals that continue across vertices which a mesh repeats.

use super::{TriMesh, vertex_normals};
use crate::topology::weld;
use glam::Vec3;

/// Vertex normals of a mesh, equal for vertices at one place of the rest shape.
///
/// Meshes repeat vertices along the seams of panels and textures. Each side by itself would have a
/// normal of its own, and shading would show the seam. A repeated vertex whose side faces away from
/// the first one, as on the back of a doubled cloth, keeps its own. Borders that lie at one place at
/// rest and part later, as of an open jacket, share their normals too.
#[derive(Clone, Debug)]
pub struct SeamlessNormals {
    /// Vertex whose normal each vertex has.
    sources: Vec<u32>,
    /// Faces of these vertices.
    faces: Vec<[u32; 3]>,
}

impl SeamlessNormals {
    /// Finds the repeated vertices of a mesh by its positions, which are those of the rest shape.
    ///
    /// # Panics
    /// When a face names a vertex that does not exist; [`TriMesh::check`] finds it.
    pub fn new(mesh: &TriMesh) -> Self {
        let mut own = Vec::new();
        vertex_normals(&mesh.vertices, &mesh.faces, &mut own);
        let mut sources = weld(&mesh.vertices);
        for (v, source) in (0u32..).zip(&mut sources) {
            if own[v as usize].dot(own[*source as usize]) <= 0.0 {
                *source = v;
            }
        }
        let merged = |face: &[u32; 3]| face.map(|corner| sources[corner as usize]);
        let faces = mesh.faces.iter().map(merged).collect();
        Self { sources, faces }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Returns whether the mesh has no vertices.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Computes the unit normals of the mesh with these positions into `out`, as [`vertex_normals`]
    /// does for one side of a seam.
    ///
    /// # Panics
    /// If there are fewer positions than vertices.
    pub fn compute(&self, positions: &[Vec3], out: &mut Vec<Vec3>) {
        vertex_normals(positions, &self.faces, out);
        // A source never has another source, so that the order does not matter.
        for (v, &source) in self.sources.iter().enumerate() {
            out[v] = out[source as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::sphere;

    /// Mesh in which every face has vertices of its own.
    fn exploded(mesh: &TriMesh) -> (TriMesh, Vec<u32>) {
        let sources = mesh.faces.as_flattened().to_vec();
        let vertices = sources.iter().map(|&v| mesh.vertices[v as usize]).collect();
        let faces = (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
        (TriMesh::new(vertices, faces.collect()).unwrap(), sources)
    }

    #[test]
    fn a_mesh_of_separate_faces_is_as_smooth_as_the_whole_one() {
        let whole = sphere(6, 0.1);
        let (separate, sources) = exploded(&whole);
        let moved = |mesh: &TriMesh| -> Vec<Vec3> {
            let bend = |v: &Vec3| *v + Vec3::X * v.y * v.y;
            mesh.vertices.iter().map(bend).collect()
        };
        let (mut expected, mut found) = (Vec::new(), Vec::new());
        vertex_normals(&moved(&whole), &whole.faces, &mut expected);
        SeamlessNormals::new(&separate).compute(&moved(&separate), &mut found);
        for (v, &source) in sources.iter().enumerate() {
            assert!(found[v].distance(expected[source as usize]) < 1e-5, "vertex {v}");
        }
    }

    #[test]
    fn both_sides_of_a_doubled_cloth_keep_their_normals() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let vertices = [corners, corners].concat();
        let doubled = TriMesh::new(vertices, vec![[0, 1, 2], [3, 5, 4]]).unwrap();
        let mut normals = Vec::new();
        SeamlessNormals::new(&doubled).compute(&doubled.vertices, &mut normals);
        assert_eq!(normals[..3], [Vec3::Z; 3]);
        assert_eq!(normals[3..], [Vec3::NEG_Z; 3]);
    }
}
