//! Order of the cloth along its own smoothed shape.
//!
//! Sweeps lengthen the edges of a prediction that is too short. Its folds then grow narrow necks, where
//! their flanks pass through each other. Along the smoothed shape such flanks lie in reversed order.
//! Pushes bring vertices that are close to each other back into the order that they have at rest.
//!
//! Other implementations of a step read the constants here and the [`OrderPlace`]s of a [`SheetOrder`].

mod search;

use super::{freedom::Freedom, levels::Levels, smoothed::SmoothedShape};
use crate::mesh::TriMesh;
use glam::{Vec3A, Vec4};
use search::{Search, SearchScratch};

/// Number of pushes in the sweeps of a tick. They come after the sweeps that hinges follow, and share
/// the other sweeps over the edges between them.
pub const ORDER_PASSES: usize = 3;

// The numbers below suit the demo's skirt and T-shirt (docs/lab/intersections.md). Lengths are in gaps:
// the least distance along the smoothed shape.

/// Distance from which vertices do not push each other, gaps. Weights fade towards it, so that no pair
/// acts at once.
pub const NEAR_GAPS: f32 = 3.0;

/// Distance on the smoothed shape from which pairs count, gaps: between closer places there is hardly
/// a direction. Pairs have their whole weight from one and a half times this on.
pub const APART_GAPS: f32 = 2.0;

/// Distance along the smoothed shape up to which pairs are kept for the pushes of a tick, gaps: sweeps
/// between the pushes may bring them closer.
pub const KEPT_GAPS: f32 = 1.5;

/// Largest distance that one push makes up for, gaps. A limit for shapes that have gone wrong.
pub const MOST_MISSING_GAPS: f32 = 4.0;

/// Size of a cell of the search by [`NEAR_GAPS`]: a little more than 1, so that rounding hides no pair.
pub const CELL: f32 = 1.01;

/// Largest number of other vertices that each one is compared with, on average over a part of the
/// garment. A limit for shapes that have gone wrong.
const MOST_COMPARED: usize = 512;

/// Vertices whose order is kept. An asset.
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

/// Two vertices that push each other where their distance is too small.
#[derive(Clone, Copy, Debug)]
struct Pair {
    ends: [u32; 2],
    /// Unit vector from the first to the second on the smoothed shape.
    along: Vec3A,
    /// Weight in the means of both, 0 to 1.
    weight: f32,
}

/// Buffers of the pushes.
#[derive(Clone, Debug, Default)]
pub(super) struct OrderScratch {
    /// Smoothed shape of the current positions.
    smoothed: Vec<Vec3A>,
    samples: [Vec<Vec3A>; 2],
    search: SearchScratch,
    /// Pairs by part of the garment.
    pairs: Vec<Vec<Pair>>,
    /// Sums of each vertex: of its weighted pushes, and of the weights.
    sums: Vec<Vec4>,
}

#[cfg(test)]
impl OrderScratch {
    /// Ends of the pairs that were found.
    pub(super) fn pairs(&self) -> impl Iterator<Item = [u32; 2]> {
        self.pairs.iter().flatten().map(|pair| pair.ends)
    }
}

impl SheetOrder {
    /// Prepares the order of a garment, given the least distance along the smoothed shape in metres.
    /// None for a garment without coarse levels, which have the smoothed shape.
    pub(super) fn new(gap_m: f32, rest: &TriMesh, first_at_place: &[u32], levels: &Levels) -> Option<Self> {
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

    /// Smoothing of the shape.
    pub fn shape(&self) -> &SmoothedShape {
        &self.shape
    }

    /// Places of all vertices.
    pub fn places(&self) -> &[OrderPlace] {
        &self.places
    }

    /// Finds the pairs that may have to push each other, given the positions of all vertices.
    pub(super) fn find(&self, levels: &Levels, positions: &[Vec3A], scratch: &mut OrderScratch) {
        let OrderScratch {
            smoothed,
            samples,
            search,
            pairs,
            ..
        } = scratch;
        self.shape.smooth(levels, positions, samples, smoothed);
        Search::new(&self.places, self.gap_m, positions, smoothed, search).find(pairs);
    }

    /// Moves the vertices of the pairs apart by a share of what is missing, 0 to 1: each by the mean of
    /// its pushes, and by half of what is missing at most.
    pub(super) fn push(
        &self,
        share: f32,
        freedom: &Freedom,
        scratch: &mut OrderScratch,
        positions: &mut [Vec3A],
    ) {
        let OrderScratch { pairs, sums, .. } = scratch;
        sums.clear();
        sums.resize(positions.len(), Vec4::ZERO);
        for pair in pairs.iter().flatten() {
            let [a, b] = pair.ends.map(|v| v as usize);
            let missing = 1.0 - (positions[b] - positions[a]).dot(pair.along) / self.gap_m;
            // False for NaN.
            if missing > 0.0 {
                let missing = missing.min(MOST_MISSING_GAPS);
                // Pushes begin softly, so that a pair that hardly needs one does not dilute the others.
                let weight = pair.weight * (2.0 * missing).min(1.0);
                let push = pair.along * (weight * missing);
                sums[a] += (-push).extend(weight);
                sums[b] += push.extend(weight);
            }
        }
        let half = 0.5 * share * self.gap_m;
        for (vertex, (position, sum)) in (0..).zip(positions.iter_mut().zip(&*sums)) {
            // Below a weight of 1 the push is a part of itself.
            *position += Vec3A::from_vec4(*sum) * (half * freedom.of(vertex) / sum.w.max(1.0));
        }
    }
}
