//! The search for pairs: block of faces, face, pair.

use super::{
    grid::PointGrid,
    pairs::{Memory, Pair},
    points::Points,
    rest_shape::RestShape,
    sieve::{MovingBox, Prism, Reach, Surroundings},
};
use crate::{Particles, body::corners_of};
use glam::Vec3;
use std::ops::Range;
use unic_core::surface::{Feature, Triangle};

/// Vertices that one face is held against at most: a garment crumpled into a ball stays affordable.
const MOST_VERTICES_A_FACE: usize = 48;

/// Faces that look at the same points first, at most, and how far they may extend along an axis, in
/// mean edge lengths.
const FACES_A_BLOCK: usize = 16;
const EDGES_A_BLOCK: f32 = 4.0;

/// Share of its distance at rest that a pair keeps, at most: what touches at rest does not push.
const REST_SHARE: f32 = 0.9;

/// Pairs that would keep less than this are left out, metres: what lies in one place at rest has no
/// side there, and rounding would choose one.
const LEAST_THICKNESS_M: f32 = 2e-5;

/// What all faces share.
pub(super) struct Search<'a> {
    pub(super) rest: &'a RestShape,
    pub(super) particles: &'a Particles,
    pub(super) reach: Reach,
    /// Speed relative to each other that nothing exceeds, m/s.
    pub(super) most_speed: f32,
    pub(super) thickness_m: f32,
    pub(super) grid: &'a PointGrid,
    pub(super) memory: &'a Memory,
}

/// What one thread finds, and its scratch.
#[derive(Clone, Debug, Default)]
pub(super) struct Chunk {
    pub(super) pairs: Vec<Pair>,
    /// Points around a block of faces.
    around: Points,
    entries: Vec<u32>,
}

/// Faces next to each other.
struct Block {
    faces: Range<usize>,
    bounds: MovingBox,
}

/// A face as it is now.
struct Face {
    index: u32,
    corners: [u32; 3],
    places: [Vec3; 3],
    velocities: [Vec3; 3],
    triangle: Triangle,
    /// Unit; zero when degenerate.
    normal: Vec3,
    /// Gradients of the weights of the second and the third corner, 1/m; zero when degenerate.
    gradients: [Vec3; 2],
}

/// A point seen from a face.
struct Hit {
    /// Over the face's plane, metres; negative behind it.
    height_m: f32,
    /// Squared distance of its projection from the face, m².
    beside_squared: f32,
    /// Of the closest point.
    barycentric: Vec3,
    /// The projection lies in the face.
    is_over: bool,
}

