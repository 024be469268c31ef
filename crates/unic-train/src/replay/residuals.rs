//! True displacements of training motions, and what predictions of them lack.

use crate::{prior::displacements, recurrence::Sequence};
use glam::Vec3;
use std::ops::Range;
use unic_core::{character::Garment, prior::Prior};
use unic_eval::{PreparedClip, WrinkleFilter};

/// Sequences with their predictions by priors that have not seen them.
#[derive(Clone, Copy)]
pub(crate) struct Residuals<'a> {
    pub(crate) garment: &'a Garment,
    /// Mean and components of the predictions.
    pub(crate) prior: &'a Prior,
    pub(crate) sequences: &'a [Sequence<'a>],
    /// Clip of each sequence.
    pub(crate) clips: &'a [&'a PreparedClip],
    /// Predicted coefficients of each sequence, frames × K.
    pub(crate) left_out: &'a [Vec<f32>],
}

/// Displacements of one frame in rest space, V vectors in metres.
pub(super) struct FrameResidual {
    pub(super) truth: Vec<Vec3>,
    /// Truth minus prediction.
    pub(super) residual: Vec<Vec3>,
}

impl Residuals<'_> {
    /// Displacements of frame `t` of a sequence.
    pub(super) fn frame(&self, sequence: usize, t: usize) -> FrameResidual {
        let s = &self.sequences[sequence];
        let truth = displacements(self.garment, self.clips[sequence], s.frames.start + t);
        let coefficients = &self.left_out[sequence][t * s.outputs()..][..s.outputs()];
        let vertices = truth.iter().enumerate();
        let residual = vertices.map(|(v, u)| *u - self.prior.displacement(v, coefficients));
        FrameResidual {
            residual: residual.collect(),
            truth,
        }
    }

    /// Wrinkles that the prediction lacks in frames of a sequence: frames × V, metres.
    pub(super) fn wrinkles(
        &self,
        filter: &WrinkleFilter,
        sequence: usize,
        frames: impl Iterator<Item = usize>,
    ) -> Vec<f32> {
        let residuals: Vec<_> = frames.map(|t| self.frame(sequence, t).residual).collect();
        filter.wrinkles(&residuals)
    }

    /// Frames of each sequence, spread evenly over all: `most` at most, and one more a sequence.
    pub(super) fn spread(&self, most: usize) -> Vec<Vec<usize>> {
        let all: usize = self.sequences.iter().map(Sequence::len).sum();
        let every = all.div_ceil(most.max(1)).max(1);
        let frames = |s: &Sequence| (0..s.len()).step_by(every).collect();
        self.sequences.iter().map(frames).collect()
    }

    /// Last frames of each sequence: the same share of each, `most` in all at most. A clip's start
    /// is left out, because the garment has no past there.
    pub(super) fn last(&self, most: usize) -> Vec<Range<usize>> {
        let all: usize = self.sequences.iter().map(Sequence::len).sum();
        let kept = |s: &Sequence| (s.len() * most.min(all)).checked_div(all).unwrap_or(0);
        let frames = |s: &Sequence| s.len() - kept(s)..s.len();
        self.sequences.iter().map(frames).collect()
    }
}
