//! Skinned meshes on the device, shared by garment and body.

use crate::{
    GpuContext, GpuError,
    kernel::{Dispatch, GROUP, Kernel, Source},
};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use unic_core::{mesh::TriMesh, skinning::SkinningWeights};
use wgpu::Buffer;

/// Size of a shown vertex, bytes: position and normal, three f32 each.
pub(crate) const SHOWN_BYTES: usize = 24;

/// Mesh with rest positions, skinning weights and the faces around each vertex. Asset.
#[derive(Debug)]
pub(crate) struct Mesh {
    pub(crate) count: usize,
    pub(crate) vertices: Buffer,
    pub(crate) weights: Buffer,
    starts: Buffer,
    corners: Buffer,
    normals: Kernel,
}

/// Vertex in the memory layout of `skin.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Vertex {
    rest: [f32; 3],
    first: u32,
    mean: [f32; 3],
    count: u32,
}

/// Skinning weight in the memory layout of `skin.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Weight {
    joint: u32,
    weight: f32,
}

impl Mesh {
    /// Uploads a mesh. `mean` has one displacement a vertex, or is empty.
    pub(crate) fn new(
        context: &GpuContext,
        mesh: &TriMesh,
        weights: &SkinningWeights,
        mean: &[Vec3],
    ) -> Self {
        let count = mesh.vertices.len();
        let mut vertices = Vec::with_capacity(count);
        let mut entries = Vec::new();
        for (i, rest) in mesh.vertices.iter().enumerate() {
            let row = weights.row(i);
            vertices.push(Vertex {
                rest: rest.to_array(),
                first: entries.len() as u32,
                mean: mean.get(i).copied().unwrap_or_default().to_array(),
                count: row.len() as u32,
            });
            entries.extend(row.map(|(joint, weight)| Weight {
                joint: joint as u32,
                weight,
            }));
        }
        let (starts, corners) = corners_around(count, &mesh.faces);
        let source = Source {
            text: include_str!("kernels/normals.wgsl"),
            entry: "normals",
            constants: &[("VERTICES", count as f64)],
        };
        Self {
            count,
            vertices: context.upload("vertices", &vertices),
            weights: context.upload("skinning weights", &entries),
            starts: context.upload("starts", &starts),
            corners: context.upload("corners", &corners),
            normals: Kernel::new(context, &source),
        }
    }

    /// Number of workgroups for one invocation a vertex.
    pub(crate) fn groups(&self) -> usize {
        self.count.div_ceil(GROUP)
    }

    /// Computes normals from positions.
    pub(crate) fn normals(&self, shown: &Buffer) -> Result<Dispatch, GpuError> {
        let buffers = [(0, &self.starts), (1, &self.corners), (2, shown)];
        self.normals.dispatch(&buffers, self.groups())
    }
}

/// Lists the two corners that follow each vertex in each face around it, in compressed rows: starts
/// of rows, and pairs of corners.
// In the order of the faces, so that sums of normals have the same order on every device.
fn corners_around(count: usize, faces: &[[u32; 3]]) -> (Vec<u32>, Vec<[u32; 2]>) {
    let mut starts = vec![0u32; count + 1];
    for &corner in faces.iter().flatten() {
        starts[corner as usize + 1] += 1;
    }
    for i in 0..count {
        starts[i + 1] += starts[i];
    }
    let mut ends = starts.clone();
    let mut corners = vec![[0; 2]; 3 * faces.len()];
    for &[a, b, c] in faces {
        for [at, second, third] in [[a, b, c], [b, c, a], [c, a, b]] {
            let end = &mut ends[at as usize];
            corners[*end as usize] = [second, third];
            *end += 1;
        }
    }
    (starts, corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_follow_their_vertex_around_every_face() {
        let (starts, corners) = corners_around(5, &[[0, 1, 2], [3, 2, 1]]);
        assert_eq!(starts, [0, 1, 3, 5, 6, 6]);
        assert_eq!(corners, [[1, 2], [2, 0], [3, 2], [0, 1], [1, 3], [2, 1]]);
    }
}
