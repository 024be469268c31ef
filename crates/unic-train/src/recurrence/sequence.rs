//! Stretches of motion with the coefficients of the garment.

use crate::{dataset::MotionVectors, mirror::View};
use std::ops::Range;
use unic_core::recurrence::{Recurrence, RecurrenceScratch};

/// Consecutive frames of one clip in one view.
#[derive(Clone)]
pub(crate) struct Sequence<'a> {
    pub(crate) motion: &'a MotionVectors,
    pub(crate) view: View,
    pub(crate) frames: Range<usize>,
    /// Coefficients to learn, in metres: frames × K.
    pub(crate) coefficients: Vec<f32>,
    /// Coefficients that a linear map predicts which was fitted without the motion: frames × K.
    pub(crate) linear: Vec<f32>,
    /// Number of the motion. A sequence, its mirror image and the same motion in another wind share
    /// it.
    pub(crate) motion_number: usize,
}

impl Sequence<'_> {
    pub(crate) fn len(&self) -> usize {
        self.frames.len()
    }

    /// Number K of coefficients.
    pub(crate) fn outputs(&self) -> usize {
        self.coefficients.len() / self.len().max(1)
    }

    /// Appends the normalised motion pair of the sequence's frame `t`. The first frame of a clip is
    /// paired with itself.
    pub(crate) fn write_pair(&self, t: usize, out: &mut Vec<f32>) {
        let frame = self.frames.start + t;
        out.extend_from_slice(self.motion.frame(frame.saturating_sub(1), self.view));
        out.extend_from_slice(self.motion.frame(frame, self.view));
    }

    /// Coefficients that a recurrence predicts, computed as the animator does: frames × K.
    pub(crate) fn predicted_by(&self, recurrence: &Recurrence) -> Vec<f32> {
        let mut coefficients = Vec::with_capacity(self.coefficients.len());
        self.run(recurrence, |state, scratch| {
            let first = coefficients.len();
            coefficients.resize(first + self.outputs(), 0.0);
            recurrence.add_to(state, scratch, &mut coefficients[first..]);
        });
        coefficients
    }

    /// Computes the inputs of a recurrence's last map, frames × width.
    pub(super) fn hidden(&self, recurrence: &Recurrence) -> Vec<f32> {
        let mut hidden = Vec::with_capacity(self.len() * recurrence.head.inputs);
        self.run(recurrence, |state, scratch| {
            hidden.extend_from_slice(recurrence.hidden(state, scratch))
        });
        hidden
    }

    /// Runs a recurrence through the frames and shows `each` its state.
    fn run(&self, recurrence: &Recurrence, mut each: impl FnMut(&[f32], &mut RecurrenceScratch)) {
        let (mut scratch, mut state) = (RecurrenceScratch::default(), Vec::new());
        let mut pair = Vec::new();
        for t in 0..self.len() {
            pair.clear();
            self.write_pair(t, &mut pair);
            recurrence.embed(&pair, &mut scratch);
            match t {
                0 => recurrence.start(&mut scratch, &mut state),
                _ => recurrence.advance(&mut scratch, &mut state),
            }
            each(&state, &mut scratch);
        }
    }
}

/// Number of different motions, which are numbered from 0 on.
pub(super) fn motion_count(sequences: &[Sequence]) -> usize {
    sequences.iter().map(|s| s.motion_number + 1).max().unwrap_or(0)
}
