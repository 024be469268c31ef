//! The layers of a garment, from the inner to the outer.

use crate::{
    character::{Character, Garment},
    mesh::TriMesh,
    surface::Surface,
    topology::{components, weld},
};
use glam::Vec3;

/// Which layer of a garment each vertex belongs to: 0 is next to the skin, 1 over it, and so on.
///
/// Asset, made once from the rest shape.
#[derive(Clone, Debug)]
pub struct Layers {
    of_vertices: Vec<u32>,
    /// For layer k + 1: what lies under it, in the rest shape.
    under: Vec<Under>,
}

/// The layers under one.
#[derive(Clone, Debug)]
pub(crate) struct Under {
    pub(crate) surface: Surface,
    /// One where the faces' normals point away from the body, minus one where they point to it.
    pub(crate) outward: f32,
}

/// Layers that do not suit a garment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayersError {
    /// Another mesh's.
    #[error("layers of {found} vertices, where the garment has {expected}")]
    Vertices {
        /// The garment's vertices.
        expected: usize,
        /// Given.
        found: usize,
    },
    /// A layer number that no garment needs.
    #[error("layer {found}, where {most} is the last that there may be")]
    TooMany {
        /// [`Layers::MOST`] − 1.
        most: u32,
        /// Given.
        found: u32,
    },
}

impl Layers {
    /// Layers that a garment may have.
    pub const MOST: u32 = 16;

    /// By vertex, for garments whose parts have names.
    ///
    /// # Errors
    /// Another number of vertices than the garment's, too many layers.
    pub fn new(character: &Character, garment: &Garment, of_vertices: Vec<u32>) -> Result<Self, LayersError> {
        let (expected, found) = (garment.rest.vertices.len(), of_vertices.len());
        if expected != found {
            return Err(LayersError::Vertices { expected, found });
        }
        let last = of_vertices.iter().copied().max().unwrap_or(0);
        if last >= Self::MOST {
            let (most, found) = (Self::MOST - 1, last);
            return Err(LayersError::TooMany { most, found });
        }
        let body = Surface::build(&character.body);
        let under =
            (1..=last).map(|layer| Under::new(&body, &garment.rest, |v| of_vertices[v as usize] < layer));
        Ok(Self {
            under: under.collect(),
            of_vertices,
        })
    }

    /// Of a garment's connected parts: each is a layer, in the order of their median height over the
    /// body at rest; parts beyond [`Layers::MOST`] are in the last.
    pub fn of_parts(character: &Character, garment: &Garment) -> Self {
        let rest = &garment.rest;
        let first_at = weld(&rest.vertices);
        let faces: Vec<[u32; 3]> = (rest.faces.iter())
            .map(|f| f.map(|v| first_at[v as usize]))
            .collect();
        let (parts, count) = components(rest.vertices.len(), &faces);
        let part = |vertex: usize| parts[first_at[vertex] as usize];
        let body = Surface::build(&character.body);
        let mut heights = vec![Vec::new(); count];
        for (vertex, &p) in rest.vertices.iter().enumerate() {
            let height = body.closest(p).map_or(0.0, |hit| hit.signed_distance);
            heights[part(vertex) as usize].push(height);
        }
        let rank = ranks(heights.into_iter().map(median).collect());
        let of_vertices = (0..rest.vertices.len()).map(|v| rank[part(v) as usize].min(Self::MOST - 1));
        let of_vertices: Vec<u32> = of_vertices.collect();
        Self::new(character, garment, of_vertices).unwrap_or(Self {
            of_vertices: Vec::new(),
            under: Vec::new(),
        })
    }

    /// The layer of each vertex.
    pub fn of_vertices(&self) -> &[u32] {
        &self.of_vertices
    }

    /// What lies under each layer but the innermost.
    pub(crate) fn under(&self) -> &[Under] {
        &self.under
    }
}

impl Under {
    fn new(body: &Surface, rest: &TriMesh, is_under: impl Fn(u32) -> bool) -> Self {
        let faces = rest.faces.iter().filter(|face| face.iter().all(|&v| is_under(v)));
        let mesh = TriMesh {
            vertices: rest.vertices.clone(),
            faces: faces.copied().collect(),
            uvs: None,
        };
        let along: f32 = mesh
            .faces
            .iter()
            .map(|face| cosine(body, face.map(|v| rest.vertices[v as usize])))
            .sum();
        Self {
            surface: Surface::build(&mesh),
            outward: if along < 0.0 { -1.0 } else { 1.0 },
        }
    }
}

/// Between a face's area normal and that of the body next to it, times the face's area.
fn cosine(body: &Surface, [a, b, c]: [Vec3; 3]) -> f32 {
    let normal = body
        .closest((a + b + c) / 3.0)
        .map_or(Vec3::ZERO, |hit| hit.normal);
    (b - a).cross(c - a).dot(normal)
}

/// None without values.
fn median(mut values: Vec<f32>) -> Option<f32> {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied()
}

/// The place of each value in their order; zero for none.
fn ranks(values: Vec<Option<f32>>) -> Vec<u32> {
    let there = values
        .iter()
        .enumerate()
        .filter_map(|(i, value)| Some((i, (*value)?)));
    let mut order: Vec<(usize, f32)> = there.collect();
    order.sort_by(|(i, a), (j, b)| a.total_cmp(b).then(i.cmp(j)));
    let order = order.into_iter().map(|(i, _)| i);
    let mut ranks = vec![0; values.len()];
    order.zip(0..).for_each(|(at, rank)| ranks[at] = rank);
    ranks
}
