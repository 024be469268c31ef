//! Vertices split at texture seams, for engines and files with one texture coordinate a vertex.

use super::{TriMesh, Uvs};
use glam::Vec2;
use std::collections::HashMap;

/// Mesh in which every vertex has one texture coordinate.
///
/// The vertices of the mesh come first, in its order, with the texture coordinate of their first
/// corner. Every other coordinate of a vertex makes one copy of it, after all of them. Shapes: V
/// vertices of the mesh, S ≥ V vertices with copies, F triangles.
///
/// ```
/// use glam::{Vec2, Vec3};
/// use unic_core::mesh::{SeamSplit, TriMesh, Uvs};
///
/// // Two triangles over a square, with a seam of the texture at one end of the diagonal.
/// let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
/// let mut mesh = TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
/// let coordinates = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 0.5], [0.0, 1.0]];
/// mesh.uvs = Some(Uvs {
///     coordinates: coordinates.map(Vec2::from_array).to_vec(),
///     faces: vec![[0, 1, 2], [0, 3, 4]],
/// });
/// let split = SeamSplit::new(&mesh);
/// assert_eq!(split.sources, [0, 1, 2, 3, 2]);
/// assert_eq!(split.faces, [[0, 1, 2], [0, 4, 3]]);
/// assert!(split.spread(&["a", "b", "c", "d"]).eq(["a", "b", "c", "d", "c"]));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeamSplit {
    /// Vertex of the mesh that each vertex is a copy of (S).
    pub sources: Vec<u32>,
    /// Texture coordinate of each vertex (S), v upwards; zero for a vertex that no corner uses. None
    /// if the mesh has no texture coordinates, or some that do not fit its faces.
    pub uvs: Option<Vec<Vec2>>,
    /// Triangles (F) as indices into `sources`, wound as those of the mesh.
    pub faces: Vec<[u32; 3]>,
}

impl SeamSplit {
    /// Splits the vertices of a mesh.
    ///
    /// # Panics
    /// When a face names a vertex that does not exist; [`TriMesh::check`] finds it.
    pub fn new(mesh: &TriMesh) -> Self {
        let mut split = Self {
            sources: (0..mesh.vertices.len() as u32).collect(),
            uvs: None,
            faces: mesh.faces.clone(),
        };
        if let Some(uvs) = mesh.uvs.as_ref().filter(|uvs| uvs.fit(&mesh.faces)) {
            split.add_uvs(uvs);
        }
        split
    }

    fn add_uvs(&mut self, uvs: &Uvs) {
        let mut own: Vec<Option<Vec2>> = vec![None; self.sources.len()];
        let mut copies = HashMap::new();
        for (face, corners) in self.faces.iter_mut().zip(&uvs.faces) {
            for (vertex, &corner) in face.iter_mut().zip(corners) {
                let uv = uvs.coordinates[corner as usize];
                // By value and not by index: files repeat equal coordinates.
                if *own[*vertex as usize].get_or_insert(uv) == uv {
                    continue;
                }
                let key = (*vertex, uv.to_array().map(f32::to_bits));
                *vertex = *copies.entry(key).or_insert_with(|| {
                    self.sources.push(*vertex);
                    own.push(Some(uv));
                    self.sources.len() as u32 - 1
                });
            }
        }
        self.uvs = Some(own.into_iter().map(Option::unwrap_or_default).collect());
    }

    /// Number of vertices, copies included (S).
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Returns whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Returns for each vertex (S) the value of the mesh's vertex (V) that it is a copy of.
    ///
    /// # Panics
    /// While iterating, if there are fewer values than vertices of the mesh.
    pub fn spread<'a, T: Copy>(&'a self, values: &'a [T]) -> impl ExactSizeIterator<Item = T> + 'a {
        self.sources.iter().map(|&vertex| values[vertex as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;

    /// Triangles between six vertices, whose corners have these of seven texture coordinates. The last
    /// two coordinates are equal.
    fn mesh(corners: &[[(u32, u32); 3]]) -> TriMesh {
        let u = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 5.0];
        TriMesh {
            vertices: (0..6).map(|i| Vec3::splat(i as f32)).collect(),
            faces: corners.iter().map(|face| face.map(|(v, _)| v)).collect(),
            uvs: Some(Uvs {
                coordinates: u.map(|u| Vec2::new(u, 0.25 * u)).to_vec(),
                faces: corners.iter().map(|face| face.map(|(_, uv)| uv)).collect(),
            }),
        }
    }

    fn corner() -> impl Strategy<Value = (u32, u32)> {
        (0_u32..6, 0_u32..7)
    }

    proptest! {
        #[test]
        fn corners_keep_their_place_and_texture_with_as_few_vertices_as_can_be(
            corners in prop::collection::vec([corner(), corner(), corner()], 0..40),
        ) {
            let mesh = mesh(&corners);
            let coordinates = &mesh.uvs.as_ref().unwrap().coordinates;
            let split = SeamSplit::new(&mesh);
            let uvs = split.uvs.as_ref().unwrap();
            prop_assert_eq!(uvs.len(), split.len());
            prop_assert_eq!(split.faces.len(), corners.len());
            for (face, expected) in split.faces.iter().zip(&corners) {
                for (&vertex, &(source, uv)) in face.iter().zip(expected) {
                    prop_assert_eq!(split.sources[vertex as usize], source);
                    prop_assert_eq!(uvs[vertex as usize], coordinates[uv as usize]);
                }
            }
            // The mesh's own vertices come first, and each other vertex has a corner.
            prop_assert!(split.sources.iter().copied().take(6).eq(0..6));
            let used = |vertex: u32| split.faces.as_flattened().contains(&vertex);
            prop_assert!((6..split.len() as u32).all(used));
            let mut pairs: Vec<_> =
                split.spread(&[0_u8, 1, 2, 3, 4, 5]).zip(uvs.iter().map(|uv| uv.x as u32)).collect();
            pairs.sort_unstable();
            pairs.dedup();
            prop_assert_eq!(pairs.len(), split.len());
        }
    }

    #[test]
    fn a_mesh_without_texture_is_itself() {
        let mesh = TriMesh {
            uvs: None,
            ..mesh(&[[(0, 0), (1, 0), (2, 0)]])
        };
        let split = SeamSplit::new(&mesh);
        assert_eq!(split.sources, [0, 1, 2, 3, 4, 5]);
        assert_eq!((split.uvs, split.faces), (None, mesh.faces));
    }

    #[test]
    fn coordinates_that_do_not_fit_are_left_out() {
        let good = mesh(&[[(0, 0), (1, 1), (2, 2)], [(0, 3), (1, 1), (3, 0)]]);
        assert_eq!(SeamSplit::new(&good).len(), 7);
        let changes: [fn(&mut Uvs); 2] = [|uvs| uvs.faces[1][2] = 7, |uvs| uvs.faces.truncate(1)];
        for change in changes {
            let mut mesh = good.clone();
            change(mesh.uvs.as_mut().unwrap());
            let split = SeamSplit::new(&mesh);
            assert_eq!((split.len(), split.uvs, split.faces), (6, None, mesh.faces));
        }
    }
}
