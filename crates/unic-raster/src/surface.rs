use glam::Vec3;

use crate::RasterError;
use crate::colour::linear_from_srgb;

/// A triangle mesh to draw, borrowed so that an animated garment needs no copy.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Positions (V), world, metres. Triangles with a non-finite position are skipped.
    pub vertices: &'a [Vec3],
    /// Triangles (F) of vertex indices, counter-clockwise seen from the front.
    pub faces: &'a [[u32; 3]],
    /// Normals (V) for smooth shading, see [`vertex_normals`].
    ///
    /// They may have any length and either sign: shading uses the side that faces the viewer.
    pub normals: &'a [Vec3],
    /// Colour of the material.
    pub colour: Colouring<'a>,
}

/// Colour of a [`Surface`]: sRGB, 0 to 1.
#[derive(Clone, Copy, Debug)]
pub enum Colouring<'a> {
    /// One colour everywhere.
    Solid([f32; 3]),
    /// One colour per vertex (V), such as those of [`crate::heat_colours`].
    PerVertex(&'a [[f32; 3]]),
}

impl Surface<'_> {
    /// Checks the lengths of the arrays and the indices of the faces.
    pub(crate) fn check(&self) -> Result<(), RasterError> {
        let vertices = self.vertices.len();
        check_length("normals", vertices, self.normals.len())?;
        if let Colouring::PerVertex(colours) = self.colour {
            check_length("colours", vertices, colours.len())?;
        }
        check_faces(self.faces, vertices)
    }

    /// Linear albedo: one element if solid, otherwise one per vertex.
    pub(crate) fn linear_albedo(&self) -> Vec<Vec3> {
        match self.colour {
            Colouring::Solid(colour) => vec![linear_from_srgb(colour)],
            Colouring::PerVertex(colours) => colours.iter().map(|&colour| linear_from_srgb(colour)).collect(),
        }
    }

    /// Corners of a face that [`Surface::check`] has accepted.
    pub(crate) fn corners(&self, face: [u32; 3]) -> [Vec3; 3] {
        face.map(|index| self.vertices[index as usize])
    }
}

/// Computes unit normals (V) as means of the normals of the adjacent faces.
///
/// Faces are weighted by the angle at the vertex, so that the triangulation of a flat region does
/// not matter (Thürmer and Wüthrich 1998). Faces without area or with non-finite corners have no
/// weight. Vertices without any face get zero; shading then falls back to the normal of the face.
///
/// # Errors
/// [`RasterError::FaceIndex`] for a vertex index out of range.
pub fn vertex_normals(vertices: &[Vec3], faces: &[[u32; 3]]) -> Result<Vec<Vec3>, RasterError> {
    check_faces(faces, vertices.len())?;
    let mut normals = vec![Vec3::ZERO; vertices.len()];
    for face in faces {
        let corners = face.map(|index| vertices[index as usize]);
        let Some(normal) = face_normal(corners) else {
            continue;
        };
        for (corner, &index) in face.iter().enumerate() {
            normals[index as usize] += normal * corner_angle(corners, corner);
        }
    }
    normals
        .iter_mut()
        .for_each(|normal| *normal = normal.normalize_or_zero());
    Ok(normals)
}

/// Unit normal of a triangle; none for one without area or with non-finite corners.
pub(crate) fn face_normal([a, b, c]: [Vec3; 3]) -> Option<Vec3> {
    (b - a).cross(c - a).try_normalize()
}

/// Angle of a triangle at one of its corners, radians.
fn corner_angle(corners: [Vec3; 3], corner: usize) -> f32 {
    let from = corners[corner];
    let (u, v) = (corners[(corner + 1) % 3] - from, corners[(corner + 2) % 3] - from);
    // The arc tangent is exact for small and for flat angles, where an arc cosine is not.
    u.cross(v).length().atan2(u.dot(v))
}

fn check_length(what: &'static str, expected: usize, found: usize) -> Result<(), RasterError> {
    if expected == found {
        return Ok(());
    }
    Err(RasterError::Length {
        what,
        expected,
        found,
    })
}

fn check_faces(faces: &[[u32; 3]], vertices: usize) -> Result<(), RasterError> {
    for (face, corners) in faces.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&index| index as usize >= vertices) {
            return Err(RasterError::FaceIndex {
                face,
                index,
                vertices,
            });
        }
    }
    Ok(())
}
