//! Writing surfaces into the binary chunk.

use super::{
    binary::{BinaryWriter, BufferUsage},
    file_mesh::FileMesh,
    json::{Attributes, Index},
};
use crate::error::Result;
use glam::Vec3;
use unic_core::mesh::SeamSplit;

/// Positions and unit normals of all vertices in the file, copies at seams included.
#[derive(Debug, Default)]
pub(super) struct SurfaceBuffers {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
}

impl SurfaceBuffers {
    /// Computes normals of a mesh with these positions, and copies both to all vertices.
    ///
    /// Copies at a seam share the normal of the unsplit vertex, so that the seam is invisible. A
    /// vertex without a normal gets +Y, because glTF forbids zero normals.
    pub(super) fn compute(&mut self, positions: &[Vec3], mesh: &FileMesh) {
        // Normals of the unsplit mesh: triangles on both sides of a seam contribute.
        let mut normals = Vec::new();
        mesh.normals.compute(positions, &mut normals);
        for normal in &mut normals {
            *normal = normal.try_normalize().unwrap_or(Vec3::Y);
        }
        spread(&mesh.split, &normals, &mut self.normals);
        spread(&mesh.split, positions, &mut self.positions);
    }

    /// Writes attributes and triangles.
    pub(super) fn write(&self, mesh: &FileMesh, binary: &mut BinaryWriter) -> Result<WrittenSurface> {
        let mut attributes = Attributes::new();
        let view = binary.open_view(BufferUsage::Vertices, size_of::<Vec3>());
        let positions = binary.append_positions(view, &self.positions)?;
        attributes.insert("POSITION".into(), positions);
        attributes.insert("NORMAL".into(), binary.append(view, &self.normals)?);
        if let Some(uvs) = &mesh.split.uvs {
            attributes.insert("TEXCOORD_0".into(), binary.write(BufferUsage::Vertices, uvs)?);
        }
        let indices = binary.write(BufferUsage::Indices, mesh.split.faces.as_flattened())?;
        Ok(WrittenSurface { attributes, indices })
    }
}

fn spread(split: &SeamSplit, values: &[Vec3], out: &mut Vec<Vec3>) {
    out.clear();
    out.extend(split.spread(values));
}

/// Accessors of a written surface.
#[derive(Debug)]
pub(super) struct WrittenSurface {
    pub(super) attributes: Attributes,
    /// Accessor of the triangles.
    pub(super) indices: Index,
}
