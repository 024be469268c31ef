//! Meshes of garments in the engine.

use crate::{
    garment::Frame,
    surface::{DIRECTION_BYTES, POSITION_BYTES, Surface, bounds},
    tangents::Tangents,
};
use glam::Vec3;
use godot::{
    classes::{
        ArrayMesh, Mesh, RenderingServer, mesh::ArrayType, mesh::PrimitiveType, rendering_server::ArrayFormat,
    },
    prelude::*,
};
use thiserror::Error;
use unic_core::mesh::TriMesh;

/// Error of an engine with another layout of vertex buffers.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("expected vertex buffers with {expected:?} bytes a position and a direction, found {found:?}")]
pub(crate) struct LayoutError {
    expected: [usize; 2],
    found: [usize; 2],
}

/// A mesh whose vertices are replaced in every frame.
#[derive(Debug)]
pub(crate) struct MovingMesh {
    surface: Surface,
    tangents: Tangents,
    mesh: Gd<ArrayMesh>,
    /// Vertex buffer of a frame.
    buffer: Vec<u8>,
    /// Vertices of the model after the last frame, metres, world space.
    shown: Vec<Vector3>,
}

impl MovingMesh {
    /// Makes the mesh, at the places of the rest shape until the first frame.
    ///
    /// # Errors
    /// An engine with another layout of vertex buffers.
    pub(crate) fn new(rest: &TriMesh) -> Result<Self, LayoutError> {
        let surface = Surface::new(rest);
        let positions: PackedVector3Array = surface.spread(&rest.vertices).map(vector).collect();
        let normals: PackedVector3Array = (0..positions.len()).map(|_| Vector3::BACK).collect();
        let tangents: PackedFloat32Array = (0..positions.len()).flat_map(|_| [1.0, 0.0, 0.0, 1.0]).collect();
        let mut arrays = surface_arrays(&surface, &positions, &normals);
        arrays.set(ArrayType::TANGENT.ord() as usize, &tangents.to_variant());
        if let Some(uvs) = &surface.uvs {
            let uvs: PackedVector2Array = uvs.iter().map(|&[u, v]| Vector2::new(u, v)).collect();
            arrays.set(ArrayType::TEX_UV.ord() as usize, &uvs.to_variant());
        }
        let mut mesh = ArrayMesh::new_gd();
        mesh.add_surface_from_arrays(PrimitiveType::TRIANGLES, &arrays);
        check_layout(&mesh)?;
        Ok(Self {
            tangents: Tangents::new(&surface),
            surface,
            mesh,
            buffer: Vec::new(),
            shown: Vec::new(),
        })
    }

    /// The mesh, for the node.
    pub(crate) fn mesh(&self) -> Gd<Mesh> {
        self.mesh.clone().upcast()
    }

    /// Vertices of the model after the last frame, metres, world space.
    pub(crate) fn shown(&self) -> PackedVector3Array {
        PackedVector3Array::from(self.shown.as_slice())
    }

    /// Writes the vertices of a frame. Returns the box around them, in the size of the model.
    pub(crate) fn write(&mut self, frame: &Frame<'_>) -> Aabb {
        let (positions, normals) = (frame.positions, frame.normals);
        self.surface
            .write_vertices(positions, normals, &mut self.tangents, &mut self.buffer);
        let bytes = PackedByteArray::from(self.buffer.as_slice());
        self.mesh.surface_update_vertex_region(0, 0, &bytes);
        self.shown.clear();
        self.shown
            .extend(positions.iter().map(|p| vector(*p * frame.size)));
        let (low, high) = bounds(positions).unwrap_or_default();
        let aabb = Aabb::new(vector(low), vector(high - low));
        self.mesh.set_custom_aabb(aabb);
        aabb
    }
}

/// Checks that the engine holds vertices as [`Surface::write_vertices`] writes them.
fn check_layout(mesh: &Gd<ArrayMesh>) -> Result<(), LayoutError> {
    let server = RenderingServer::singleton();
    let (format, count) = (mesh.surface_get_format(0), mesh.surface_get_array_len(0));
    // The flags of formats are those of array formats.
    let format = ArrayFormat::from_ord(format.ord());
    let found = [
        server.mesh_surface_get_format_vertex_stride(format, count),
        server.mesh_surface_get_format_normal_tangent_stride(format, count),
    ]
    .map(|bytes| bytes as usize);
    let expected = [POSITION_BYTES, DIRECTION_BYTES];
    if found != expected {
        return Err(LayoutError { expected, found });
    }
    Ok(())
}

/// Arrays of a surface with positions, normals and triangles.
pub(crate) fn surface_arrays(
    surface: &Surface,
    positions: &PackedVector3Array,
    normals: &PackedVector3Array,
) -> VarArray {
    let mut arrays = VarArray::new();
    arrays.resize(ArrayType::MAX.ord() as usize, &Variant::nil());
    let indices: PackedInt32Array = surface.indices.iter().map(|&index| index as i32).collect();
    arrays.set(ArrayType::VERTEX.ord() as usize, &positions.to_variant());
    arrays.set(ArrayType::NORMAL.ord() as usize, &normals.to_variant());
    arrays.set(ArrayType::INDEX.ord() as usize, &indices.to_variant());
    arrays
}

/// The engine's form of a vector.
pub(crate) fn vector(v: Vec3) -> Vector3 {
    Vector3::new(v.x, v.y, v.z)
}
