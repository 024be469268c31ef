//! Order of layers of a garment that lie on each other at rest, such as those of a pleat.

mod means;
mod rest;

use super::{
    OrderDistances, Pair, Pairs,
    search::{Compared, Rule, Search, SearchScratch},
};
use crate::{mesh::TriMesh, parallel::for_each_chunk, projection::sweep::PART};
use glam::Vec3A;

// The numbers below suit a pleated dress (docs/lab/intersections.md). Lengths are in mean edge
// lengths at rest.

/// Distance from which vertices do not push each other.
const NEAR_EDGES: f32 = 1.05;

/// Distance along the normals up to which pairs are kept for the pushes of a tick, gaps.
const KEPT_GAPS: f32 = 2.0;

/// Least difference of heights at rest between vertices of two layers.
const LEAST_RISE_EDGES: f32 = 0.225;

/// Distance at rest from which two vertices do not push each other. Layers slide along each other.
const REACH_EDGES: f32 = 4.05;

/// Least cosine between the outward normals of two vertices that push each other. Weights grow from
/// 0 there to 1 at the middle between it and 1.
pub const LEAST_COSINE: f32 = 0.5;

/// Vertices whose layers keep their order. An asset.
#[derive(Clone, Debug)]
pub struct LayerOrder {
    gap_m: f32,
    /// Mean edge length at rest, metres.
    edge_m: f32,
    places: Vec<LayerPlace>,
    /// End of each vertex's corners in `corners`.
    ends: Vec<u32>,
    /// The two other corners of each face around a vertex that is pushed.
    corners: Vec<[u32; 2]>,
}

/// Where a vertex is at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerPlace {
    /// Position, metres.
    pub position: Vec3A,
    /// Unit normal, turned outwards as most normals around it are; zero for a vertex that is not
    /// pushed.
    pub outward: Vec3A,
    /// Height above the middle of the cloth around it, metres.
    pub height_m: f32,
    /// Sign with which the normal of its faces points outwards. 0 for a vertex that is not pushed:
    /// with no other layer near it, on the edge of a fold, or not the first at its position.
    pub side: f32,
}

/// Buffers of a [`LayerOrder`].
#[derive(Clone, Debug, Default)]
pub(in crate::projection) struct LayerScratch {
    /// Outward unit normals of the current positions.
    outward: Vec<Vec3A>,
    search: SearchScratch,
    pub(in crate::projection) pairs: Pairs,
}

impl LayerOrder {
    /// Prepares the order of a garment, given the least distance `gap` between layers in mean edge
    /// lengths, that length in metres, and its faces with welded seams. None for a garment without
    /// layers.
    pub(in crate::projection) fn new(
        gap: f32,
        edge_m: f32,
        rest: &TriMesh,
        faces: &[[u32; 3]],
        first_at_place: &[u32],
    ) -> Option<Self> {
        let (places, mut around) = rest::layered_places(edge_m, rest, faces, first_at_place);
        // The normals of all others are not needed.
        for (around, place) in around.iter_mut().zip(&places) {
            if place.side == 0.0 {
                *around = Vec::new();
            }
        }
        let end = |end: &mut u32, around: &Vec<[u32; 2]>| {
            *end += around.len() as u32;
            Some(*end)
        };
        let has_layers = places.iter().any(|place| place.side != 0.0);
        has_layers.then(|| Self {
            gap_m: gap * edge_m,
            edge_m,
            places,
            ends: around.iter().scan(0, end).collect(),
            corners: around.concat(),
        })
    }

    /// Least distance between layers, metres.
    pub fn gap_m(&self) -> f32 {
        self.gap_m
    }

    /// Distances of the pairs.
    pub fn distances(&self) -> OrderDistances {
        OrderDistances {
            near_m: NEAR_EDGES * self.edge_m,
            kept_m: KEPT_GAPS * self.gap_m,
        }
    }

    /// Least difference of heights at rest between vertices of two layers, metres.
    pub fn least_rise_m(&self) -> f32 {
        LEAST_RISE_EDGES * self.edge_m
    }

    /// Distance at rest from which two vertices do not push each other, metres.
    pub fn reach_m(&self) -> f32 {
        REACH_EDGES * self.edge_m
    }

