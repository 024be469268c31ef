//! Pushes of garment layers to the outer side of the layers beneath them.

use crate::{
    intersection::layers::{Layers, LayersBeneath},
    parallel::for_each_chunk,
};
use glam::Vec3;

/// Search radius for the layer beneath, metres: less than the thickness of a sleeve, so that cloth
/// is never moved through a limb.
const REACH_M: f32 = 0.03;

/// Smallest cosine between the direction to the layer beneath and its normal. Below it the vertex
/// is beyond a hem of that layer.
const MIN_RIM_COSINE: f32 = 0.3;

/// Distance to a layer below which the normal replaces the direction to it, metres: the direction
/// of a shorter vector is rounding noise.
const MIN_DISTANCE_M: f32 = 1e-4;

/// Number of vertices that one thread takes at a time.
const CHUNK: usize = 256;

/// Layers at their current positions.
#[derive(Clone, Debug)]
pub(super) struct LayerOrder {
    layer_of_vertex: Vec<u32>,
    layers_beneath: Vec<LayersBeneath>,
    /// Displacement of each vertex, metres.
    pushes: Vec<Vec3>,
}

impl LayerOrder {
    pub(super) fn new(layers: &Layers) -> Self {
        Self {
            layer_of_vertex: layers.layer_of_vertex().to_vec(),
            layers_beneath: layers.layers_beneath().to_vec(),
            pushes: vec![Vec3::ZERO; layers.layer_of_vertex().len()],
        }
    }

    /// Number of layers that have another one beneath.
    pub(super) fn len(&self) -> usize {
        self.layers_beneath.len()
    }

    /// Returns the vertices of layer `layer` + 1 that must move to lie over the layers beneath,
    /// with their displacements, metres. `positions` are those of the garment, metres.
    pub(super) fn pushes(
        &mut self,
        layer: usize,
        positions: &[Vec3],
        margin_m: f32,
    ) -> impl Iterator<Item = (usize, &Vec3)> {
        // The surface has the vertices of the garment and the faces of the layers beneath, so that
        // all positions can be passed as they are.
        self.layers_beneath[layer].surface.refit(positions);
        let (layer_of_vertex, beneath) = (&self.layer_of_vertex, &self.layers_beneath[layer]);
        for_each_chunk(&mut self.pushes, CHUNK, |first, pushes| {
            for (vertex, push) in (first..).zip(pushes) {
                let is_in_layer = layer_of_vertex[vertex] as usize == layer + 1;
                let found = is_in_layer
                    .then(|| beneath.push_over(positions[vertex], margin_m))
                    .flatten();
                *push = found.unwrap_or(Vec3::ZERO);
            }
        });
        self.pushes
            .iter()
            .enumerate()
            .filter(|(_, push)| **push != Vec3::ZERO)
    }
}

impl LayersBeneath {
    /// Displacement of a point to the margin over these layers; none for a point that is high
    /// enough or beyond their hems.
    fn push_over(&self, p: Vec3, margin_m: f32) -> Option<Vec3> {
        let hit = self.surface.closest_within(p, REACH_M.max(margin_m))?;
        let (height, normal) = (hit.signed_distance * self.outward, hit.normal * self.outward);
        if height >= margin_m {
            return None;
        }
        let direction = match hit.distance < MIN_DISTANCE_M {
            true => normal,
            false => (p - hit.point) / height,
        };
        (direction.dot(normal) > MIN_RIM_COSINE).then(|| hit.point + direction * margin_m - p)
    }
}
