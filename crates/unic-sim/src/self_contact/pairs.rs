//! The pairs of vertices and faces that may touch in an interval.

use super::{
    cull::Reach,
    grid::PointGrid,
    pair::{ContactPair, PreviousPairs},
    rest_shape::RestShape,
    search::{PairSearch, SearchChunk},
};
use crate::Particles;
use glam::Vec3;
use rayon::prelude::*;

/// Number of faces in a rayon task.
const FACES_PER_CHUNK: usize = 512;

/// Margin beyond thickness and travel within which pairs are collected, metres. It covers the
/// displacement by constraints within an interval.
const MARGIN_M: f32 = 0.002;

/// Largest predicted travel of a pair relative to each other, metres: 1.2 m/s for 8 ms.
/// It bounds the number of pairs; pairs that approach faster may be missed.
const MAX_TRAVEL_M: f32 = 0.01;

/// Margin beside a face within which pairs are collected, beyond their travel, metres.
const SLIDE_M: f32 = 0.001;

/// Smallest size of a grid cell, in mean edge lengths.
const CELL_EDGES: f32 = 2.0;

/// The pairs of an interval, sorted by face, with the scratch of their search.
#[derive(Clone, Debug, Default)]
pub(super) struct ContactPairs {
    pub(super) all: Vec<ContactPair>,
    previous: PreviousPairs,
    grid: PointGrid,
    chunks: Vec<SearchChunk>,
}

impl ContactPairs {
    /// Collects the pairs that may touch within `seconds`. `thickness_m` is the distance between
    /// layers.
    pub(super) fn collect(
        &mut self,
        rest: &RestShape,
        particles: &Particles,
        seconds: f32,
        thickness_m: f32,
    ) {
        self.previous.take(&mut self.all, rest.vertex_count());
        let reach = Reach {
            above_m: thickness_m + MARGIN_M,
            beside_m: SLIDE_M,
            seconds,
            max_travel_m: MAX_TRAVEL_M,
        };
        // Two particles can move apart from the mean in opposite directions.
        let max_speed = 2.0 * max_speed_around_mean(&particles.velocities);
        // Cells as large as a query's reach: larger cells hold too many points, smaller ones make
        // too many ranges.
        let cell_m = reach.distance_m(max_speed).max(CELL_EDGES * rest.mean_edge_m);
        self.grid
            .build(&particles.positions, &particles.velocities, cell_m);
        let search = PairSearch {
            rest,
            particles,
            reach,
            max_speed,
            thickness_m,
            grid: &self.grid,
            previous: &self.previous,
        };
        let count = rest.faces.len().div_ceil(FACES_PER_CHUNK);
        self.chunks.resize_with(count, SearchChunk::default);
        self.chunks.par_iter_mut().enumerate().for_each(|(index, chunk)| {
            let first = index * FACES_PER_CHUNK;
            search.faces(first..rest.faces.len().min(first + FACES_PER_CHUNK), chunk);
        });
        // Joined in the order of the faces, whichever thread has found them.
        self.all.extend(self.chunks.iter().flat_map(|chunk| &chunk.pairs));
    }

    /// Forgets all pairs and sides.
    pub(super) fn clear(&mut self) {
        self.all.clear();
    }
}

/// Returns the largest speed of a particle relative to the mean velocity, m/s.
fn max_speed_around_mean(velocities: &[Vec3]) -> f32 {
    let mean = velocities.iter().sum::<Vec3>() / velocities.len().max(1) as f32;
    let squared = velocities.iter().map(|v| v.distance_squared(mean));
    squared.fold(0.0, f32::max).sqrt()
}
