//! Search for the frame of a library that fits a motion best.

use super::{
    Key, Library,
    key::{KEY_STEPS, distance},
};

/// Weight of the distance of residuals in the cost of a frame. At a distance as large as a typical
/// residual it counts as much as one unit of a key.
const RESIDUAL_WEIGHT: f32 = 1.0;

/// Frame that a search has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found {
    pub(super) frame: u32,
    /// Cost of the frame, in squared steps of a key.
    pub(super) cost: f32,
}

impl Library {
    /// Finds the frame with the least cost that is followed by `least` frames or more: the distance
    /// of its key, and that of its residual from the present one. An empty residual counts for
    /// nothing. Ties go to the first frame. Returns none if all clips are shorter.
    pub(super) fn best(&self, key: &Key, residual: &[f32], least: u32) -> Option<Found> {
        let unit = match self.mean_square() > 0.0 {
            true => RESIDUAL_WEIGHT * KEY_STEPS * KEY_STEPS / self.mean_square(),
            false => 0.0,
        };
        let mut best: Option<Found> = None;
        for (frame, candidate) in (0..).zip(self.keys()) {
            let cost = distance(key, candidate) as f32;
            let is_worse = |best: &Found| cost >= best.cost;
            // Residuals are read only where keys are close enough, which skips nearly all of them.
            if self.remaining(frame) < least || best.as_ref().is_some_and(is_worse) {
                continue;
            }
            let gap = self.residual(frame).zip(residual).map(|(a, b)| (a - b).powi(2));
            let cost = cost + unit * gap.sum::<f32>();
            if best.is_none_or(|best| cost < best.cost) {
                best = Some(Found { frame, cost });
            }
        }
        best
    }
}
