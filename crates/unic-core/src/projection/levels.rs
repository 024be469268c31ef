//! Coarse levels of a projection: chords between well-spread vertices, solved and smoothed before the
//! edges.

use super::{
    Edge, StrainLimit,
    constraints::{Constraints, Sweeps},
    freedom::Freedom,
    stencil::level_stencils,
    sweep::{PART, Stencil},
};
use crate::{
    config::ProjectionConfig,
    mesh::TriMesh,
    parallel::for_each_chunk,
    sampling::{InterpolationRow, Sampling, rows_of},
    topology::edges,
};
use glam::{Vec3, Vec3A};
use std::{cmp::Reverse, collections::BinaryHeap};

/// Number of vertices for each sample of the finest level.
const VERTICES_PER_SAMPLE: usize = 16;

/// Number of samples of a level for each of the next coarser one.
const RATIO: usize = 4;

/// Least number of samples of a level.
const LEAST_SAMPLES: usize = 48;

/// Samples of all levels, and the chords between them.
#[derive(Clone, Debug)]
pub(super) struct LevelTopology {
    /// Vertices that are samples. The first ones are those of the coarser levels.
    samples: Vec<u32>,
    /// Number of samples and the chords of each level, coarsest first. Chords are pairs of places in
    /// `samples`, the lower one first, in ascending order.
    levels: Vec<(usize, Vec<[u32; 2]>)>,
    /// Interpolation of every vertex from the samples of the finest level; empty without levels.
    rows: Vec<InterpolationRow>,
}

impl LevelTopology {
    /// Takes samples of a garment's rest mesh, whose `faces` name the first vertex at each place, as
    /// `first_at_place` lists them. A small garment has no levels.
    pub(super) fn new(rest: &TriMesh, faces: &[[u32; 3]], first_at_place: &[u32]) -> Self {
        let none = Self {
            samples: Vec::new(),
            levels: Vec::new(),
            rows: Vec::new(),
        };
        let vertices = rest.vertices.len();
        if vertices < VERTICES_PER_SAMPLE * LEAST_SAMPLES {
            return none;
        }
        // The share is above 0 and at most 1, so that there is a sampling.
        let Ok(sampling) = Sampling::of_share(rest, (VERTICES_PER_SAMPLE as f32).recip()) else {
            return none;
        };
        // Only the first vertex at a place is solved for, and has edges.
        let first = |&v: &u32| first_at_place[v as usize];
        let samples: Vec<u32> = sampling.samples().iter().map(first).collect();
        let finer = |count: &usize| Some(count / RATIO).filter(|count| *count >= LEAST_SAMPLES);
        let mut counts: Vec<usize> = std::iter::successors(Some(samples.len()), finer).collect();
        counts.reverse();
        let graph = Graph::new(rest, faces);
        let level = |&count: &usize| (count, graph.chords(&samples[..count]));
        Self {
            levels: counts.iter().map(level).collect(),
            rows: sampling.into_rows(),
            samples,
        }
    }

    /// Number of samples and chords of each level, coarsest first. A chord is a pair of vertices.
    pub(super) fn levels(&self) -> impl Iterator<Item = (usize, impl Iterator<Item = [u32; 2]>)> {
        let vertices = |chord: &[u32; 2]| chord.map(|place| self.samples[place as usize]);
        let levels = self.levels.iter();
        levels.map(move |(count, chords)| (*count, chords.iter().map(vertices)))
    }

    /// Chords of all levels in their order.
    pub(super) fn chords(&self) -> impl Iterator<Item = [u32; 2]> {
        self.levels().flat_map(|(_, chords)| chords)
    }
}

/// Edges of a welded mesh by vertex.
struct Graph {
    edges: Vec<[u32; 2]>,
    /// Neighbours of each vertex, with the lengths of the edges to them, metres.
    neighbours: Vec<Vec<(u32, f32)>>,
}

impl Graph {
    fn new(rest: &TriMesh, faces: &[[u32; 3]]) -> Self {
        let edges = edges(faces);
        let mut neighbours = vec![Vec::new(); rest.vertices.len()];
        for &[a, b] in &edges {
            let length = rest.vertices[a as usize].distance(rest.vertices[b as usize]);
            neighbours[a as usize].push((b, length));
            neighbours[b as usize].push((a, length));
        }
        Self { edges, neighbours }
    }

