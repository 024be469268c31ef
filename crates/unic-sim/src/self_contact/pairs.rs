//! Which vertices are near which faces of the same garment, and on which side.

use super::{
    grid::PointGrid,
    rest_shape::RestShape,
    search::{Chunk, Search},
    sieve::Reach,
};
use crate::Particles;
use glam::Vec3;
use rayon::prelude::*;

/// Faces that one thread takes at a time.
const FACES_A_CHUNK: usize = 512;

/// Room beyond thickness and travel within which a pair is watched, metres: what constraints add to
/// straight motion within an interval.
const MARGIN_M: f32 = 0.002;

/// Travel relative to each other that is looked ahead, metres: 10 mm in 8 ms are 1.2 m/s.
const MOST_TRAVEL_M: f32 = 0.01;

/// How far beside a face a vertex is watched beyond its travel, metres.
const SLIDE_M: f32 = 0.001;

/// Least size of a grid cell, in mean edge lengths.
const CELL_EDGES: f32 = 2.0;

/// A vertex held on one side of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) vertex: u32,
    pub(super) face: u32,
    /// 1 in front of the face, −1 behind it.
    pub(super) side: f32,
    /// Distance to keep, metres.
    pub(super) thickness_m: f32,
    /// The vertex projects into the face: its side is knowledge, and not a guess.
    pub(super) is_over: bool,
}

/// The pairs of an interval, by face.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs {
    pub(super) all: Vec<Pair>,
    memory: Memory,
    grid: PointGrid,
    chunks: Vec<Chunk>,
}

/// The last interval's pairs by vertex.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    /// Pairs of vertex i are `pairs[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    pairs: Vec<Pair>,
}

impl Pairs {
    /// Finds the pairs that may touch within `seconds`.
    pub(super) fn collect(
        &mut self,
        rest: &RestShape,
        particles: &Particles,
        seconds: f32,
        thickness_m: f32,
    ) {
        self.memory.take(&mut self.all, rest.vertex_count());
        let reach = Reach {
            above_m: thickness_m + MARGIN_M,
            beside_m: SLIDE_M,
            seconds,
            most_travel_m: MOST_TRAVEL_M,
        };
        let most_speed = 2.0 * speed_around_mean(&particles.velocities);
        let cell_m = reach.distance_m(most_speed).max(CELL_EDGES * rest.mean_edge_m);
        self.grid
            .build(&particles.positions, &particles.velocities, cell_m);
        let search = Search {
            rest,
            particles,
            reach,
            most_speed,
            thickness_m,
            grid: &self.grid,
            memory: &self.memory,
        };
        let count = rest.faces.len().div_ceil(FACES_A_CHUNK);
        self.chunks.resize_with(count, Chunk::default);
        self.chunks.par_iter_mut().enumerate().for_each(|(index, chunk)| {
            let first = index * FACES_A_CHUNK;
            search.faces(first..rest.faces.len().min(first + FACES_A_CHUNK), chunk);
        });
        self.all.extend(self.chunks.iter().flat_map(|chunk| &chunk.pairs));
    }

    /// Forgets all pairs and sides.
    pub(super) fn clear(&mut self) {
        self.all.clear();
    }
}

impl Memory {
    /// Takes the pairs, leaving `all` empty.
    fn take(&mut self, all: &mut Vec<Pair>, vertex_count: usize) {
        self.starts.clear();
        self.starts.resize(vertex_count + 1, 0);
        all.iter().for_each(|pair| self.starts[pair.vertex as usize] += 1);
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.pairs.clear();
        // The first pair only fills the places, each of which is then written.
        self.pairs
            .extend(all.first().iter().cycle().take(all.len()).copied());
        for pair in all.iter().rev() {
            let start = &mut self.starts[pair.vertex as usize];
            *start -= 1;
            self.pairs[*start as usize] = *pair;
        }
        all.clear();
    }

    #[inline]
    pub(super) fn of(&self, vertex: u32) -> &[Pair] {
        let row = self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize;
        &self.pairs[row]
    }
}

/// Largest speed relative to the mean velocity, m/s.
fn speed_around_mean(velocities: &[Vec3]) -> f32 {
    let mean = velocities.iter().sum::<Vec3>() / velocities.len().max(1) as f32;
    let squared = velocities.iter().map(|v| v.distance_squared(mean));
    squared.fold(0.0, f32::max).sqrt()
}
