//! Layers of a garment, ordered from the inner to the outer.

use crate::{
    character::{Character, Garment},
    mesh::TriMesh,
    surface::Surface,
    topology::{components, weld},
};
use glam::Vec3;

/// Layer number of each vertex of a garment: 0 is next to the skin, 1 over it, and so on.
///
/// Asset, made once from the rest shape.
#[derive(Clone, Debug)]
pub struct Layers {
    layer_of_vertex: Vec<u32>,
    /// Layers under layer k + 1 in the rest shape, for each k.
    layers_beneath: Vec<LayersBeneath>,
}

/// Surface of all layers under one.
#[derive(Clone, Debug)]
pub(crate) struct LayersBeneath {
    pub(crate) surface: Surface,
    /// One where the normals of the faces point away from the body, minus one where they point to
    /// it.
    pub(crate) outward: f32,
}

/// Error of layer numbers that do not fit a garment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayersError {
    /// Numbers for another mesh.
    #[error("layers: expected one number for each of {expected} vertices, found {found}")]
    Vertices {
        /// Number of vertices of the garment.
        expected: usize,
        /// Number of layer numbers that were given.
        found: usize,
    },
    /// Layer number beyond the last possible one.
    #[error("layers: expected numbers up to {last}, found {found}")]
    TooMany {
        /// Last possible number: [`Layers::MAX_COUNT`] − 1.
        last: u32,
        /// Largest number that was given.
        found: u32,
    },
}

impl Layers {
    /// Largest number of layers of a garment.
    pub const MAX_COUNT: u32 = 16;

    /// Makes layers from the layer number of each vertex.
    ///
    /// # Errors
    /// Fails when the number of vertices is not the garment's, or when there are too many layers.
    pub fn new(
        character: &Character,
        garment: &Garment,
        layer_of_vertex: Vec<u32>,
    ) -> Result<Self, LayersError> {
        let (expected, found) = (garment.rest.vertices.len(), layer_of_vertex.len());
        if expected != found {
            return Err(LayersError::Vertices { expected, found });
        }
        let outermost = layer_of_vertex.iter().copied().max().unwrap_or(0);
        if outermost >= Self::MAX_COUNT {
            return Err(LayersError::TooMany {
                last: Self::MAX_COUNT - 1,
                found: outermost,
            });
        }
        let body = Surface::build(&character.body);
        let beneath =
            |layer| LayersBeneath::new(&body, &garment.rest, |v| layer_of_vertex[v as usize] < layer);
        Ok(Self {
            layers_beneath: (1..=outermost).map(beneath).collect(),
            layer_of_vertex,
        })
    }

    /// Makes a layer of each connected component of a garment, in the order of their median height
    /// over the body at rest. Components beyond [`Layers::MAX_COUNT`] share the last layer.
    pub fn from_components(character: &Character, garment: &Garment) -> Self {
        let rest = &garment.rest;
        let welded = weld(&rest.vertices);
        let faces: Vec<[u32; 3]> = (rest.faces.iter())
            .map(|f| f.map(|v| welded[v as usize]))
            .collect();
        let components = components(rest.vertices.len(), &faces);
        let component = |vertex: usize| components.of_vertex[welded[vertex] as usize];
        let body = Surface::build(&character.body);
        let mut heights = vec![Vec::new(); components.count];
        for (vertex, &p) in rest.vertices.iter().enumerate() {
            let height = body.closest(p).map_or(0.0, |hit| hit.signed_distance);
            heights[component(vertex) as usize].push(height);
        }
        let rank = ranks(heights.into_iter().map(median).collect());
        let last = Self::MAX_COUNT - 1;
        let layers = (0..rest.vertices.len()).map(|v| rank[component(v) as usize].min(last));
        // One number a vertex, none too large: `new` accepts them.
        Self::new(character, garment, layers.collect()).unwrap_or(Self {
            layer_of_vertex: Vec::new(),
            layers_beneath: Vec::new(),
        })
    }

    /// Layer number of each vertex.
    pub fn layer_of_vertex(&self) -> &[u32] {
        &self.layer_of_vertex
    }

    /// Layers under each layer but the innermost.
    pub(crate) fn layers_beneath(&self) -> &[LayersBeneath] {
        &self.layers_beneath
    }
}

impl LayersBeneath {
    fn new(body: &Surface, rest: &TriMesh, is_beneath: impl Fn(u32) -> bool) -> Self {
        let faces = rest
            .faces
            .iter()
            .filter(|face| face.iter().all(|&v| is_beneath(v)));
        let mesh = TriMesh {
            vertices: rest.vertices.clone(),
            faces: faces.copied().collect(),
            uvs: None,
        };
        // The garment's winding may be either way: the body next to it decides, by a vote of all
        // faces.
        let agreement: f32 = mesh
            .faces
            .iter()
            .map(|face| outward_area(body, face.map(|v| rest.vertices[v as usize])))
            .sum();
        Self {
            surface: Surface::build(&mesh),
            outward: if agreement < 0.0 { -1.0 } else { 1.0 },
        }
    }
}

/// Twice the area of a face times the cosine between its normal and that of the body next to it,
/// m².
fn outward_area(body: &Surface, [a, b, c]: [Vec3; 3]) -> f32 {
    let normal = body
        .closest((a + b + c) / 3.0)
        .map_or(Vec3::ZERO, |hit| hit.normal);
    (b - a).cross(c - a).dot(normal)
}

/// Median, the upper one of an even number of values; none without values.
fn median(mut values: Vec<f32>) -> Option<f32> {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Rank of each value in ascending order; zero for a missing one.
fn ranks(values: Vec<Option<f32>>) -> Vec<u32> {
    let present = values
        .iter()
        .enumerate()
        .filter_map(|(i, value)| Some((i, (*value)?)));
    let mut order: Vec<(usize, f32)> = present.collect();
    // Equal heights are ordered by component, so that the result is unique.
    order.sort_by(|(i, a), (j, b)| a.total_cmp(b).then(i.cmp(j)));
    let order = order.into_iter().map(|(i, _)| i);
    let mut ranks = vec![0; values.len()];
    order.zip(0..).for_each(|(at, rank)| ranks[at] = rank);
    ranks
}