    /// Lists the pairs of samples whose cells touch, sorted. A vertex is in the cell of the sample
    /// that is nearest along the edges.
    fn chords(&self, samples: &[u32]) -> Vec<[u32; 2]> {
        let cells = self.cells(samples);
        let cells_of = |edge: &[u32; 2]| edge.map(|v| cells[v as usize]);
        let mut chords: Vec<[u32; 2]> = (self.edges.iter().map(cells_of))
            // Positions may be so far apart that lengths overflow and no sample is near.
            .filter(|[a, b]| a != b && *a.max(b) != u32::MAX)
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        chords.sort_unstable();
        chords.dedup();
        with_second_neighbours(chords, samples.len())
    }

    /// Finds the place in `samples` of each vertex's nearest sample (Dijkstra 1959).
    fn cells(&self, samples: &[u32]) -> Vec<u32> {
        let mut distances = vec![f32::INFINITY; self.neighbours.len()];
        let mut cells = vec![u32::MAX; self.neighbours.len()];
        // Lengths are not negative, so that their bits have their order.
        let mut queue = BinaryHeap::new();
        for (place, &sample) in (0..).zip(samples) {
            distances[sample as usize] = 0.0;
            cells[sample as usize] = place;
            queue.push(Reverse((0u32, sample)));
        }
        while let Some(Reverse((bits, vertex))) = queue.pop() {
            let distance = f32::from_bits(bits);
            if distance > distances[vertex as usize] {
                continue;
            }
            for &(next, length) in &self.neighbours[vertex as usize] {
                let along = distance + length;
                if along < distances[next as usize] {
                    distances[next as usize] = along;
                    cells[next as usize] = cells[vertex as usize];
                    queue.push(Reverse((along.to_bits(), next)));
                }
            }
        }
        cells
    }
}

