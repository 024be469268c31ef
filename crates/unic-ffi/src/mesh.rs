//! Meshes of garment and body as the caller wants them: with copies of vertices at texture seams,
//! and faces that wind as the caller's axes ask.

use crate::{
    axes::{Axes, Handedness},
    error::Error,
    memory::{Plain, Rows, check_count, read},
    options::UnicVertexLayout,
};
use glam::{Vec2, Vec3};
use unic_core::mesh::{SeamSplit, TriMesh};

/// Mesh of an instance.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicMesh {
    /// The garment.
    Garment = 0,
    /// The character's body.
    Body = 1,
}

/// Buffers that vertices are written to, in the caller's memory.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct UnicVertices {
    /// First position: three floats, in the instance's axes and unit. Null if not wanted.
    pub positions: *mut f32,
    /// Bytes from the start of a position to the next; 0 for 12.
    pub position_stride: usize,
    /// First unit normal: three floats. Null if not wanted.
    pub normals: *mut f32,
    /// Bytes from the start of a normal to the next; 0 for 12.
    pub normal_stride: usize,
    /// Number of vertices, which must be that of the mesh in the instance's layout.
    pub count: usize,
}

// SAFETY: pointers and sizes, without padding.
unsafe impl Plain for UnicVertices {}
const _: () = assert!(size_of::<UnicVertices>() == 5 * size_of::<usize>(), "padding");

/// Mesh in the caller's layout.
#[derive(Debug)]
pub(crate) struct MeshLayout {
    /// Vertex of the model for each written vertex. The first ones are those of the model.
    sources: Vec<u32>,
    /// Vertex indices, counter-clockwise from outside in the caller's axes seen as right-handed.
    faces: Vec<[u32; 3]>,
    /// Texture coordinate of each written vertex; none if the mesh has none.
    uvs: Option<Vec<Vec2>>,
}

impl MeshLayout {
    pub(crate) fn new(mesh: &TriMesh, layout: UnicVertexLayout, axes: &Axes) -> Self {
        let SeamSplit {
            mut sources,
            mut uvs,
            mut faces,
        } = SeamSplit::new(mesh);
        if layout == UnicVertexLayout::Model {
            // The model's own vertices come first, with the texture coordinate of their first corner.
            let count = mesh.vertices.len();
            sources.truncate(count);
            if let Some(uvs) = &mut uvs {
                uvs.truncate(count);
            }
            faces.clone_from(&mesh.faces);
        }
        if axes.handedness() == Handedness::Left {
            faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        Self { sources, faces, uvs }
    }

    /// Number of written vertices.
    pub(crate) fn vertex_count(&self) -> usize {
        self.sources.len()
    }

    /// Number of triangles.
    pub(crate) fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Tells whether there are texture coordinates.
    pub(crate) fn has_uvs(&self) -> bool {
        self.uvs.is_some()
    }

    /// Writes the vertex of the model for each vertex.
    pub(crate) fn write_sources(&self, rows: Rows<1>) -> Result<(), Error> {
        check_count("number of vertices", self.sources.len(), rows.len())?;
        let sources = self.sources.iter().enumerate();
        sources.for_each(|(row, &source)| rows.set(row, [source]));
        Ok(())
    }

    /// Writes the faces.
    pub(crate) fn write_faces(&self, rows: Rows<3>) -> Result<(), Error> {
        check_count("number of faces", self.faces.len(), rows.len())?;
        self.faces
            .iter()
            .enumerate()
            .for_each(|(row, &face)| rows.set(row, face));
        Ok(())
    }

    /// Writes the texture coordinates.
    pub(crate) fn write_uvs(&self, rows: Rows<2>) -> Result<(), Error> {
        let Some(uvs) = &self.uvs else {
            return Err(Error::value("mesh", "texture coordinates", "none"));
        };
        check_count("number of vertices", uvs.len(), rows.len())?;
        uvs.iter()
            .enumerate()
            .for_each(|(row, uv)| rows.set(row, uv.to_array()));
        Ok(())
    }

    /// Writes vertices of the model to the places of the caller.
    pub(crate) fn write_vertices(&self, axes: &Axes, to: &VertexRows, positions: &[Vec3], normals: &[Vec3]) {
        if let Some(rows) = &to.positions {
            for (row, &source) in self.sources.iter().enumerate() {
                rows.set(row, axes.point_out(positions[source as usize]));
            }
        }
        if let Some(rows) = &to.normals {
            for (row, &source) in self.sources.iter().enumerate() {
                rows.set(row, axes.direction_out(normals[source as usize]));
            }
        }
    }

    /// Checks the buffers of the caller; null stands for buffers that are not wanted.
    ///
    /// # Safety
    /// `vertices` is null, misaligned or points to buffers of the stated sizes, which stay writable
    /// as long as the result is used.
    pub(crate) unsafe fn vertex_rows(&self, vertices: *const UnicVertices) -> Result<VertexRows, Error> {
        if vertices.is_null() {
            return Ok(VertexRows::default());
        }
        // SAFETY: passed on.
        let given = unsafe { read("vertices", vertices) }?;
        check_count("number of vertices", self.vertex_count(), given.count)?;
        let rows = |what, first: *mut f32, stride| match first.is_null() {
            true => Ok(None),
            // SAFETY: passed on.
            false => unsafe { Rows::<3>::new(what, first.cast(), stride, given.count) }.map(Some),
        };
        Ok(VertexRows {
            positions: rows("positions", given.positions, given.position_stride)?,
            normals: rows("normals", given.normals, given.normal_stride)?,
        })
    }
}

/// Checked places of vertices in the caller's memory.
#[derive(Debug, Default)]
pub(crate) struct VertexRows {
    positions: Option<Rows<3>>,
    normals: Option<Rows<3>>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::UnicAxes;
    use unic_core::mesh::Uvs;

