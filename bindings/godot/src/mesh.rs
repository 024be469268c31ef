//! Meshes of garments in the engine.

use crate::{
    garment::Frame,
    surface::{Surface, bounds},
};
use glam::Vec3;
use godot::{
    classes::{ArrayMesh, Mesh, mesh::ArrayType, mesh::PrimitiveType},
    prelude::*,
};
use unic_core::mesh::TriMesh;

/// A mesh whose vertices are replaced in every frame.
#[derive(Debug)]
pub(crate) struct MovingMesh {
    surface: Surface,
    mesh: Gd<ArrayMesh>,
    /// Vertex buffer of a frame.
    buffer: Vec<u8>,
    /// Vertices of the model after the last frame, metres, world space.
    shown: Vec<Vector3>,
}

impl MovingMesh {
    /// Makes the mesh, at the places of the rest shape until the first frame.
    pub(crate) fn new(rest: &TriMesh) -> Self {
        let surface = Surface::new(rest);
        let positions: PackedVector3Array = surface.spread(&rest.vertices).map(vector).collect();
        let normals: PackedVector3Array = (0..positions.len()).map(|_| Vector3::BACK).collect();
        let mut arrays = surface_arrays(&surface, &positions, &normals);
        if let Some(uvs) = &surface.uvs {
            let uvs: PackedVector2Array = uvs.iter().map(|&[u, v]| Vector2::new(u, v)).collect();
            arrays.set(ArrayType::TEX_UV.ord() as usize, &uvs.to_variant());
        }
        let mut mesh = ArrayMesh::new_gd();
        mesh.add_surface_from_arrays(PrimitiveType::TRIANGLES, &arrays);
        Self {
            surface,
            mesh,
            buffer: Vec::new(),
            shown: Vec::new(),
        }
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
        self.surface.write_vertices(positions, normals, &mut self.buffer);
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