    /// Places of all vertices.
    pub fn places(&self) -> &[LayerPlace] {
        &self.places
    }

    /// End of the faces around each vertex in [`LayerOrder::corners`].
    pub fn ends(&self) -> &[u32] {
        &self.ends
    }

    /// Faces around all vertices that are pushed, vertex by vertex: their two other corners.
    pub fn corners(&self) -> &[[u32; 2]] {
        &self.corners
    }

    /// Finds the pairs that may have to push each other, given the positions of all vertices.
    pub(in crate::projection) fn find(&self, positions: &[Vec3A], scratch: &mut LayerScratch) {
        let LayerScratch {
            outward,
            search,
            pairs,
        } = scratch;
        outward.resize(positions.len(), Vec3A::ZERO);
        for_each_chunk(outward, PART, |start, outward| {
            for (vertex, outward) in (start..).zip(outward) {
                let first = vertex.checked_sub(1).map_or(0, |before| self.ends[before]);
                let around = &self.corners[first as usize..self.ends[vertex] as usize];
                *outward = normal(vertex, around, positions) * self.places[vertex].side;
            }
        });
        search_layered(self, &self.places, positions, outward, search).find(&mut pairs.by_part);
    }
}

/// Sorts the vertices that are pushed for a search, given positions and outward normals of all.
fn search_layered<'a, R: Rule>(
    rule: R,
    places: &[LayerPlace],
    positions: &[Vec3A],
    outward: &[Vec3A],
    scratch: &'a mut SearchScratch,
) -> Search<'a, R> {
    let pushed = (0..).zip(places).filter(|(_, place)| place.side != 0.0);
    let compared = |vertex: u32| Compared {
        position: positions[vertex as usize].into(),
        vector: outward[vertex as usize].into(),
        number: places[vertex as usize].height_m,
    };
    Search::new(
        rule,
        pushed.map(|(vertex, _)| vertex),
        positions,
        compared,
        scratch,
    )
}

/// Unit normal of a vertex, given the two other corners of each face around it; zero if it has none.
fn normal(vertex: usize, around: &[[u32; 2]], positions: &[Vec3A]) -> Vec3A {
    let own = positions[vertex];
    let normals = around.iter().map(|corners| {
        let [next, last] = corners.map(|v| positions[v as usize] - own);
        next.cross(last)
    });
    normals.sum::<Vec3A>().normalize_or_zero()
}

/// Vertices are compared by their outward normals, and by their heights at rest.
impl Rule for &LayerOrder {
    fn near_m(&self) -> f32 {
        self.distances().near_m
    }

    #[inline(always)]
    fn may_be_pair(&self, own: &Compared, other: &Compared) -> bool {
        let upwards = own.vector + other.vector;
        let rise = other.number - own.number;
        // Not `signum`, which has a branch for NaN. NaN is refused below.
        let along = (other.position - own.position).dot(upwards) * 1.0f32.copysign(rise);
        let is_far =
            (along > 0.0) & (along * along > self.distances().kept_m.powi(2) * upwards.length_squared());
        // False for NaN.
        (rise.abs() >= self.least_rise_m()) & (own.vector.dot(other.vector) > LEAST_COSINE) & !is_far
    }

    /// Vertices that are not in order at rest lie where a fold turns the cloth.
    fn pair(&self, ends: [u32; 2], own: &Compared, other: &Compared) -> Option<Pair> {
        let [a, b] = ends.map(|v| self.places[v as usize]);
        let (side, at_rest) = ((b.height_m - a.height_m).signum(), b.position - a.position);
        let rest = at_rest.dot((a.outward + b.outward).normalize_or_zero()) * side;
        let upwards = Vec3A::from(own.vector + other.vector).normalize_or_zero();
        let near = other.position.distance_squared(own.position) / self.near_m().powi(2);
        let agreement = (own.vector.dot(other.vector) - LEAST_COSINE) / (1.0 - LEAST_COSINE);
        let is_in_order = rest >= self.gap_m && at_rest.length() < self.reach_m();
        is_in_order.then(|| Pair {
            ends,
            along: upwards * side,
            weight: (1.0 - near) * (2.0 * agreement).min(1.0),
        })
    }
}
