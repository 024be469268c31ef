//! Surfaces in the binary chunk: base shapes and the morph targets of the garment.

use super::{
    binary::{Binary, Usage},
    json::{Attributes, Index, Target},
    seams::Seams,
};
use crate::error::Result;
use glam::Vec3;
use unic_core::mesh::vertex_normals;

/// Positions and unit normals at the vertices of a file.
#[derive(Debug, Default)]
pub(super) struct Shape {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl Shape {
    /// Of a mesh with these positions. Copies at seams take the normal of the whole vertex, so that
    /// seams do not show; a vertex without a normal points up, for glTF knows no zero normals.
    pub(super) fn compute(&mut self, positions: &[Vec3], faces: &[[u32; 3]], seams: &Seams) {
        let mut normals = Vec::new();
        vertex_normals(positions, faces, &mut normals);
        for normal in &mut normals {
            *normal = normal.try_normalize().unwrap_or(Vec3::Y);
        }
        seams.spread(&normals, &mut self.normals);
        seams.spread(positions, &mut self.positions);
    }

    /// Attributes of the base shape, and the accessor of its triangles.
    pub(super) fn write(&self, seams: &Seams, binary: &mut Binary) -> Result<(Attributes, Index)> {
        let mut attributes = Attributes::new();
        let view = binary.open_view(Usage::Vertices, size_of::<Vec3>());
        let positions = binary.append_positions(view, &self.positions)?;
        attributes.insert("POSITION".into(), positions);
        attributes.insert("NORMAL".into(), binary.append(view, &self.normals)?);
        if let Some(uvs) = &seams.uvs {
            attributes.insert("TEXCOORD_0".into(), binary.write(Usage::Vertices, uvs)?);
        }
        let indices = binary.write(Usage::Indices, seams.faces.as_flattened())?;
        Ok((attributes, indices))
    }
}

/// The garment: its first frame, and every further one as displacements from it.
#[derive(Debug)]
pub(super) struct Morphs {
    seams: Seams,
    /// Of the mesh itself, for the normals.
    faces: Vec<[u32; 3]>,
    first: Shape,
    current: Shape,
    base: Option<(Attributes, Index)>,
    /// The view that all targets share; there is none without a target, for glTF knows no empty views.
    view: Option<Index>,
    targets: Vec<Target>,
}

/// A garment in the file.
pub(super) struct MorphedMesh {
    pub(super) attributes: Attributes,
    pub(super) indices: Index,
    pub(super) targets: Vec<Target>,
}

impl Morphs {
    pub(super) fn new(seams: Seams, faces: Vec<[u32; 3]>) -> Self {
        Self {
            seams,
            faces,
            first: Shape::default(),
            current: Shape::default(),
            base: None,
            view: None,
            targets: Vec::new(),
        }
    }

    pub(super) fn push(&mut self, positions: &[Vec3], binary: &mut Binary) -> Result<()> {
        if self.base.is_some() {
            return self.push_target(positions, binary);
        }
        self.first.compute(positions, &self.faces, &self.seams);
        self.base = Some(self.first.write(&self.seams, binary)?);
        Ok(())
    }

    fn push_target(&mut self, positions: &[Vec3], binary: &mut Binary) -> Result<()> {
        self.current.compute(positions, &self.faces, &self.seams);
        subtract(&mut self.current.positions, &self.first.positions);
        subtract(&mut self.current.normals, &self.first.normals);
        let view = *(self.view).get_or_insert_with(|| binary.open_view(Usage::Vertices, size_of::<Vec3>()));
        self.targets.push(Target {
            position: binary.append_positions(view, &self.current.positions)?,
            normal: binary.append(view, &self.current.normals)?,
        });
        Ok(())
    }

    /// Nothing when no frame has come.
    pub(super) fn finish(self) -> Option<MorphedMesh> {
        let (attributes, indices) = self.base?;
        Some(MorphedMesh {
            attributes,
            indices,
            targets: self.targets,
        })
    }
}

fn subtract(values: &mut [Vec3], base: &[Vec3]) {
    for (value, base) in values.iter_mut().zip(base) {
        *value -= *base;
    }
}
