//! Splitting vertices at texture seams: texture coordinates for vertices instead of for corners.

use crate::error::{Error, Result};
use glam::Vec2;
use std::{collections::HashMap, path::Path};
use unic_core::mesh::{SeamlessNormals, TriMesh, Uvs};

/// Vertices and triangles of a mesh in which every vertex has one texture coordinate.
///
/// The vertices of the mesh come first, in its order. A vertex with n texture coordinates has n − 1
/// copies after all of them.
#[derive(Debug)]
pub(super) struct SeamSplit {
    /// Vertex of the mesh that each vertex is a copy of.
    pub(super) sources: Vec<u32>,
    /// One texture coordinate for each vertex, v down; zero for a vertex that no corner uses.
    pub(super) uvs: Option<Vec<Vec2>>,
    /// Triangles, as indices into `sources`.
    pub(super) faces: Vec<[u32; 3]>,
    /// Normals of the mesh's own vertices.
    pub(super) normals: SeamlessNormals,
}

impl SeamSplit {
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
        let sources = (0..mesh.vertices.len() as u32).collect();
        let normals = SeamlessNormals::new(mesh);
        let Some(uvs) = &mesh.uvs else {
            return Ok(Self {
                sources,
                uvs: None,
                faces: mesh.faces.clone(),
                normals,
            });
        };
        check_uvs(path, mesh, uvs)?;
        Ok(Self::split(sources, &mesh.faces, uvs, normals))
    }

    fn split(mut sources: Vec<u32>, faces: &[[u32; 3]], uvs: &Uvs, normals: SeamlessNormals) -> Self {
        // The first texture coordinate of a vertex stays at the vertex itself; each other one makes
        // a copy, which all corners with that coordinate share.
        let mut first: Vec<Option<u32>> = vec![None; sources.len()];
        let mut copies = HashMap::new();
        let mut coordinates = vec![Vec2::ZERO; sources.len()];
        let mut corner = |vertex: u32, uv: u32| {
            // By index and not by value: equal coordinates with different indices make a copy,
            // which is harmless.
            let seen = first[vertex as usize].get_or_insert(uv);
            if *seen == uv {
                coordinates[vertex as usize] = v_down(uvs.coordinates[uv as usize]);
                return vertex;
            }
            *copies.entry((vertex, uv)).or_insert_with(|| {
                sources.push(vertex);
                coordinates.push(v_down(uvs.coordinates[uv as usize]));
                sources.len() as u32 - 1
            })
        };
        let faces = (faces.iter().zip(&uvs.faces))
            .map(|(face, uv)| [0, 1, 2].map(|c| corner(face[c], uv[c])))
            .collect();
        Self {
            sources,
            uvs: Some(coordinates),
            faces,
            normals,
        }
    }

    /// Number of vertices, copies included.
    pub(super) fn len(&self) -> usize {
        self.sources.len()
    }

    /// Copies values of the mesh's vertices to all vertices, into `out`.
    pub(super) fn spread<T: Copy>(&self, values: &[T], out: &mut Vec<T>) {
        out.clear();
        out.extend(self.sources.iter().map(|&v| values[v as usize]));
    }
}

/// Flips v: glTF's texture coordinates begin at the upper left corner, OBJ's at the lower left.
fn v_down(uv: Vec2) -> Vec2 {
    Vec2::new(uv.x, 1.0 - uv.y)
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
    use glam::Vec3;
    use proptest::prelude::*;

    /// A strip of triangles whose corners have these of five texture coordinates.
    fn strip(corners: &[[u32; 3]]) -> TriMesh {
        let count = corners.len() as u32;
        TriMesh {
            vertices: (0..count + 2).map(|i| Vec3::splat(i as f32)).collect(),
            faces: (0..count).map(|i| [i, i + 1, i + 2]).collect(),
            uvs: Some(Uvs {
                coordinates: (0..5).map(|i| Vec2::new(i as f32, 0.25 * i as f32)).collect(),
                faces: corners.to_vec(),
            }),
        }
    }

    proptest! {
        #[test]
        fn corners_keep_their_place_and_texture(
            corners in prop::collection::vec([0_u32..5, 0..5, 0..5], 1..40),
        ) {
            let mesh = strip(&corners);
            let seams = SeamSplit::new("a.glb".as_ref(), &mesh).unwrap();
            let uvs = seams.uvs.as_ref().unwrap();
            for (t, face) in seams.faces.iter().enumerate() {
                for c in 0..3 {
                    let vertex = face[c] as usize;
                    prop_assert_eq!(seams.sources[vertex], mesh.faces[t][c]);
                    let uv = Vec2::new(corners[t][c] as f32, 1.0 - 0.25 * corners[t][c] as f32);
                    prop_assert_eq!(uvs[vertex], uv);
                }
            }
            let own = 0..mesh.vertices.len() as u32;
            prop_assert!(seams.sources.iter().copied().take(own.len()).eq(own));
            let mut pairs: Vec<_> = seams.sources.iter().zip(uvs.iter().map(|uv| uv.x as u32)).collect();
            pairs.sort_unstable();
            pairs.dedup();
            prop_assert_eq!(pairs.len(), seams.len());
        }
    }

    #[test]
    fn meshes_that_cannot_be_written_are_refused() {
        let good = strip(&[[0, 1, 2]]);
        let refused = |change: fn(&mut TriMesh, &mut Uvs)| {
            let mut mesh = good.clone();
            let mut uvs = mesh.uvs.take().unwrap();
            change(&mut mesh, &mut uvs);
            mesh.uvs = Some(uvs);
            SeamSplit::new("a.glb".as_ref(), &mesh).is_err()
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
        assert!(refused(|_, uvs| uvs.coordinates[4].x = f32::INFINITY));
    }
}
