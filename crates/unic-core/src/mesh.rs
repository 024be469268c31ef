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
