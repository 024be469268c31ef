//! Which vertices are near which faces of the same garment, and on which side.

use super::grid::PointGrid;
use crate::{
    Particles,
    body::{blend, corners_of},
};
use glam::Vec3;
use rayon::prelude::*;
use unic_core::{
    mesh::TriMesh,
    surface::{Feature, Triangle, TrianglePoint},
    topology::edges,
};

/// Faces that one thread takes at a time.
const FACES_A_CHUNK: usize = 512;

/// Vertices that one face is held against at most: a garment crumpled into a ball stays affordable.
const MOST_VERTICES_A_FACE: usize = 48;

/// Room beyond thickness and travel within which a pair is watched, metres: what constraints add to
/// straight motion within an interval.
const MARGIN_M: f32 = 0.002;

/// Travel relative to each other that is looked ahead, metres: 10 mm in 8 ms are 1.2 m/s.
const MOST_TRAVEL_M: f32 = 0.01;

/// Share of its distance at rest that a pair keeps, at most: what touches at rest does not push.
const REST_SHARE: f32 = 0.9;

/// How far beside a face a vertex is watched beyond its travel, metres.
const SLIDE_M: f32 = 0.001;

/// Pairs that would keep less than this are left out, metres: what lies in one place at rest has no
/// side there, and rounding would choose one.
const LEAST_THICKNESS_M: f32 = 2e-5;

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
    is_over: bool,
}

/// What never changes: the garment at rest.
#[derive(Clone, Debug)]
pub(super) struct RestShape {
    vertices: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
    /// Neighbours of vertex i are `ring[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    ring: Vec<u32>,
    mean_edge_m: f32,
}

/// The pairs of an interval, by face.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs {
    pub(super) all: Vec<Pair>,
    memory: Memory,
    grid: PointGrid,
    chunks: Vec<Vec<Pair>>,
}

/// The last interval's pairs by vertex.
#[derive(Clone, Debug, Default)]
struct Memory {
    /// Pairs of vertex i are `pairs[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    pairs: Vec<Pair>,
}

impl RestShape {
    pub(super) fn new(rest: &TriMesh) -> Self {
        let edges = edges(&rest.faces);
        let mut pairs: Vec<[u32; 2]> = edges.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        pairs.sort_unstable();
        let row = |v: u32| pairs.partition_point(|&[at, _]| at < v) as u32;
        let length = |&[a, b]: &[u32; 2]| rest.vertices[a as usize].distance(rest.vertices[b as usize]);
        Self {
            starts: (0..=rest.vertices.len() as u32).map(row).collect(),
            ring: pairs.into_iter().map(|[_, other]| other).collect(),
            mean_edge_m: edges.iter().map(length).sum::<f32>() / edges.len().max(1) as f32,
            vertices: rest.vertices.clone(),
            faces: rest.faces.clone(),
        }
    }

    pub(super) fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// A vertex of the face, or joined to one by an edge.
    fn is_neighbour(&self, vertex: u32, face: [u32; 3]) -> bool {
        let row = self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize;
        face.contains(&vertex) || self.ring[row].iter().any(|other| face.contains(other))
    }

    /// Distance of a vertex and a face at rest, metres.
    fn distance(&self, vertex: u32, face: [u32; 3]) -> f32 {
        let corners = corners_of(&self.vertices, face);
        let hit = Triangle::new(corners).closest(self.vertices[vertex as usize]);
        hit.squared_distance.sqrt()
    }
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
        let travel_m = (relative_speed(&particles.velocities) * seconds).min(MOST_TRAVEL_M);
        let reach_m = thickness_m + MARGIN_M + travel_m;
        self.grid
            .build(&particles.positions, 1.5 * reach_m.max(rest.mean_edge_m));
        let search = Search {
            rest,
            particles,
            seconds,
            thickness_m,
            reach_m,
            grid: &self.grid,
            memory: &self.memory,
        };
        let count = rest.faces.len().div_ceil(FACES_A_CHUNK);
        self.chunks.resize_with(count, Vec::new);
        self.chunks.par_iter_mut().enumerate().for_each(|(chunk, pairs)| {
            pairs.clear();
            let first = chunk * FACES_A_CHUNK;
            let last = rest.faces.len().min(first + FACES_A_CHUNK);
            (first..last).for_each(|face| search.face(face as u32, pairs));
        });
        self.all.extend(self.chunks.iter().flatten());
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

