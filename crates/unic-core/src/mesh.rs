//! Triangle meshes and their vertex normals.
//!
//! For tools that import and make characters and garments.

mod seam_split;
mod seamless_normals;

pub use seam_split::SeamSplit;
pub use seamless_normals::SeamlessNormals;

use glam::{Vec2, Vec3};
use thiserror::Error;

/// Triangle mesh with shared vertices. The order of the vertices is meaningful and never changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Positions, metres.
    pub vertices: Vec<Vec3>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
    /// Texture coordinates, if the source has any.
    pub uvs: Option<Uvs>,
}

/// Texture coordinates, indexed by corner: a seam of the texture needs no split vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Uvs {
    /// Coordinates, with v upwards.
    pub coordinates: Vec<Vec2>,
    /// Indices into `coordinates`, three for each face of the mesh.
    pub faces: Vec<[u32; 3]>,
}

impl Uvs {
    /// Returns whether there are three corners for each of these faces, all with coordinates that
    /// exist.
    pub fn fit(&self, faces: &[[u32; 3]]) -> bool {
        let count = self.coordinates.len();
        let mut corners = self.faces.iter().flatten();
        self.faces.len() == faces.len() && corners.all(|&corner| (corner as usize) < count)
    }
}

/// Error of a mesh that is not valid.
#[derive(Debug, Error, PartialEq)]
pub enum MeshError {
    /// Face with a vertex index beyond the vertices.
    #[error("mesh: face {face} names vertex {index}, but there are {vertices}")]
    Index {
        /// Index of the face.
        face: usize,
        /// Vertex index that the face names.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// Vertex of a file with an index beyond the vertices of the body.
    #[error("mesh: vertex {vertex} of the file names vertex {index} of the body, which has {vertices}")]
    FileVertex {
        /// Index of the file's vertex.
        vertex: usize,
        /// Vertex index that it names.
        index: u32,
        /// Number of vertices of the body.
        vertices: usize,
    },
    /// Position that is NaN or infinite.
    #[error("mesh: the position of vertex {vertex} is not finite")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
}

impl TriMesh {
    /// Makes a mesh without texture coordinates.
    ///
    /// # Errors
    /// Fails on indices out of range and on positions that are not finite.
    pub fn new(vertices: Vec<Vec3>, faces: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let mesh = Self {
            vertices,
            faces,
            uvs: None,
        };
        mesh.check()?;
        Ok(mesh)
    }

    /// Checks the indices of the faces and the positions.
    ///
    /// # Errors
    /// Fails on indices out of range and on positions that are not finite.
    pub fn check(&self) -> Result<(), MeshError> {
        let vertices = self.vertices.len();
        if let Some(vertex) = self.vertices.iter().position(|v| !v.is_finite()) {
            return Err(MeshError::NotFinite { vertex });
        }
        check_faces(&self.faces, vertices)
    }
}

/// Checks that faces name vertices below `vertices`.
///
/// # Errors
/// The first face with another.
pub(crate) fn check_faces(faces: &[[u32; 3]], vertices: usize) -> Result<(), MeshError> {
    let far = |(face, corners): (usize, &[u32; 3])| {
        let index = corners.iter().copied().find(|&c| c as usize >= vertices)?;
        Some(MeshError::Index {
            face,
            index,
            vertices,
        })
    };
    faces.iter().enumerate().find_map(far).map_or(Ok(()), Err)
}

/// Computes the unit normals of the vertices into `out`: the area-weighted mean of the faces around
/// each.
///
/// The normal is zero for a vertex without faces, or whose faces are all degenerate or cancel:
/// nothing is then on the inner side of its tangent plane. The vertices of a split seam have each
/// the normal of their own side.
///
/// # Panics
/// When a face names a vertex that does not exist; [`TriMesh::check`] finds it.
pub fn vertex_normals(vertices: &[Vec3], faces: &[[u32; 3]], out: &mut Vec<Vec3>) {
    out.clear();
    out.resize(vertices.len(), Vec3::ZERO);
    for face in faces {
        let [a, b, c] = face.map(|v| vertices[v as usize]);
        // The length of the cross product is twice the area, so the sum is weighted by area.
        let normal = (b - a).cross(c - a);
        face.iter().for_each(|&v| out[v as usize] += normal);
    }
    out.iter_mut().for_each(|n| *n = n.normalize_or_zero());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::sphere;

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
    fn vertices_without_sound_faces_have_zero_normals() {
        let vertices = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::Y];
        let mut normals = Vec::new();
        vertex_normals(&vertices, &[[0, 1, 2]], &mut normals);
        assert_eq!(normals, [Vec3::ZERO; 4]);
    }

    #[test]
    fn invalid_meshes_are_refused() {
        let face = vec![[0, 1, 2]];
        let error = TriMesh::new(vec![Vec3::ZERO; 2], face.clone());
        assert!(matches!(error, Err(MeshError::Index { index: 2, .. })));
        let error = TriMesh::new(vec![Vec3::NAN; 3], face);
        assert_eq!(error, Err(MeshError::NotFinite { vertex: 0 }));
    }
}
