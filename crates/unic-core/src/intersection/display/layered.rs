//! Layers of a garment on one another.

use crate::{
    intersection::layers::{Layers, Under},
    parallel::for_each_chunk,
};
use glam::Vec3;

/// How deep under another layer one is looked for, metres: less than a sleeve is thick, so that
/// cloth is never taken through a limb.
const REACH_M: f32 = 0.03;

/// Cosine between the way to the layer beneath and its normal below which a vertex is beyond a hem.
const LEAST_COSINE: f32 = 0.3;

/// Closer to a layer than this the way to it has no direction but the normal, metres.
const LEAST_DISTANCE_M: f32 = 1e-4;

/// Vertices that one thread takes at a time.
const CHUNK: usize = 256;

/// Layers and where they are now.
#[derive(Clone, Debug)]
pub(super) struct Layered {
    of_vertices: Vec<u32>,
    under: Vec<Under>,
    /// By vertex, metres.
    ways: Vec<Vec3>,
}

impl Layered {
    pub(super) fn new(layers: &Layers) -> Self {
        Self {
            of_vertices: layers.of_vertices().to_vec(),
            under: layers.under().to_vec(),
            ways: vec![Vec3::ZERO; layers.of_vertices().len()],
        }
    }

    /// Layers that have something under them.
    pub(super) fn len(&self) -> usize {
        self.under.len()
    }

    /// The vertices that have to move to lie over what is under their layer, with their ways; takes the
    /// garment's positions, metres.
    pub(super) fn ways(
        &mut self,
        layer: usize,
        positions: &[Vec3],
        margin_m: f32,
    ) -> impl Iterator<Item = (usize, &Vec3)> {
        self.under[layer].surface.refit(positions);
        let (of_vertices, under) = (&self.of_vertices, &self.under[layer]);
        for_each_chunk(&mut self.ways, CHUNK, |first, ways| {
            for (vertex, way) in (first..).zip(ways) {
                let is_over = of_vertices[vertex] as usize == layer + 1;
                let out = is_over
                    .then(|| under.way_out(positions[vertex], margin_m))
                    .flatten();
                *way = out.unwrap_or(Vec3::ZERO);
            }
        });
        self.ways
            .iter()
            .enumerate()
            .filter(|(_, way)| **way != Vec3::ZERO)
    }
}

impl Under {
    /// What takes a place to the margin over these layers; none when it is there, and beyond their hems.
    fn way_out(&self, p: Vec3, margin_m: f32) -> Option<Vec3> {
        let hit = self.surface.closest_within(p, REACH_M.max(margin_m))?;
        let (height, normal) = (hit.signed_distance * self.outward, hit.normal * self.outward);
        if height >= margin_m {
            return None;
        }
        let direction = match hit.distance < LEAST_DISTANCE_M {
            true => normal,
            false => (p - hit.point) / height,
        };
        (direction.dot(normal) > LEAST_COSINE).then(|| hit.point + direction * margin_m - p)
    }
}