    fn of(&self, vertex: u32) -> &[Pair] {
        let row = self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize;
        &self.pairs[row]
    }
}

/// Largest speed relative to the mean velocity, m/s.
fn relative_speed(velocities: &[Vec3]) -> f32 {
    let mean = velocities.iter().sum::<Vec3>() / velocities.len().max(1) as f32;
    let squared = velocities.iter().map(|v| v.distance_squared(mean));
    squared.fold(0.0, f32::max).sqrt()
}

struct Search<'a> {
    rest: &'a RestShape,
    particles: &'a Particles,
    seconds: f32,
    thickness_m: f32,
    reach_m: f32,
    grid: &'a PointGrid,
    memory: &'a Memory,
}

impl Search<'_> {
    fn face(&self, face: u32, pairs: &mut Vec<Pair>) {
        let corners = self.rest.faces[face as usize];
        let [a, b, c] = corners_of(&self.particles.positions, corners);
        if !(a.is_finite() && b.is_finite() && c.is_finite()) {
            return;
        }
        let triangle = Triangle::new([a, b, c]);
        let normal = triangle.normal();
        let (low, high) = (a.min(b).min(c) - self.reach_m, a.max(b).max(c) + self.reach_m);
        let full = pairs.len() + MOST_VERTICES_A_FACE;
        self.grid.in_box(low, high, |vertex, position| {
            let is_level = (position - a).dot(normal).abs() <= self.reach_m;
            if is_level && pairs.len() < full && !self.rest.is_neighbour(vertex, corners) {
                pairs.extend(self.pair(vertex, face, triangle.closest(position), normal));
            }
        });
    }

    fn pair(&self, vertex: u32, face: u32, hit: TrianglePoint, normal: Vec3) -> Option<Pair> {
        let corners = self.rest.faces[face as usize];
        let height = -hit.offset.dot(normal);
        // NaN is not near.
        let is_near = self.is_near(vertex, corners, &hit, height);
        let at_rest_m = || self.rest.distance(vertex, corners);
        let thickness_m = is_near.then(|| (REST_SHARE * at_rest_m()).min(self.thickness_m))?;
        (thickness_m >= LEAST_THICKNESS_M).then(|| Pair {
            vertex,
            face,
            side: self.known_side(vertex, face).unwrap_or(1f32.copysign(height)),
            thickness_m,
            is_over: hit.feature == Feature::Face,
        })
    }

    /// The two may touch within the interval: near enough above each other, and the vertex not
    /// farther beside the face than it may slide.
    fn is_near(&self, vertex: u32, corners: [u32; 3], hit: &TrianglePoint, height: f32) -> bool {
        let beside_squared = hit.squared_distance - height * height;
        let velocities = &self.particles.velocities;
        let over_face = velocities[vertex as usize] - blend(velocities, corners, hit.barycentric);
        let travel_m = (over_face.length() * self.seconds).min(MOST_TRAVEL_M);
        let (above_m, beside_m) = (self.thickness_m + MARGIN_M + travel_m, SLIDE_M + travel_m);
        height.abs() <= above_m && beside_squared <= beside_m * beside_m
    }

    /// The side that the vertex had of this face, or of one that touches it.
    ///
    /// Only sides of faces that the vertex projected into count, so that one that goes around a hem
    /// is not held on its old side.
    fn known_side(&self, vertex: u32, face: u32) -> Option<f32> {
        let known = self.memory.of(vertex).iter().filter(|pair| pair.is_over);
        let corners = self.rest.faces[face as usize];
        let touches = |pair: &&Pair| {
            self.rest.faces[pair.face as usize]
                .iter()
                .any(|v| corners.contains(v))
        };
        let same = known.clone().find(|pair| pair.face == face);
        same.or_else(|| known.clone().find(touches)).map(|pair| pair.side)
    }
}