impl Search<'_> {
    /// All pairs of some faces.
    pub(super) fn faces(&self, mut faces: Range<usize>, chunk: &mut Chunk) {
        chunk.pairs.clear();
        while !faces.is_empty() {
            let block = self.block(faces.clone());
            self.gather(&block.bounds, chunk);
            faces.start = block.faces.end;
            block.faces.for_each(|face| self.face(face as u32, chunk));
        }
    }

    /// The first of these faces, as many as lie close together.
    fn block(&self, faces: Range<usize>) -> Block {
        let most_m = EDGES_A_BLOCK * self.rest.mean_edge_m;
        let mut bounds = MovingBox::EMPTY;
        let mut end = faces.start;
        while end < faces.end.min(faces.start + FACES_A_BLOCK) {
            let corners = self.rest.faces[end];
            let places = corners_of(&self.particles.positions, corners);
            if places.iter().all(|p| p.is_finite()) {
                let wider = bounds.with(places, corners_of(&self.particles.velocities, corners));
                let is_wide = (wider.high - wider.low).max_element() > most_m;
                if is_wide && end > faces.start {
                    break;
                }
                bounds = wider;
            }
            end += 1;
        }
        Block {
            faces: faces.start..end,
            bounds,
        }
    }

    /// Leaves in the chunk the points that may be near any face within the bounds.
    fn gather(&self, bounds: &MovingBox, chunk: &mut Chunk) {
        chunk.entries.clear();
        let region = Surroundings::new(bounds, &self.reach);
        let reach_m = self.reach.distance_m(self.most_speed);
        let points = self.grid.points();
        (self.grid).around(bounds.low - reach_m, bounds.high + reach_m, |range| {
            points.sieve(range, &region, &mut chunk.entries);
        });
        chunk.around.select(points, &chunk.entries);
    }

    fn face(&self, face: u32, chunk: &mut Chunk) {
        let Some(face) = Face::new(face, self.rest, self.particles) else {
            return;
        };
        let prism = Prism::new(face.places, face.velocities, face.normal, &self.reach);
        let Chunk {
            pairs,
            around,
            entries,
        } = chunk;
        entries.clear();
        around.sieve(0..around.len(), &prism, entries);
        let full = pairs.len() + MOST_VERTICES_A_FACE;
        for &entry in &*entries {
            let vertex = around.index(entry as usize);
            if pairs.len() < full && !self.rest.is_neighbour(vertex, face.corners) {
                pairs.extend(self.pair(vertex, &face));
            }
        }
    }

    #[inline]
    fn pair(&self, vertex: u32, face: &Face) -> Option<Pair> {
        let hit = face.closest(self.particles.positions[vertex as usize]);
        if !self.is_near(self.particles.velocities[vertex as usize], face, &hit) {
            return None;
        }
        let known = self.memory.of(vertex);
        let thickness_m = match known.iter().find(|pair| pair.face == face.index) {
            Some(same) => same.thickness_m,
            None => (REST_SHARE * self.rest.distance(vertex, face.corners)).min(self.thickness_m),
        };
        (thickness_m >= LEAST_THICKNESS_M).then(|| Pair {
            vertex,
            face: face.index,
            side: (self.known_side(known, face.index)).unwrap_or(1f32.copysign(hit.height_m)),
            thickness_m,
            is_over: hit.is_over,
        })
    }

    /// The two may touch within the interval: near enough above each other, and the vertex not
    /// farther beside the face than it may slide. Not for NaN.
    #[inline]
    fn is_near(&self, velocity: Vec3, face: &Face, hit: &Hit) -> bool {
        let [u, v, w] = face.velocities;
        let below = u * hit.barycentric.x + v * hit.barycentric.y + w * hit.barycentric.z;
        let travel_m = self.reach.travel_m(velocity.distance(below));
        let (above_m, beside_m) = (self.reach.above_m + travel_m, self.reach.beside_m + travel_m);
        hit.height_m.abs() <= above_m && hit.beside_squared <= beside_m * beside_m
    }

    /// The side that the vertex had of this face, or of one that touches it.
    ///
    /// Only sides of faces that the vertex projected into count, so that one that goes around a hem
    /// is not held on its old side.
    #[inline]
    fn known_side(&self, known: &[Pair], face: u32) -> Option<f32> {
        let known = known.iter().filter(|pair| pair.is_over);
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

impl Face {
    /// None for a face that is not finite.
    #[inline]
    fn new(index: u32, rest: &RestShape, particles: &Particles) -> Option<Self> {
        let corners = rest.faces[index as usize];
        let places = corners_of(&particles.positions, corners);
        let [a, b, c] = places;
        if !(a.is_finite() && b.is_finite() && c.is_finite()) {
            return None;
        }
        let triangle = Triangle::new(places);
        let normal = triangle.normal();
        let across = [(c - a).cross(normal), normal.cross(b - a)];
        Some(Self {
            index,
            corners,
            places,
            velocities: corners_of(&particles.velocities, corners),
            triangle,
            normal,
            gradients: if normal == Vec3::ZERO {
                [Vec3::ZERO; 2]
            } else {
                [across[0] / across[0].dot(b - a), across[1] / across[1].dot(c - a)]
            },
        })
    }

    /// Most points that are near a face are over it, where its plane tells all.
    #[inline]
    fn closest(&self, p: Vec3) -> Hit {
        let arm = p - self.places[0];
        let [v, w] = [arm.dot(self.gradients[0]), arm.dot(self.gradients[1])];
        let u = 1.0 - v - w;
        if self.normal != Vec3::ZERO && u >= 0.0 && v >= 0.0 && w >= 0.0 {
            return Hit {
                height_m: arm.dot(self.normal),
                beside_squared: 0.0,
                barycentric: Vec3::new(u, v, w),
                is_over: true,
            };
        }
        let hit = self.triangle.closest(p);
        let height_m = -hit.offset.dot(self.normal);
        Hit {
            height_m,
            beside_squared: hit.squared_distance - height_m * height_m,
            barycentric: hit.barycentric,
            is_over: hit.feature == Feature::Face,
        }
    }
}
