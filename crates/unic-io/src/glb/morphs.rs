//! Writing the morph targets of the garment.

use super::{
    binary::{BinaryWriter, BufferUsage},
    file_mesh::FileMesh,
    json::{Attributes, Index, MorphTarget},
    surface::{SurfaceBuffers, WrittenSurface},
};
use crate::error::Result;
use glam::Vec3;

/// Writer of the garment: its first frame, and every further frame as displacements from it.
#[derive(Debug)]
pub(super) struct MorphWriter {
    mesh: FileMesh,
    first: SurfaceBuffers,
    current: SurfaceBuffers,
    base: Option<WrittenSurface>,
    /// The view that all targets share. It is opened for the first target, because glTF forbids
    /// empty views.
    view: Option<Index>,
    targets: Vec<MorphTarget>,
}

/// Accessors of a written garment.
pub(super) struct MorphedMesh {
    pub(super) attributes: Attributes,
    pub(super) indices: Index,
    pub(super) targets: Vec<MorphTarget>,
}

impl MorphWriter {
    pub(super) fn new(mesh: FileMesh) -> Self {
        Self {
            mesh,
            first: SurfaceBuffers::default(),
            current: SurfaceBuffers::default(),
            base: None,
            view: None,
            targets: Vec::new(),
        }
    }

    /// Writes the next frame; the first one becomes the mesh itself.
    pub(super) fn push(&mut self, positions: &[Vec3], binary: &mut BinaryWriter) -> Result<()> {
        if self.base.is_some() {
            return self.push_target(positions, binary);
        }
        self.first.compute(positions, &self.mesh);
        self.base = Some(self.first.write(&self.mesh, binary)?);
        Ok(())
    }

    fn push_target(&mut self, positions: &[Vec3], binary: &mut BinaryWriter) -> Result<()> {
        self.current.compute(positions, &self.mesh);
        subtract(&mut self.current.positions, &self.first.positions);
        // Differences of unit normals: a reader adds them and normalises the sum.
        subtract(&mut self.current.normals, &self.first.normals);
        let view =
            *(self.view).get_or_insert_with(|| binary.open_view(BufferUsage::Vertices, size_of::<Vec3>()));
        self.targets.push(MorphTarget {
            position: binary.append_positions(view, &self.current.positions)?,
            normal: binary.append(view, &self.current.normals)?,
        });
        Ok(())
    }

    /// Returns the accessors; `None` if no frame was pushed.
    pub(super) fn finish(self) -> Option<MorphedMesh> {
        let base = self.base?;
        Some(MorphedMesh {
            attributes: base.attributes,
            indices: base.indices,
            targets: self.targets,
        })
    }
}

fn subtract(values: &mut [Vec3], base: &[Vec3]) {
    for (value, base) in values.iter_mut().zip(base) {
        *value -= *base;
    }
}
