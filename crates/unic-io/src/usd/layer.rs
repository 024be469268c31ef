//! Content of a layer without its frames, the same for both forms.

use glam::Vec2;
use unic_core::mesh::{SeamlessNormals, TriMesh};

/// Name of the prim that carries all meshes.
pub(super) const ROOT: &str = "animation";
/// Corners of each face.
pub(super) const CORNERS: i32 = 3;
/// Documentation of the layer, which names the program.
pub(super) const DOCUMENTATION: &str = concat!("unic ", env!("CARGO_PKG_VERSION"));

/// Properties of a mesh that have a time sample for each frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sampled {
    /// Smallest and largest coordinates.
    Extent,
    Normals,
    Points,
}

impl Sampled {
    pub(super) const ALL: [Sampled; 3] = [Sampled::Extent, Sampled::Normals, Sampled::Points];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Extent => "extent",
            Self::Normals => "normals",
            Self::Points => "points",
        }
    }

    /// Name of the type of its values.
    pub(super) fn type_name(self) -> &'static str {
        match self {
            Self::Extent => "float3[]",
            Self::Normals => "normal3f[]",
            Self::Points => "point3f[]",
        }
    }
}

/// A layer of meshes that have one time sample for each frame.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    pub(super) fps: f64,
    pub(super) meshes: Vec<LayerMesh>,
}

/// A mesh without its positions.
#[derive(Clone, Debug)]
pub(super) struct LayerMesh {
    pub(super) name: String,
    pub(super) vertex_count: usize,
    pub(super) faces: Vec<[u32; 3]>,
    /// Texture coordinates and their indices, one for each corner.
    pub(super) uvs: Option<(Vec<Vec2>, Vec<[u32; 3]>)>,
    pub(super) normals: SeamlessNormals,
}

impl LayerMesh {
    pub(super) fn new(name: &str, mesh: &TriMesh) -> Self {
        let uvs = mesh.uvs.as_ref();
        Self {
            name: name.to_owned(),
            vertex_count: mesh.vertices.len(),
            faces: mesh.faces.clone(),
            uvs: uvs.map(|uvs| (uvs.coordinates.clone(), uvs.faces.clone())),
            normals: SeamlessNormals::new(mesh),
        }
    }
}

/// Time code of the last frame of `len`. A layer without frames ends where it starts.
pub(super) fn end_time_code(len: usize) -> usize {
    len.saturating_sub(1)
}
