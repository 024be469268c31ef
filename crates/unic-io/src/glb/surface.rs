//! Writing surfaces into the binary chunk.

use super::{
    binary::{BinaryWriter, BufferUsage},
    json::{Attributes, Index},
    seams::SeamSplit,
};
use crate::error::Result;
use glam::Vec3;

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
    pub(super) fn compute(&mut self, positions: &[Vec3], seams: &SeamSplit) {
        // Normals of the unsplit mesh: triangles on both sides of a seam contribute.
        let mut normals = Vec::new();
        seams.normals.compute(positions, &mut normals);
        for normal in &mut normals {
            *normal = normal.try_normalize().unwrap_or(Vec3::Y);
        }
        seams.spread(&normals, &mut self.normals);
        seams.spread(positions, &mut self.positions);
    }

    /// Writes attributes and triangles.
    pub(super) fn write(&self, seams: &SeamSplit, binary: &mut BinaryWriter) -> Result<WrittenSurface> {
        let mut attributes = Attributes::new();
        let view = binary.open_view(BufferUsage::Vertices, size_of::<Vec3>());
        let positions = binary.append_positions(view, &self.positions)?;
        attributes.insert("POSITION".into(), positions);
        attributes.insert("NORMAL".into(), binary.append(view, &self.normals)?);
        if let Some(uvs) = &seams.uvs {
            attributes.insert("TEXCOORD_0".into(), binary.write(BufferUsage::Vertices, uvs)?);
        }
        let indices = binary.write(BufferUsage::Indices, seams.faces.as_flattened())?;
        Ok(WrittenSurface { attributes, indices })
    }
}

/// Accessors of a written surface.
#[derive(Debug)]
pub(super) struct WrittenSurface {
    pub(super) attributes: Attributes,
    /// Accessor of the triangles.
    pub(super) indices: Index,
}
