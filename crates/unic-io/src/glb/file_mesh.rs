//! Meshes as glTF wants them: texture coordinates for vertices instead of for corners.

use crate::error::{Error, Result};
use std::path::Path;
use unic_core::mesh::{SeamSplit, SeamlessNormals, TriMesh, Uvs};

/// Mesh of a file: split at texture seams, v down, with the normals of the unsplit mesh.
#[derive(Debug)]
pub(super) struct FileMesh {
    /// The mesh, every vertex of which has one texture coordinate, v down.
    pub(super) split: SeamSplit,
    /// Normals of the mesh's own vertices.
    pub(super) normals: SeamlessNormals,
}

impl FileMesh {
    /// Splits the vertices of a mesh; `path` is used in errors only.
    ///
    /// # Errors
    /// No triangle, an index out of range, positions or texture coordinates that are not finite.
    pub(super) fn new(path: &Path, mesh: &TriMesh) -> Result<Self> {
        let named = |source| Error::Mesh {
            path: path.to_path_buf(),
            source,
        };
        mesh.check().map_err(named)?;
        // glTF forbids a primitive without triangles.
        if mesh.faces.is_empty() {
            return Err(Error::content(path, "a mesh with triangles", "one without"));
        }
        if let Some(uvs) = &mesh.uvs {
            check_uvs(path, mesh, uvs)?;
        }
        let mut split = SeamSplit::new(mesh);
        // glTF's texture coordinates begin at the upper left corner, OBJ's at the lower left. Those of
        // a vertex that no corner uses are never read.
        for uv in split.uvs.iter_mut().flatten() {
            uv.y = 1.0 - uv.y;
        }
        Ok(Self {
            split,
            normals: SeamlessNormals::new(mesh),
        })
    }
}

fn check_uvs(path: &Path, mesh: &TriMesh, uvs: &Uvs) -> Result<()> {
    let (triangles, count) = (mesh.faces.len(), uvs.coordinates.len());
    if uvs.faces.len() != triangles {
        let expected = format!("texture coordinates for {triangles} triangles");
        let found = format!("some for {}", uvs.faces.len());
        return Err(Error::content(path, expected, found));
    }
    if let Some(index) = uvs.faces.as_flattened().iter().find(|&&i| i as usize >= count) {
        let found = format!("a corner with number {index}");
        return Err(Error::content(
            path,
            format!("{count} texture coordinates"),
            found,
        ));
    }
    match uvs.coordinates.iter().position(|uv| !uv.is_finite()) {
        None => Ok(()),
        Some(uv) => Err(Error::content(
            path,
            "finite texture coordinates",
            format!("number {uv} without a value"),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec2, Vec3};

    fn triangle() -> TriMesh {
        let coordinates = [[0.0, 0.0], [1.0, 0.25], [0.5, 1.0]];
        TriMesh {
            vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            faces: vec![[0, 1, 2]],
            uvs: Some(Uvs {
                coordinates: coordinates.map(Vec2::from_array).to_vec(),
                faces: vec![[0, 1, 2]],
            }),
        }
    }

    #[test]
    fn texture_coordinates_have_v_down() {
        let mesh = FileMesh::new("a.glb".as_ref(), &triangle()).unwrap();
        let expected = [[0.0, 1.0], [1.0, 0.75], [0.5, 0.0]].map(Vec2::from_array);
        assert_eq!(mesh.split.uvs.unwrap(), expected);
    }

    #[test]
    fn meshes_that_cannot_be_written_are_refused() {
        let good = triangle();
        let refused = |change: fn(&mut TriMesh, &mut Uvs)| {
            let mut mesh = good.clone();
            let mut uvs = mesh.uvs.take().unwrap();
            change(&mut mesh, &mut uvs);
            mesh.uvs = Some(uvs);
            FileMesh::new("a.glb".as_ref(), &mesh).is_err()
        };
        assert!(!refused(|_, _| ()));
        assert!(refused(|mesh, uvs| {
            mesh.faces.clear();
            uvs.faces.clear();
        }));
        assert!(refused(|mesh, _| mesh.faces[0][1] = 3));
        assert!(refused(|mesh, _| mesh.vertices[0].y = f32::NAN));
        assert!(refused(|_, uvs| uvs.faces[0][2] = 5));
        assert!(refused(|_, uvs| uvs.faces.push([0; 3])));
        assert!(refused(|_, uvs| uvs.coordinates[2].x = f32::INFINITY));
    }
}
