//! Meshes on the device.

use crate::mesh::Mesh;
use crate::scene::Part;
use std::collections::HashMap;
use std::sync::{Arc, Weak};
use unic_gpu::wgpu;
use wgpu::util::DeviceExt;

/// Buffers of a mesh.
#[derive(Debug)]
pub(crate) struct GpuMesh {
    pub(crate) corners: wgpu::Buffer,
    pub(crate) faces: wgpu::Buffer,
    pub(crate) face_indices: u32,
    pub(crate) edges: wgpu::Buffer,
    pub(crate) edge_indices: u32,
}

/// Meshes on the device, by their address.
///
/// The weak pointer keeps the address from being used again while its entry exists.
#[derive(Debug, Default)]
pub(crate) struct MeshCache(HashMap<*const Mesh, (Weak<Mesh>, GpuMesh)>);

impl MeshCache {
    /// Uploads the meshes of the parts that are new, and forgets those whose owner is gone.
    pub(crate) fn keep(&mut self, device: &wgpu::Device, parts: &[Part]) {
        self.0.retain(|_, (owner, _)| owner.strong_count() > 0);
        for part in parts {
            let entry = self.0.entry(Arc::as_ptr(part.mesh));
            entry.or_insert_with(|| (Arc::downgrade(part.mesh), GpuMesh::new(device, part.mesh)));
        }
    }

    /// Mesh of a part that [`keep`](Self::keep) has seen.
    pub(crate) fn get(&self, part: &Part) -> Option<&GpuMesh> {
        self.0.get(&Arc::as_ptr(part.mesh)).map(|(_, mesh)| mesh)
    }
}

impl GpuMesh {
    fn new(device: &wgpu::Device, mesh: &Mesh) -> Self {
        let buffer = |label, contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage,
            })
        };
        let (faces, edges) = (mesh.corner_faces(), mesh.edges());
        let corners = bytemuck::cast_slice(mesh.corners());
        Self {
            corners: buffer("corners", corners, wgpu::BufferUsages::VERTEX),
            faces: buffer("faces", bytemuck::cast_slice(faces), wgpu::BufferUsages::INDEX),
            face_indices: 3 * faces.len() as u32,
            edges: buffer("edges", bytemuck::cast_slice(edges), wgpu::BufferUsages::INDEX),
            edge_indices: 2 * edges.len() as u32,
        }
    }
}