/// Adds the pairs that have a neighbour in common, and sorts. Chords between neighbours alone let a
/// level fold like an accordion.
fn with_second_neighbours(chords: Vec<[u32; 2]>, samples: usize) -> Vec<[u32; 2]> {
    let mut neighbours = vec![Vec::new(); samples];
    for &[a, b] in &chords {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    let around = |near: &Vec<u32>| -> Vec<[u32; 2]> {
        let others = |&a: &u32| near.iter().filter(move |b| a < **b).map(move |&b| [a, b]);
        near.iter().flat_map(others).collect()
    };
    let mut pairs = chords;
    pairs.extend(neighbours.iter().flat_map(around));
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Coarse levels of a garment's projection. An asset.
#[derive(Clone, Debug)]
pub struct Levels {
    samples: Vec<u32>,
    /// Freedom of the samples.
    freedom: Freedom,
    levels: Vec<Level>,
    sweeps: usize,
    /// Whether sweeps over stencils follow those over the chords.
    smoothing: LevelSmoothing,
}

/// Use of the stencils of the levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LevelSmoothing {
    /// Sweeps over the chords alone, for a projection without bending.
    Off,
    /// One sweep over the stencils after each one over the chords.
    AfterEachSweep,
}

/// One level. Its chords and stencils move the first samples, and its rows carry their moves on.
#[derive(Clone, Debug)]
pub struct Level {
    samples: usize,
    constraints: Constraints,
    rows: Vec<InterpolationRow>,
}

impl Level {
    /// Number of samples that the chords and stencils move: the first ones of all.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Chords colour by colour, in the order of a sweep. Their ends are places in the samples.
    pub fn chord_colours(&self) -> impl Iterator<Item = &[Edge]> {
        self.constraints.edges.iter()
    }

    /// Stencils that smooth the moves of the samples from the start of the level, colour by colour.
    /// Their vertices are places in the samples.
    pub fn stencil_colours(&self) -> impl Iterator<Item = &[Stencil]> {
        self.constraints.stencils.iter()
    }

    /// Interpolation from the samples of this level: of the samples that the next finer level adds,
    /// or of every vertex after the finest level.
    pub fn rows(&self) -> &[InterpolationRow] {
        &self.rows
    }
}

/// Buffers of the levels.
#[derive(Clone, Debug, Default)]
pub(super) struct LevelScratch {
    /// Positions of the samples.
    now: Vec<Vec3A>,
    /// Positions at the start of a level, and of the tick.
    before: Vec<Vec3A>,
    first: Vec<Vec3A>,
}

impl Levels {
    /// Makes the levels of a garment whose vertices have this freedom, given the limits of all
    /// chords. Those without a least length are left out: they are for garments that are too short,
    /// and greatest lengths are for the edges.
    pub(super) fn new(
        topology: LevelTopology,
        rest: &TriMesh,
        config: &ProjectionConfig,
        freedom: &Freedom,
        limits: &[StrainLimit],
    ) -> Self {
        let LevelTopology {
            samples,
            levels,
            rows,
        } = topology;
        let counts: Vec<usize> = levels.iter().map(|(count, _)| *count).collect();
        let sample_freedom = freedom.of_some(&samples);
        let places: Vec<Vec3> = samples.iter().map(|&v| rest.vertices[v as usize]).collect();
        let mut limits = limits.iter();
        let mut rows = Some(rows);
        let level = |(i, (count, ends)): (usize, (usize, Vec<[u32; 2]>))| {
            let stencils = level_stencils(&places[..count], &ends);
            let stencils = stencils.iter().map(|s| Stencil::new(s, &sample_freedom));
            let chords = ends.iter().zip(limits.by_ref());
            let chords = chords.filter(|(_, limit)| limit.shortest > 0.0);
            let chords = chords.map(|(&ends, &limit)| Edge { ends, limit });
            Level {
                samples: count,
                constraints: Constraints::new(chords.collect(), stencils.collect(), count),
                rows: match counts.get(i + 1) {
                    Some(&next) => rows_of(rest, &samples[..count], &samples[count..next]),
                    // There is one finest level.
                    None => rows.take().unwrap_or_default(),
                },
            }
        };
        let levels = levels.into_iter().enumerate().map(level).collect();
        Self {
            freedom: sample_freedom,
            samples,
            levels,
            sweeps: config.coarse_sweeps,
            smoothing: match config.hinge_sweeps() {
                0 => LevelSmoothing::Off,
                _ => LevelSmoothing::AfterEachSweep,
            },
        }
    }

    /// Vertices that are samples. Those of coarser levels come first.
    pub fn samples(&self) -> &[u32] {
        &self.samples
    }

    /// Freedom of the samples, in their order.
    pub fn freedom(&self) -> &Freedom {
        &self.freedom
    }

    /// Levels, coarsest first; none for a small garment.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Sweeps over the chords of each level in a tick.
    pub fn sweeps(&self) -> usize {
        self.sweeps
    }

    /// Use of the stencils.
    pub fn smoothing(&self) -> LevelSmoothing {
        self.smoothing
    }

    /// Brings the chords into their limits, level by level, smooths the moves of the samples, and moves
    /// all vertices along, as far as their freedom lets them.
    pub(super) fn solve(
        &self,
        rounds: usize,
        freedom: &Freedom,
        scratch: &mut LevelScratch,
        positions: &mut [Vec3A],
    ) {
        let LevelScratch { now, before, first } = scratch;
        now.clear();
        now.extend(self.samples.iter().map(|&v| positions[v as usize]));
        first.clone_from(now);
        let Some((finest, coarser)) = self.levels.split_last() else {
            return;
        };
        for level in coarser {
            before.clone_from(now);
            self.sweep(level, rounds, before, now);
            let (solved, added) = now.split_at_mut(level.samples);
            for ((position, row), sample) in added.iter_mut().zip(&level.rows).zip(level.samples..) {
                *position += moved(row, before, solved) * self.freedom.of(sample as u32);
            }
        }
        before.clone_from(now);
        self.sweep(finest, rounds, before, now);
        let (first, now) = (&*first, &*now);
        for_each_chunk(positions, PART, |start, positions| {
            let rows = &finest.rows[start..];
            for ((position, row), vertex) in positions.iter_mut().zip(rows).zip(start..) {
                *position += moved(row, first, now) * freedom.of(vertex as u32);
            }
        });
    }

    fn sweep(&self, level: &Level, rounds: usize, before: &[Vec3A], positions: &mut [Vec3A]) {
        let sweeps = rounds * self.sweeps;
        let sweeps = Sweeps {
            edges: sweeps,
            smoothed: match self.smoothing {
                LevelSmoothing::Off => 0,
                LevelSmoothing::AfterEachSweep => sweeps,
            },
        };
        (level.constraints).sweep(sweeps, &self.freedom, before, positions);
    }
}

/// Returns the interpolated move of the samples from `before` to `now`.
fn moved(row: &InterpolationRow, before: &[Vec3A], now: &[Vec3A]) -> Vec3A {
    let samples = row.samples.iter().zip(row.weights);
    samples
        .map(|(&s, weight)| (now[s as usize] - before[s as usize]) * weight)
        .sum()
}
