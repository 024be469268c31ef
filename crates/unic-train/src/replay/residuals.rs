//! True displacements of training motions, and what predictions of them lack.

use crate::{prior::displacements, recurrence::Sequence};
use glam::Vec3;
use std::ops::Range;
use unic_core::{character::Garment, prior::Prior};
use unic_eval::PreparedClip;

/// Sequences with their predictions by priors that have not seen them.
#[derive(Clone, Copy)]
pub(crate) struct Residuals<'a> {
    /// Garment with V vertices.
    pub(crate) garment: &'a Garment,
    /// Mean and components of the predictions.
    pub(crate) prior: &'a Prior,
    /// Sequences of the direct view.
    pub(crate) sequences: &'a [Sequence<'a>],
    /// Clip of each sequence.
    pub(crate) clips: &'a [&'a PreparedClip],
    /// Predicted coefficients of each sequence, frames × K.
    pub(crate) left_out: &'a [Vec<f32>],
}

/// Displacements of one frame in rest space, V vectors in metres.
pub(super) struct FrameResidual {
    /// True displacements.
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
        let (mut scaled, mut predicted) = (Vec::new(), vec![Vec3::ZERO; truth.len()]);
        self.prior.components.scale(coefficients, &mut scaled);
        self.prior.displacements(0, &scaled, &mut predicted);
        FrameResidual {
            residual: truth.iter().zip(predicted).map(|(u, p)| *u - p).collect(),
            truth,
        }
    }

    /// Number of frames of each sequence.
    pub(super) fn lengths(&self) -> Vec<usize> {
        self.sequences.iter().map(Sequence::len).collect()
    }
}

/// Evenly spread frames of evenly spread sequences with these lengths, `most` at most: number of the
/// sequence and its frames. Sequences are so few that each may have `least` frames, so that they show
/// its variation.
pub(super) fn spread(lengths: &[usize], most: usize, least: usize) -> Vec<(usize, Vec<usize>)> {
    let chosen = chosen(lengths, most, least);
    let all: usize = chosen.iter().map(|i| lengths[*i]).sum();
    let every = all.div_ceil(most.max(1)).max(1);
    let frames = |i: usize| (i, (0..lengths[i]).step_by(every).collect());
    chosen.into_iter().map(frames).collect()
}

/// Last frames of evenly spread sequences with these lengths, the same share of each and `most` in
/// all at most: number of the sequence and its frames. Sequences are so few that each may have
/// `least` frames.
pub(super) fn last(lengths: &[usize], most: usize, least: usize) -> Vec<(usize, Range<usize>)> {
    let chosen = chosen(lengths, most, least);
    let all: usize = chosen.iter().map(|i| lengths[*i]).sum();
    let last = |i: usize| {
        let kept = (lengths[i] * most.min(all)).checked_div(all).unwrap_or(0);
        (i, lengths[i] - kept..lengths[i])
    };
    chosen.into_iter().map(last).collect()
}

/// Numbers of evenly spread sequences, so few that each may have `least` of `most` frames.
fn chosen(lengths: &[usize], most: usize, least: usize) -> Vec<usize> {
    let wanted: usize = lengths.iter().map(|len| (*len).min(least)).sum();
    let every = wanted.div_ceil(most.max(1)).max(1);
    (0..lengths.len()).step_by(every).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_stay_within_their_number_and_sequences_are_long_enough() {
        for (clips, len) in [(1, 5), (1, 9000), (3, 1000), (20, 2000), (400, 60), (5000, 90)] {
            for (most, least) in [(1000, 30), (10_240, 150)] {
                let lengths = vec![len; clips];
                let spread = spread(&lengths, most, least);
                let last = last(&lengths, most, least);
                assert!(last.iter().all(|(_, frames)| frames.end == len));
                let counts: [Vec<usize>; 2] = [
                    spread.iter().map(|(_, frames)| frames.len()).collect(),
                    last.iter().map(|(_, frames)| frames.len()).collect(),
                ];
                for counts in counts {
                    // Rounding may add a frame a sequence.
                    let all: usize = counts.iter().sum();
                    assert!(
                        (1..=most + counts.len()).contains(&all),
                        "{clips} × {len}: {all} of {most}"
                    );
                    let shortest = *counts.iter().min().unwrap();
                    assert!(2 * shortest >= len.min(least), "{clips} × {len}: {shortest}");
                }
            }
        }
        assert_eq!(last(&[1000; 3], 10_240, 150), [0, 1, 2].map(|i| (i, 0..1000)));
        assert_eq!(last(&[], 10_240, 150), []);
    }
}
