//! Midpoint subdivision: finer meshes of the same shape.
//!
//! For tools that make a finer mesh of a garment.

use crate::mesh::{TriMesh, Uvs};
use std::collections::HashMap;

/// Result of a subdivision.
#[derive(Clone, Debug)]
pub struct Subdivided {
    /// Finer mesh.
    pub mesh: TriMesh,
    /// Two vertices of the coarse mesh for every vertex of the finer one. The mean of a quantity at
    /// the two is its value at the vertex. A vertex of the coarse mesh has its own index twice.
    pub parents: Vec<[u32; 2]>,
}

/// Splits every face into four at the midpoints of its edges.
///
/// The vertices of `mesh` stay first and in order; one vertex per edge follows. Seam vertices at
/// the same place stay duplicated, and their midpoints are equal to the bit. Texture coordinates
/// are subdivided too.
pub fn subdivided(mesh: &TriMesh) -> Subdivided {
    let SplitFaces { faces, parents } = split(&mesh.faces, mesh.vertices.len());
    let uvs = mesh.uvs.as_ref().map(|uvs| {
        let SplitFaces { faces, parents } = split(&uvs.faces, uvs.coordinates.len());
        Uvs {
            coordinates: means(&uvs.coordinates, &parents),
            faces,
        }
    });
    let mesh = TriMesh {
        vertices: means(&mesh.vertices, &parents),
        faces,
        uvs,
    };
    Subdivided { mesh, parents }
}

/// Mean of the values of each pair of parents.
fn means<T>(values: &[T], parents: &[[u32; 2]]) -> Vec<T>
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
{
    let mean = |&[a, b]: &[u32; 2]| (values[a as usize] + values[b as usize]) * 0.5;
    parents.iter().map(mean).collect()
}

/// Topology of a subdivision.
struct SplitFaces {
    faces: Vec<[u32; 3]>,
    parents: Vec<[u32; 2]>,
}

/// Splits faces at the midpoints of their edges, without positions.
fn split(faces: &[[u32; 3]], vertices: usize) -> SplitFaces {
    let mut parents: Vec<[u32; 2]> = (0..vertices as u32).map(|v| [v, v]).collect();
    // The map is only looked up; midpoints are numbered in the order of the faces.
    let mut midpoints = HashMap::new();
    let mut middle = |a: u32, b: u32| {
        // A degenerate face may name a vertex twice.
        if a == b {
            return a;
        }
        *midpoints.entry([a.min(b), a.max(b)]).or_insert_with_key(|&edge| {
            parents.push(edge);
            parents.len() as u32 - 1
        })
    };
    let mut finer = Vec::with_capacity(4 * faces.len());
    for &[a, b, c] in faces {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    SplitFaces {
        faces: finer,
        parents,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        mesh::vertex_normals,
        test_meshes::{cube, sheet},
        topology::{edges, weld},
    };
    use glam::{Vec2, Vec3};

    fn area(mesh: &TriMesh) -> f32 {
        let corners = |f: &[u32; 3]| f.map(|v| mesh.vertices[v as usize]);
        let double = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).length();
        mesh.faces.iter().map(|f| 0.5 * double(corners(f))).sum()
    }

    #[test]
    fn shape_order_and_orientation_stay() {
        let coarse = cube();
        let Subdivided { mesh: fine, parents } = subdivided(&coarse);
        assert_eq!(fine.vertices[..8], coarse.vertices);
        assert_eq!(fine.vertices.len(), 8 + edges(&coarse.faces).len());
        assert_eq!(fine.faces.len(), 4 * coarse.faces.len());
        assert_eq!(parents.len(), fine.vertices.len());
        assert!((area(&fine) - area(&coarse)).abs() < 1e-4);
        let mut normals = Vec::new();
        vertex_normals(&fine.vertices, &fine.faces, &mut normals);
        assert!(normals.iter().zip(&fine.vertices).all(|(n, v)| n.dot(*v) > 0.9));
        assert!(fine.check().is_ok());
    }

    #[test]
    fn seams_stay_duplicated_and_equal() {
        // Two triangles at the same edge, which share none of its vertices and name them in
        // opposite order.
        let edge = [Vec3::new(0.1, 0.2, 0.3), Vec3::new(-0.7, 0.11, 0.13)];
        let vertices = vec![edge[0], edge[1], Vec3::Z, edge[1], edge[0], Vec3::NEG_Z];
        let fine = subdivided(&TriMesh::new(vertices, vec![[0, 1, 2], [3, 4, 5]]).unwrap()).mesh;
        assert_eq!(fine.vertices.len(), 12);
        let first_at = weld(&fine.vertices);
        let duplicates = (0..12).filter(|&i| first_at[i] as usize != i);
        assert_eq!(duplicates.count(), 3);
        assert_eq!(fine.vertices[6], fine.vertices[9]);
    }

    #[test]
    fn texture_coordinates_follow_the_corners() {
        let mut coarse = sheet(2, 1, 1.0);
        let flat = |v: &Vec3| Vec2::new(v.x, v.z);
        coarse.uvs = Some(Uvs {
            coordinates: coarse
                .faces
                .iter()
                .flatten()
                .map(|&v| flat(&coarse.vertices[v as usize]))
                .collect(),
            faces: (0..coarse.faces.len() as u32)
                .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
                .collect(),
        });
        let fine = subdivided(&coarse).mesh;
        let uvs = fine.uvs.unwrap();
        for (face, uv_face) in fine.faces.iter().zip(&uvs.faces) {
            for (v, t) in face.iter().zip(uv_face) {
                assert_eq!(flat(&fine.vertices[*v as usize]), uvs.coordinates[*t as usize]);
            }
        }
    }
}
