//! Order of the cloth with itself.
//!
//! Sweeps lengthen the edges of a prediction that is too short. Its folds then grow narrow necks, where
//! their flanks pass through each other. So do the layers of a pleat, which a prediction moves one by
//! one. Pushes bring vertices that are close to each other back into the order that they have at rest:
//!
//! - along the smoothed shape ([`SheetOrder`]), where the flanks of a fold that crosses itself lie in
//!   reversed order;
//! - along the normals of layers that lie on each other at rest ([`LayerOrder`]), of which the outer
//!   one stays outside.
//!
//! Other implementations of a step read the constants here, and the places and distances of both.

mod layers;
mod search;
mod sheet;

use super::freedom::Freedom;
use glam::{Vec3A, Vec4};

pub use layers::{LEAST_COSINE, LayerOrder, LayerPlace};
pub use search::CELL;
pub use sheet::{APART_GAPS, OrderPlace, SheetOrder};

pub(super) use layers::LayerScratch;
pub(super) use sheet::SheetScratch;

/// Number of pushes in the sweeps of a tick. They come after the sweeps that hinges follow, and share
/// the other sweeps over the edges between them.
pub const ORDER_PASSES: usize = 3;

/// Largest distance that one push makes up for, in least distances of its order. A limit for shapes that have gone wrong.
pub const MOST_MISSING_GAPS: f32 = 4.0;

/// Distances of the pairs of an order, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderDistances {
    /// Distance from which vertices do not push each other. Weights fade towards it, so that no pair
    /// acts at once.
    pub near_m: f32,
    /// Distance in the order up to which pairs are kept for the pushes of a tick: sweeps between the
    /// pushes may bring them closer.
    pub kept_m: f32,
}

/// Two vertices that push each other where their distance is too small.
#[derive(Clone, Copy, Debug)]
struct Pair {
    ends: [u32; 2],
    /// Unit vector from the first to the second in their order.
    along: Vec3A,
    /// Weight in the means of both, 0 to 1.
    weight: f32,
}

/// Pairs that have been found, and buffers of their pushes.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs {
    /// Pairs by part of the garment.
    by_part: Vec<Vec<Pair>>,
    /// Sums of each vertex: of its weighted pushes, and of the weights.
    sums: Vec<Vec4>,
}

impl Pairs {
    /// Moves the vertices of the pairs apart by a share of what is missing, 0 to 1: each by the mean of
    /// its pushes, and by half of what is missing at most.
    pub(super) fn push(&mut self, gap_m: f32, share: f32, freedom: &Freedom, positions: &mut [Vec3A]) {
        let Self { by_part, sums } = self;
        sums.clear();
        sums.resize(positions.len(), Vec4::ZERO);
        for pair in by_part.iter().flatten() {
            let [a, b] = pair.ends.map(|v| v as usize);
            let missing = 1.0 - (positions[b] - positions[a]).dot(pair.along) / gap_m;
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
        let half = 0.5 * share * gap_m;
        for (vertex, (position, sum)) in (0..).zip(positions.iter_mut().zip(&*sums)) {
            // Below a weight of 1 the push is a part of itself.
            *position += Vec3A::from_vec4(*sum) * (half * freedom.of(vertex) / sum.w.max(1.0));
        }
    }

    /// Ends of the pairs that were found.
    #[cfg(test)]
    pub(super) fn ends(&self) -> impl Iterator<Item = [u32; 2]> {
        self.by_part.iter().flatten().map(|pair| pair.ends)
    }
}
