//! Layers of a garment at rest.

use super::{LEAST_RISE_EDGES, LayerPlace, NEAR_EDGES, means::CellMeans, normal, search_layered};
use crate::{
    mesh::TriMesh,
    projection::order::{
        Pair,
        search::{Compared, Rule, SearchScratch},
    },
};
use glam::Vec3A;
use std::sync::atomic::{AtomicBool, Ordering};

/// Size of the cells whose vertices are averaged for the middle of the cloth, mean edge lengths.
const MEAN_CELL_EDGES: f32 = 3.0;

/// Least length of the mean of the unit normals around a vertex. That of three layers of a pleat is
/// a third. The normals of a hem that is folded once cancel, and say nothing of its outside.
const LEAST_MEAN_NORMAL: f32 = 0.15;

/// Least cosine between the normal of a vertex and the mean normal around it. Others lie on the edge
/// of a fold, which has no normal.
const LEAST_FLATNESS: f32 = 0.5;

/// Distance between vertices of layers that lie on each other at rest, mean edge lengths. A vertex
/// above the middle of a face of the other layer is farther from its corners.
const STACKED_EDGES: f32 = 2.0 * NEAR_EDGES;

/// Least cosine between the outward normals of two vertices that lie on each other at rest.
const LEAST_STACKED_AGREEMENT: f32 = 0.8;

/// Least cosine between these normals and the way from one vertex to the other: the sides of a crease
/// do not lie on each other.
const LEAST_STACKED_RISE: f32 = 0.7;

/// The two other corners of each face around each vertex.
type Corners = Vec<Vec<[u32; 2]>>;

/// Returns the places of all vertices, those without another layer with a side of 0, and the faces
/// around them.
pub(super) fn layered_places(
    edge_m: f32,
    rest: &TriMesh,
    faces: &[[u32; 3]],
    first_at_place: &[u32],
) -> (Vec<LayerPlace>, Corners) {
    let positions: Vec<Vec3A> = rest.vertices.iter().map(|p| Vec3A::from(*p)).collect();
    let mut corners = vec![Vec::new(); positions.len()];
    for &[a, b, c] in faces {
        for [own, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
            corners[own as usize].push([next, last]);
        }
    }
    let mut places = places_in_cloth(edge_m, &positions, &corners, first_at_place);
    keep_layered(edge_m, &positions, &corners, &mut places);
    (places, corners)
}

/// Returns the place of each vertex relative to the cloth around it, whether or not that has layers.
fn places_in_cloth(
    edge_m: f32,
    positions: &[Vec3A],
    corners: &Corners,
    first_at_place: &[u32],
) -> Vec<LayerPlace> {
    let normals: Vec<Vec3A> = (0..positions.len())
        .map(|vertex| normal(vertex, &corners[vertex], positions))
        .collect();
    let is_first = |vertex: usize| first_at_place[vertex] as usize == vertex;
    let mut means = CellMeans::new(MEAN_CELL_EDGES * edge_m);
    for vertex in (0..positions.len()).filter(|&vertex| is_first(vertex)) {
        means.add(positions[vertex], normals[vertex]);
    }
    let place = |vertex: usize| {
        let nowhere = LayerPlace {
            position: positions[vertex],
            outward: Vec3A::ZERO,
            height_m: 0.0,
            side: 0.0,
        };
        if !is_first(vertex) {
            return nowhere;
        }
        let around = means.around(positions[vertex]);
        let outward = around.normal.normalize_or_zero();
        let cosine = normals[vertex].dot(outward);
        // False for NaN.
        let has_side = around.normal.length() > LEAST_MEAN_NORMAL && cosine.abs() > LEAST_FLATNESS;
        match has_side {
            false => nowhere,
            true => LayerPlace {
                outward: normals[vertex] * cosine.signum(),
                height_m: (positions[vertex] - around.middle).dot(outward),
                side: cosine.signum(),
                ..nowhere
            },
        }
    };
    (0..positions.len()).map(place).collect()
}

/// Leaves out the vertices that have no other layer on them.
fn keep_layered(edge_m: f32, positions: &[Vec3A], corners: &Corners, places: &mut [LayerPlace]) {
    let outward: Vec<Vec3A> = places.iter().map(|place| place.outward).collect();
    let stacked = Stacked {
        edge_m,
        is_marked: positions.iter().map(|_| AtomicBool::new(false)).collect(),
    };
    let mut scratch = SearchScratch::default();
    search_layered(&stacked, places, positions, &outward, &mut scratch).find(&mut Vec::new());
    let is_marked = |vertex: usize| stacked.is_marked[vertex].load(Ordering::Relaxed);
    for (vertex, place) in places.iter_mut().enumerate() {
        // Beside a layer, too: a vertex above the middle of a face is not above its corners.
        let around = corners[vertex].iter().flatten();
        if !is_marked(vertex) && !around.clone().any(|&v| is_marked(v as usize)) {
            (place.outward, place.side) = (Vec3A::ZERO, 0.0);
        }
    }
}

/// Marks vertices that lie on another layer. It makes no pairs: there are too many of them at rest to
/// be kept.
struct Stacked {
    edge_m: f32,
    is_marked: Vec<AtomicBool>,
}

impl Rule for &Stacked {
    fn near_m(&self) -> f32 {
        STACKED_EDGES * self.edge_m
    }

    #[inline(always)]
    fn may_be_pair(&self, own: &Compared, other: &Compared) -> bool {
        let rise = other.number - own.number;
        (rise.abs() >= LEAST_RISE_EDGES * self.edge_m)
            & (own.vector.dot(other.vector) > LEAST_STACKED_AGREEMENT)
    }

    fn pair(&self, ends: [u32; 2], own: &Compared, other: &Compared) -> Option<Pair> {
        let between = (other.position - own.position).normalize_or_zero();
        let upwards = (own.vector + other.vector).normalize_or_zero();
        let rise = other.number - own.number;
        if between.dot(upwards) * rise.signum() > LEAST_STACKED_RISE {
            for end in ends {
                self.is_marked[end as usize].store(true, Ordering::Relaxed);
            }
        }
        None
    }
}
