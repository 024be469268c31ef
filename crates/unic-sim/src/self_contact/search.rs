//! The search for contact pairs, in three stages of growing precision: the grid cells around a
//! block of faces, conservative culling for the block and for each face, and exact tests.

use super::{
    cull::{BlockVolume, FacePrism, MovingBox, Reach},
    grid::PointGrid,
    moving_points::MovingPoints,
    pair::{ContactPair, PreviousPairs},
    rest_shape::RestShape,
};
use crate::{Particles, body::corners_of};
use glam::Vec3;
use std::ops::Range;
use unic_core::surface::{Feature, Triangle};

/// Largest number of pairs per face. It bounds the cost of a garment that is crumpled into a ball.
const MAX_PAIRS_PER_FACE: usize = 48;

/// Largest number of consecutive faces that share one query of the grid. Faces are sorted along a
/// space-filling curve, so that consecutive ones are usually close together.
const FACES_PER_BLOCK: usize = 16;

/// Largest extent of a block along an axis, in mean edge lengths.
const BLOCK_EDGES: f32 = 4.0;

/// Largest share of its distance at rest that a pair keeps. Layers that touch at rest then do not
/// push each other.
const REST_SHARE: f32 = 0.9;

/// Smallest distance that a pair keeps, metres; others are left out. A vertex that lies in a face
/// at rest has no side there, and rounding would choose one.
const LEAST_THICKNESS_M: f32 = 2e-5;

/// Inputs of the search that all faces share.
pub(super) struct PairSearch<'a> {
    pub(super) rest: &'a RestShape,
    pub(super) particles: &'a Particles,
    pub(super) reach: Reach,
    /// Upper bound of the relative speed of two particles, m/s.
    pub(super) max_speed: f32,
    /// Distance between layers, metres.
    pub(super) thickness_m: f32,
    pub(super) grid: &'a PointGrid,
    pub(super) previous: &'a PreviousPairs,
}

/// Pairs found by one task, with its scratch.
#[derive(Clone, Debug, Default)]
pub(super) struct SearchChunk {
    pub(super) pairs: Vec<ContactPair>,
    /// Points around a block of faces. Scratch.
    around: MovingPoints,
    /// Entries that are left after culling. Scratch.
    entries: Vec<u32>,
}

/// Consecutive faces that are close together, with their bounds.
struct FaceBlock {
    faces: Range<usize>,
    bounds: MovingBox,
}

/// A face at the start of the interval.
struct PosedFace {
    index: u32,
    corners: [u32; 3],
    /// Positions of the corners, metres.
    positions: [Vec3; 3],
    /// Velocities of the corners, m/s.
    velocities: [Vec3; 3],
    triangle: Triangle,
    /// Unit normal; zero when degenerate.
    normal: Vec3,
    /// Gradients of the barycentric weights of the second and third corner, 1/m; zero when
    /// degenerate.
    gradients: [Vec3; 2],
}

/// Position of a point relative to a face.
struct FaceHit {
    /// Height over the face's plane, metres; negative behind it.
    height_m: f32,
    /// Squared distance of the point's projection from the face within its plane, m².
    beside_squared: f32,
    /// Barycentric weights of the closest point.
    barycentric: Vec3,
    /// True when the projection lies in the face.
    is_over: bool,
}

