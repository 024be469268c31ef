//! Order of a garment along its smoothed shape.

use super::{
    OrderDistances, Pair, Pairs,
    search::{Compared, Rule, Search, SearchScratch},
};
use crate::{
    mesh::TriMesh,
    projection::{levels::Levels, smoothed::SmoothedShape},
};
use glam::Vec3A;

// The numbers below suit the demo's skirt and T-shirt (docs/lab/intersections.md).

/// Distance from which vertices do not push each other, gaps.
const NEAR_GAPS: f32 = 3.0;

/// Distance along the smoothed shape up to which pairs are kept for the pushes of a tick, gaps.
const KEPT_GAPS: f32 = 1.5;

/// Distance on the smoothed shape from which pairs count, gaps: between closer places there is hardly
/// a direction. Pairs have their whole weight from one and a half times this on.
pub const APART_GAPS: f32 = 2.0;

/// Vertices whose order along the smoothed shape is kept. An asset.
#[derive(Clone, Debug)]
pub struct SheetOrder {
    gap_m: f32,
    shape: SmoothedShape,
    places: Vec<OrderPlace>,
}

/// Where a vertex is at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderPlace {
    /// Position, metres.
    pub position: Vec3A,
    /// Place on the smoothed shape, metres.
    pub smoothed: Vec3A,
    /// Whether it is the first vertex at its position. Only these are pushed.
    pub is_first: bool,
}

/// Buffers of a [`SheetOrder`].
#[derive(Clone, Debug, Default)]
pub(in crate::projection) struct SheetScratch {
    /// Smoothed shape of the current positions.
    smoothed: Vec<Vec3A>,
    samples: [Vec<Vec3A>; 2],
    search: SearchScratch,
    pub(in crate::projection) pairs: Pairs,
}

impl SheetOrder {
    /// Prepares the order of a garment, given the least distance along the smoothed shape in metres.
    /// None for a garment without coarse levels, which have the smoothed shape.
    pub(in crate::projection) fn new(
        gap_m: f32,
        rest: &TriMesh,
        first_at_place: &[u32],
        levels: &Levels,
    ) -> Option<Self> {
        let shape = SmoothedShape::new(levels)?;
        let positions: Vec<Vec3A> = rest.vertices.iter().map(|p| Vec3A::from(*p)).collect();
        let mut smoothed = Vec::new();
        shape.smooth(levels, &positions, &mut Default::default(), &mut smoothed);
        let both = positions.iter().zip(&smoothed);
        let places = (0..).zip(both.zip(first_at_place));
        let places = places.map(|(vertex, ((&position, &smoothed), &first))| OrderPlace {
            position,
            smoothed,
            is_first: first == vertex,
        });
        Some(Self {
            places: places.collect(),
            gap_m,
            shape,
        })
    }

    /// Least distance along the smoothed shape, metres.
    pub fn gap_m(&self) -> f32 {
        self.gap_m
    }

    /// Distances of the pairs.
    pub fn distances(&self) -> OrderDistances {
        OrderDistances {
            near_m: NEAR_GAPS * self.gap_m,
            kept_m: KEPT_GAPS * self.gap_m,
        }
    }

    /// Smoothing of the shape.
    pub fn shape(&self) -> &SmoothedShape {
        &self.shape
    }

    /// Places of all vertices.
    pub fn places(&self) -> &[OrderPlace] {
        &self.places
    }

    /// Finds the pairs that may have to push each other, given the positions of all vertices.
    pub(in crate::projection) fn find(
        &self,
        levels: &Levels,
        positions: &[Vec3A],
        scratch: &mut SheetScratch,
    ) {
        let SheetScratch {
            smoothed,
            samples,
            search,
            pairs,
        } = scratch;
        self.shape.smooth(levels, positions, samples, smoothed);
        let firsts = (0..).zip(&self.places).filter(|(_, place)| place.is_first);
        let vertices = firsts.map(|(vertex, _)| vertex);
        let compared = |vertex: u32| Compared {
            position: positions[vertex as usize].into(),
            vector: smoothed[vertex as usize].into(),
            number: 0.0,
        };
        Search::new(self, vertices, positions, compared, search).find(&mut pairs.by_part);
    }
}

/// Vertices are compared by their places on the smoothed shape.
impl Rule for &SheetOrder {
    fn near_m(&self) -> f32 {
        self.distances().near_m
    }

    #[inline(always)]
    fn may_be_pair(&self, own: &Compared, other: &Compared) -> bool {
        let on_shape = other.vector - own.vector;
        let squared = on_shape.length_squared();
        let along = (other.position - own.position).dot(on_shape);
        let is_far = (along > 0.0) & (along * along > self.distances().kept_m.powi(2) * squared);
        (squared > (APART_GAPS * self.gap_m).powi(2)) & !is_far
    }

    /// Vertices that are not in order at rest lie in folds that are sewn in, or on a part that smoothing
    /// turns.
    fn pair(&self, ends: [u32; 2], own: &Compared, other: &Compared) -> Option<Pair> {
        let [a, b] = ends.map(|v| self.places[v as usize]);
        let at_rest = b.smoothed - a.smoothed;
        let rest = (b.position - a.position).dot(at_rest) / at_rest.length();
        let on_shape = other.vector - own.vector;
        let length = on_shape.length();
        let near = other.position.distance_squared(own.position) / self.near_m().powi(2);
        let apart = length / (APART_GAPS * self.gap_m);
        // False for NaN, too.
        (rest >= self.gap_m).then(|| Pair {
            ends,
            along: Vec3A::from(on_shape) / length,
            weight: (1.0 - near) * (2.0 * (apart - 1.0)).min(1.0),
        })
    }
}