    /// Two triangles over a square, with a texture seam along the diagonal at vertex 2.
    fn square() -> TriMesh {
        let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        let mut mesh = TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let coordinates = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.5, 0.5), (0.0, 1.0)];
        mesh.uvs = Some(Uvs {
            coordinates: coordinates.map(|(u, v)| Vec2::new(u, v)).to_vec(),
            faces: vec![[0, 1, 2], [0, 3, 4]],
        });
        mesh
    }

    #[test]
    fn only_vertices_with_several_coordinates_are_copied() {
        let axes = Axes::new(UnicAxes::Model as u32, [1, 2, 3], 0.0).unwrap();
        let split = MeshLayout::new(&square(), UnicVertexLayout::Split, &axes);
        assert_eq!(split.sources, [0, 1, 2, 3, 2]);
        assert_eq!(split.faces, [[0, 1, 2], [0, 4, 3]]);
        let uvs = split.uvs.unwrap();
        assert_eq!((uvs[2], uvs[4]), (Vec2::ONE, Vec2::splat(0.5)));
        let plain = MeshLayout::new(&square(), UnicVertexLayout::Model, &axes);
        assert_eq!(plain.sources, [0, 1, 2, 3]);
        assert_eq!(plain.faces, square().faces);
        assert_eq!(plain.uvs.unwrap()[2], Vec2::ONE);
    }

    #[test]
    fn faces_are_turned_for_left_handed_axes() {
        let axes = Axes::new(UnicAxes::Unity as u32, [1, 2, 3], 0.0).unwrap();
        let layout = MeshLayout::new(&square(), UnicVertexLayout::Model, &axes);
        assert_eq!(layout.faces, [[0, 2, 1], [0, 3, 2]]);
    }

    #[test]
    fn coordinates_that_do_not_fit_are_left_out() {
        let axes = Axes::new(UnicAxes::Model as u32, [1, 2, 3], 0.0).unwrap();
        let mut mesh = square();
        mesh.uvs.as_mut().unwrap().faces[1][2] = 5;
        assert!(
            MeshLayout::new(&mesh, UnicVertexLayout::Split, &axes)
                .uvs
                .is_none()
        );
    }
}