impl PairSearch<'_> {
    /// Collects the pairs of a range of faces.
    pub(super) fn faces(&self, mut faces: Range<usize>, chunk: &mut SearchChunk) {
        chunk.pairs.clear();
        while !faces.is_empty() {
            let block = self.block(faces.clone());
            self.gather(&block.bounds, chunk);
            faces.start = block.faces.end;
            block.faces.for_each(|face| self.face(face as u32, chunk));
        }
    }

    /// Makes a block of the first of these faces, as many as lie close together, at least one.
    fn block(&self, faces: Range<usize>) -> FaceBlock {
        let max_extent_m = BLOCK_EDGES * self.rest.mean_edge_m;
        let mut bounds = MovingBox::EMPTY;
        let mut end = faces.start;
        while end < faces.end.min(faces.start + FACES_PER_BLOCK) {
            let corners = self.rest.faces[end];
            let positions = corners_of(&self.particles.positions, corners);
            // A face that is not finite makes no pairs. It must not make the bounds infinite.
            if positions.iter().all(|p| p.is_finite()) {
                let wider = bounds.with(positions, corners_of(&self.particles.velocities, corners));
                let is_wide = (wider.high - wider.low).max_element() > max_extent_m;
                if is_wide && end > faces.start {
                    break;
                }
                bounds = wider;
            }
            end += 1;
        }
        FaceBlock {
            faces: faces.start..end,
            bounds,
        }
    }

    /// Stores the points that may touch any face within the bounds in the chunk.
    fn gather(&self, bounds: &MovingBox, chunk: &mut SearchChunk) {
        chunk.entries.clear();
        let volume = BlockVolume::new(bounds, &self.reach);
        let reach_m = self.reach.distance_m(self.max_speed);
        let points = self.grid.points();
        (self.grid).ranges_around(bounds.low - reach_m, bounds.high + reach_m, |range| {
            points.cull(range, &volume, &mut chunk.entries);
        });
        chunk.around.select(points, &chunk.entries);
    }

    /// Collects the pairs of one face, from the points around its block.
    fn face(&self, face: u32, chunk: &mut SearchChunk) {
        let Some(face) = PosedFace::new(face, self.rest, self.particles) else {
            return;
        };
        let prism = FacePrism::new(face.positions, face.velocities, face.normal, &self.reach);
        let SearchChunk {
            pairs,
            around,
            entries,
        } = chunk;
        entries.clear();
        around.cull(0..around.len(), &prism, entries);
        let full = pairs.len() + MAX_PAIRS_PER_FACE;
        for &entry in &*entries {
            let vertex = around.index(entry as usize);
            if pairs.len() < full && !self.rest.is_neighbour(vertex, face.corners) {
                pairs.extend(self.pair(vertex, &face));
            }
        }
    }

    /// Makes the pair of a vertex and a face if they may touch.
    #[inline]
    fn pair(&self, vertex: u32, face: &PosedFace) -> Option<ContactPair> {
        let hit = face.closest(self.particles.positions[vertex as usize]);
        if !self.is_near(self.particles.velocities[vertex as usize], face, &hit) {
            return None;
        }
        let known = self.previous.of(vertex);
        // The distance at rest is costly, and most pairs exist for many intervals.
        let thickness_m = match known.iter().find(|pair| pair.face == face.index) {
            Some(same) => same.thickness_m,
            None => (REST_SHARE * self.rest.distance(vertex, face.corners)).min(self.thickness_m),
        };
        // A pair that is new to both takes the side that the vertex is on now.
        (thickness_m >= LEAST_THICKNESS_M).then(|| ContactPair {
            vertex,
            face: face.index,
            side: (self.known_side(known, face.index)).unwrap_or(1f32.copysign(hit.height_m)),
            thickness_m,
            is_over: hit.is_over,
        })
    }

    /// Returns whether a vertex and a face may touch within the interval, from their distances in
    /// height and beside the face. False for NaN.
    #[inline]
    fn is_near(&self, velocity: Vec3, face: &PosedFace, hit: &FaceHit) -> bool {
        let [u, v, w] = face.velocities;
        let below = u * hit.barycentric.x + v * hit.barycentric.y + w * hit.barycentric.z;
        let travel_m = self.reach.travel_m(velocity.distance(below));
        let (above_m, beside_m) = (self.reach.above_m + travel_m, self.reach.beside_m + travel_m);
        hit.height_m.abs() <= above_m && hit.beside_squared <= beside_m * beside_m
    }

    /// Returns the side that the vertex had of this face, or of one that shares a corner with it.
    ///
    /// Only faces that the vertex projected into count. A vertex that goes around a hem is
    /// therefore not kept on its old side.
    #[inline]
    fn known_side(&self, known: &[ContactPair], face: u32) -> Option<f32> {
        let known = known.iter().filter(|pair| pair.is_over);
        let corners = self.rest.faces[face as usize];
        let touches = |pair: &&ContactPair| {
            self.rest.faces[pair.face as usize]
                .iter()
                .any(|v| corners.contains(v))
        };
        // The same face is more reliable than one next to it, which may be around a fold.
        let same = known.clone().find(|pair| pair.face == face);
        same.or_else(|| known.clone().find(touches)).map(|pair| pair.side)
    }
}

impl PosedFace {
    /// Loads a face; `None` for a face that is not finite.
    #[inline]
    fn new(index: u32, rest: &RestShape, particles: &Particles) -> Option<Self> {
        let corners = rest.faces[index as usize];
        let positions = corners_of(&particles.positions, corners);
        let [a, b, c] = positions;
        // Written out, because `all` over an array of three is not always inlined.
        if !(a.is_finite() && b.is_finite() && c.is_finite()) {
            return None;
        }
        let triangle = Triangle::new(positions);
        let normal = triangle.normal();
        let across = [(c - a).cross(normal), normal.cross(b - a)];
        Some(Self {
            index,
            corners,
            positions,
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

    /// Returns the position of a point relative to the face.
    #[inline]
    fn closest(&self, p: Vec3) -> FaceHit {
        // A quick path for the most frequent case: a point that projects into the face.
        let arm = p - self.positions[0];
        let [v, w] = [arm.dot(self.gradients[0]), arm.dot(self.gradients[1])];
        let u = 1.0 - v - w;
        if self.normal != Vec3::ZERO && u >= 0.0 && v >= 0.0 && w >= 0.0 {
            return FaceHit {
                height_m: arm.dot(self.normal),
                beside_squared: 0.0,
                barycentric: Vec3::new(u, v, w),
                is_over: true,
            };
        }
        let hit = self.triangle.closest(p);
        let height_m = -hit.offset.dot(self.normal);
        // Rounding may leave a difference just below zero, which passes all comparisons.
        FaceHit {
            height_m,
            beside_squared: hit.squared_distance - height_m * height_m,
            barycentric: hit.barycentric,
            is_over: hit.feature == Feature::Face,
        }
    }
}
