//! Cloth deep inside a limb: it is drawn back towards its skinned position.

use super::{RobustBody, RobustIntersection};
use glam::Vec3;
use std::ops::Range;

/// Depths over which retraction sets in, metres. It is complete at the end of the range.
///
/// At shallower depths the nearest way out is the way that the cloth came in. From the middle of a
/// limb, whose radius is 25 to 60 mm, it leads to all sides.
const DEPTHS_M: Range<f32> = 0.01..0.02;

/// Largest number of steps on the way to the skin.
const MAX_STEPS: usize = 8;

/// Distance from the margin at which a vertex has arrived, metres. The push that follows does the
/// rest.
const ARRIVED_M: f32 = 1e-3;

impl RobustIntersection {
    /// Smallest depth below the skin at which a vertex is retracted, metres.
    pub(crate) const MIN_RETRACTED_DEPTH_M: f32 = DEPTHS_M.start;

    /// Draws garment vertex `vertex`, deep inside the parts that may push it, from `p` towards its
    /// skinned position, up to the skin. None for a vertex that stays.
    ///
    /// A predicted sleeve may lie in the middle of an arm that is raised higher than in training.
    /// The shortest ways out would tear it: its neighbours leave the arm on opposite sides. Its
    /// skinned shape surrounds the arm, and the ways to that shape are alike for neighbours.
    ///
    /// The displacement grows from zero over a range of depths. The push that follows still changes
    /// sides in the middle of a limb. Positions are in the body's frame, metres. `seed` is a body
    /// face near the closest one.
    pub(crate) fn retract(
        &self,
        body: &RobustBody,
        vertex: usize,
        p: Vec3,
        skinned: Vec3,
        seed: u32,
    ) -> Option<Vec3> {
        let hit = body.closest(vertex, p, seed)?;
        let share = smooth_step(DEPTHS_M, -hit.signed_distance);
        if share == 0.0 || body.is_folded(hit.face, vertex) {
            return None;
        }
        let way = skinned - p;
        let (length, direction) = (way.length(), way.try_normalize()?);
        let (mut travelled, mut nearest) = (0.0, hit);
        for _ in 0..MAX_STEPS {
            // A step by the depth and the margin leads past the skin by the margin at most.
            travelled = f32::min(travelled + self.margin_m - nearest.signed_distance, length);
            if travelled == length {
                break;
            }
            nearest = body.closest(vertex, p + direction * travelled, nearest.face)?;
            if nearest.signed_distance > self.margin_m - ARRIVED_M {
                break;
            }
        }
        Some(p + direction * (share * travelled))
    }
}

/// Cubic from 0 at the start of a range to 1 at its end.
fn smooth_step(range: Range<f32>, x: f32) -> f32 {
    let t = ((x - range.start) / (range.end - range.start)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
