//! Mesh in the form that is drawn.

use glam::{Vec2, Vec3};
use std::collections::HashMap;
use unic_core::mesh::{TriMesh, Uvs};

/// Faces of a body or garment, with places of the cloth's pattern. An asset, shared by all
/// characters that wear it.
#[derive(Clone, Debug)]
pub struct Mesh {
    vertices: usize,
    faces: Vec<[u32; 3]>,
    corners: Vec<Corner>,
    corner_faces: Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
    pattern: PatternSpace,
}

/// Drawn vertex: a vertex of the mesh may be several of them along a seam of the texture.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Corner {
    /// Index of the vertex of the mesh.
    pub(crate) source: u32,
    /// Place of the pattern, metres.
    pub(crate) pattern: Vec3,
}

/// Space of the places of a pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PatternSpace {
    /// Texture coordinates, in metres of cloth.
    Cloth,
    /// Positions of the rest shape.
    Rest,
}

impl Mesh {
    /// Prepares a mesh in its rest shape. The pattern of the cloth follows the texture coordinates,
    /// if there are any, else the rest positions.
    ///
    /// Faces and texture coordinates must be valid, see [`TriMesh::check`].
    pub fn new(rest: &TriMesh) -> Self {
        let (corners, corner_faces, pattern) = match &rest.uvs {
            Some(uvs) if metres_per_unit(rest, uvs) > 0.0 => {
                let (corners, faces) = split(rest, uvs);
                (corners, faces, PatternSpace::Cloth)
            }
            _ => (unsplit(rest), rest.faces.clone(), PatternSpace::Rest),
        };
        Self {
            vertices: rest.vertices.len(),
            faces: rest.faces.clone(),
            corners,
            corner_faces,
            edges: edges(&rest.faces),
            pattern,
        }
    }

    /// Number of vertices of the mesh, and so of each of its shapes.
    pub fn vertex_count(&self) -> usize {
        self.vertices
    }

    /// Triangles of vertex indices.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    pub(crate) fn corners(&self) -> &[Corner] {
        &self.corners
    }

    pub(crate) fn corner_faces(&self) -> &[[u32; 3]] {
        &self.corner_faces
    }

    pub(crate) fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    pub(crate) fn pattern(&self) -> PatternSpace {
        self.pattern
    }
}

fn unsplit(rest: &TriMesh) -> Vec<Corner> {
    let corner = |(source, &pattern): (u32, &Vec3)| Corner { source, pattern };
    (0..).zip(&rest.vertices).map(corner).collect()
}

/// Splits vertices where texture coordinates differ.
fn split(rest: &TriMesh, uvs: &Uvs) -> (Vec<Corner>, Vec<[u32; 3]>) {
    let scale = metres_per_unit(rest, uvs);
    let mut corners = Vec::new();
    let mut known = HashMap::new();
    let mut corner = |source: u32, uv: u32| {
        *known.entry((source, uv)).or_insert_with(|| {
            let place = uvs.coordinates[uv as usize] * scale;
            corners.push(Corner {
                source,
                pattern: place.extend(0.0),
            });
            (corners.len() - 1) as u32
        })
    };
    let faces = (rest.faces.iter().zip(&uvs.faces))
        .map(|(v, uv)| [corner(v[0], uv[0]), corner(v[1], uv[1]), corner(v[2], uv[2])])
        .collect();
    (corners, faces)
}

/// Metres of cloth in a unit of texture: the ratio of the sums of all edges' lengths.
fn metres_per_unit(rest: &TriMesh, uvs: &Uvs) -> f32 {
    let (mut metres, mut units) = (0.0f64, 0.0f64);
    for (face, uv) in rest.faces.iter().zip(&uvs.faces) {
        for i in 0..3 {
            let j = (i + 1) % 3;
            let at = |k: usize| rest.vertices[face[k] as usize];
            let place = |k: usize| -> Vec2 { uvs.coordinates[uv[k] as usize] };
            metres += f64::from(at(i).distance(at(j)));
            units += f64::from(place(i).distance(place(j)));
        }
    }
    match metres / units {
        scale if scale.is_finite() => scale as f32,
        _ => 0.0,
    }
}

fn edges(faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
    let mut edges: Vec<[u32; 2]> = (faces.iter().flat_map(sides))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> TriMesh {
        let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
    }

    #[test]
    fn a_seam_of_the_texture_splits_vertices_and_units_become_metres() {
        let mut mesh = square();
        // The second triangle lies elsewhere on the texture; a unit is ten metres of cloth.
        let place = |x: f32, y: f32| Vec2::new(x, y) * 0.1;
        mesh.uvs = Some(Uvs {
            coordinates: vec![
                place(0.0, 0.0),
                place(1.0, 0.0),
                place(1.0, 1.0),
                place(3.0, 0.0),
                place(4.0, 1.0),
                place(3.0, 1.0),
            ],
            faces: vec![[0, 1, 2], [3, 4, 5]],
        });
        let drawn = Mesh::new(&mesh);
        assert_eq!((drawn.vertex_count(), drawn.corners().len()), (4, 6));
        assert_eq!(drawn.pattern(), PatternSpace::Cloth);
        let sources: Vec<u32> = drawn.corners().iter().map(|c| c.source).collect();
        assert_eq!(sources, [0, 1, 2, 0, 2, 3]);
        assert!((drawn.corners()[2].pattern - Vec3::new(1.0, 1.0, 0.0)).length() < 1e-5);
        assert_eq!(drawn.edges().len(), 5);
    }

    #[test]
    fn without_a_texture_the_pattern_is_the_rest_position() {
        let drawn = Mesh::new(&square());
        assert_eq!(drawn.pattern(), PatternSpace::Rest);
        assert_eq!(drawn.corners()[2].pattern, Vec3::new(1.0, 1.0, 0.0));
        // Texture coordinates that are all equal tell no place either.
        let mut flat = square();
        flat.uvs = Some(Uvs {
            coordinates: vec![Vec2::ZERO],
            faces: vec![[0; 3]; 2],
        });
        assert_eq!(Mesh::new(&flat).pattern(), PatternSpace::Rest);
    }
}
