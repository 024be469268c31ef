//! Triangle meshes.

use glam::{Vec2, Vec3};
use thiserror::Error;

/// Triangles over shared vertices; the order of the vertices is meaningful and never changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Positions, metres.
    pub vertices: Vec<Vec3>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
    /// Texture coordinates where the source had them.
    pub uvs: Option<Uvs>,
}

/// Texture coordinates, indexed by corner so that seams need no split vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Uvs {
    /// Coordinates, v up.
    pub coordinates: Vec<Vec2>,
    /// Indices into `coordinates`, one triple a face of the mesh.
    pub faces: Vec<[u32; 3]>,
}

/// What is wrong with a mesh.
#[derive(Debug, Error, PartialEq)]
pub enum MeshError {
    /// A corner beyond the vertices.
    #[error("mesh: face {face} names vertex {index}, but there are {vertices}")]
    Index {
        /// The face.
        face: usize,
        /// The index found.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// NaN or infinity.
    #[error("mesh: the position of vertex {vertex} is not finite")]
    NotFinite {
        /// The vertex.
        vertex: usize,
    },
}

impl TriMesh {
    /// A mesh without texture coordinates.
    ///
    /// # Errors
    /// Indices out of range, positions that are not finite.
    pub fn new(vertices: Vec<Vec3>, faces: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let mesh = Self {
            vertices,
            faces,
            uvs: None,
        };
        mesh.check()?;
        Ok(mesh)
    }

    /// # Errors
    /// As [`TriMesh::new`].
    pub fn check(&self) -> Result<(), MeshError> {
        let vertices = self.vertices.len();
        if let Some(vertex) = self.vertices.iter().position(|v| !v.is_finite()) {
            return Err(MeshError::NotFinite { vertex });
        }
        for (face, corners) in self.faces.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&c| c as usize >= vertices) {
                return Err(MeshError::Index {
                    face,
                    index,
                    vertices,
                });
            }
        }
        Ok(())
    }
}

/// Unit normals of the vertices, weighted by area, into `out`: the direction of the sum of the
/// normals of the faces around. Zero for a vertex without faces, or whose faces are all degenerate
/// or cancel, so that nothing is on the inner side of its tangent plane.
///
/// Vertices that a seam splits have each the normal of their own side.
///
/// # Panics
/// When a face names a vertex that does not exist; [`TriMesh::check`] tells.
pub fn vertex_normals(vertices: &[Vec3], faces: &[[u32; 3]], out: &mut Vec<Vec3>) {
    out.clear();
    out.resize(vertices.len(), Vec3::ZERO);
    for face in faces {
        let [a, b, c] = face.map(|v| vertices[v as usize]);
        // The length of the cross product is twice the area: the weight comes with it.
        let normal = (b - a).cross(c - a);
        face.iter().for_each(|&v| out[v as usize] += normal);
    }
    out.iter_mut().for_each(|n| *n = n.normalize_or_zero());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::sphere;

    #[test]
    fn normals_of_a_sphere_point_away_from_its_centre() {
        let sphere = sphere(3, 0.02);
        let mut normals = vec![Vec3::X; 3];
        vertex_normals(&sphere.vertices, &sphere.faces, &mut normals);
        assert_eq!(normals.len(), sphere.vertices.len());
        for (normal, vertex) in normals.iter().zip(&sphere.vertices) {
            assert!((normal.length() - 1.0).abs() < 1e-6);
            assert!(normal.dot(vertex.normalize()) > 0.999);
        }
    }

    #[test]
    fn larger_faces_weigh_more() {
        // At vertex 0 meet a face of area 1/2 towards +z and one of area 3/2 towards +x.
        let vertices = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z * 3.0];
        let mut normals = Vec::new();
        vertex_normals(&vertices, &[[0, 1, 2], [0, 2, 3]], &mut normals);
        assert!((normals[0] - Vec3::new(3.0, 0.0, 1.0).normalize()).length() < 1e-6);
    }

    #[test]
    fn no_face_no_normal() {
        let vertices = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::Y];
        let mut normals = Vec::new();
        vertex_normals(&vertices, &[[0, 1, 2]], &mut normals);
        assert_eq!(normals, [Vec3::ZERO; 4]);
    }

    #[test]
    fn meshes_are_checked() {
        let face = vec![[0, 1, 2]];
        let error = TriMesh::new(vec![Vec3::ZERO; 2], face.clone());
        assert!(matches!(error, Err(MeshError::Index { index: 2, .. })));
        let error = TriMesh::new(vec![Vec3::NAN; 3], face);
        assert_eq!(error, Err(MeshError::NotFinite { vertex: 0 }));
    }
}
