//! Clips that one fit holds out and the next one trains on.

use crate::dataset::MotionVectors;
use unic_eval::PreparedClip;

/// Training clips with everything that a field is trained on beside them, in the same order.
#[derive(Default)]
pub(super) struct ClipLists {
    pub(super) clips: Vec<PreparedClip>,
    pub(super) motion: Vec<MotionVectors>,
    /// Coefficients of the prior by clip and frame.
    pub(super) coefficients: Vec<Vec<Vec<f32>>>,
}

/// Clips that were taken out of the lists.
pub(super) struct HeldOut {
    /// Index of each clip in the whole lists, ascending.
    indices: Vec<usize>,
    lists: ClipLists,
}

impl HeldOut {
    /// Flags of the clips in the whole lists, beside so many that were not taken out.
    pub(super) fn flags(&self, others: usize) -> Vec<bool> {
        let clips = 0..others + self.indices.len();
        clips.map(|index| self.indices.contains(&index)).collect()
    }
}

impl ClipLists {
    /// Takes out the clips whose flag is set.
    pub(super) fn take_out(&mut self, flags: &[bool]) -> HeldOut {
        let mut held_out = HeldOut {
            indices: Vec::new(),
            lists: Self::default(),
        };
        // Backwards, so that the indices of the clips that remain stay valid.
        for index in (0..flags.len()).rev().filter(|i| flags[*i]) {
            held_out.indices.push(index);
            held_out.lists.clips.push(self.clips.remove(index));
            held_out.lists.motion.push(self.motion.remove(index));
            held_out.lists.coefficients.push(self.coefficients.remove(index));
        }
        held_out
    }

    /// Puts clips back where they were.
    pub(super) fn put_back(&mut self, held_out: HeldOut) {
        let HeldOut { indices, lists } = held_out;
        let clips = lists.clips.into_iter().zip(lists.motion).zip(lists.coefficients);
        // They were taken out from the last to the first, and go back from the first to the last.
        let mut clips: Vec<_> = indices.into_iter().zip(clips).collect();
        clips.reverse();
        for (index, ((clip, motion), coefficients)) in clips {
            self.clips.insert(index, clip);
            self.motion.insert(index, motion);
            self.coefficients.insert(index, coefficients);
        }
    }
}
