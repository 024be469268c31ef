//! The clips that baselines are fitted on, as matrices that are read piece by piece.

use crate::{kinematics::PreparedClip, pca::SampleMatrix};
use std::ops::Range;
use unic_core::{character::Garment, features::PointFrame};

/// What baselines may look at. Test clips are none of it.
#[derive(Clone, Debug)]
pub struct TrainingSet {
    /// The garment that the clips show.
    pub garment: Garment,
    /// Clips to fit.
    pub train: Vec<PreparedClip>,
    /// Clips to choose strengths by; empty leaves out one training clip at a time instead.
    pub validation: Vec<PreparedClip>,
}

/// A frame of a training clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameIndex {
    /// Index among the training clips.
    pub clip: usize,
    /// Frame of that clip.
    pub frame: usize,
}

impl TrainingSet {
    /// Every frame of every training clip.
    pub fn frames(&self) -> Vec<FrameIndex> {
        let frames =
            |(clip, c): (usize, &PreparedClip)| (0..c.len()).map(move |frame| FrameIndex { clip, frame });
        self.train.iter().enumerate().flat_map(frames).collect()
    }

    /// The motion of each training clip, counted from 0 on: clips of one motion in several winds are left out
    /// together, so that what judges is not known. Where there is but one motion, its winds are told apart.
    pub fn motions(&self) -> Vec<usize> {
        let clip = |i: usize| &self.train[i].captured.clip;
        let mut firsts: Vec<usize> = Vec::new();
        let number = |i: usize| {
            let known = firsts.iter().position(|&j| clip(j).has_motion_of(clip(i)));
            known.unwrap_or_else(|| {
                firsts.push(i);
                firsts.len() - 1
            })
        };
        let numbers: Vec<usize> = (0..self.train.len()).map(number).collect();
        match firsts.len() {
            1 => (0..self.train.len()).collect(),
            _ => numbers,
        }
    }

    /// At most `most` frames, evenly spaced over all of them.
    pub fn spread_frames(&self, most: usize) -> Vec<FrameIndex> {
        let all = self.frames();
        let kept = all.len().min(most);
        (0..kept).map(|k| all[k * all.len() / kept]).collect()
    }
}

/// Displacements m_i R_iᵀ (x − LBS_i(rest)) of chosen frames, m the garment's mask: a sample a frame, x y z
/// of every vertex.
#[derive(Clone, Debug)]
pub struct Displacements<'a> {
    /// Where the frames come from.
    pub set: &'a TrainingSet,
    /// One a sample.
    pub frames: Vec<FrameIndex>,
}

/// Positions relative to the root joint of chosen frames, turned as the motion vectors are.
#[derive(Clone, Debug)]
pub struct RootRelativePositions<'a> {
    /// Where the frames come from.
    pub set: &'a TrainingSet,
    /// One a sample.
    pub frames: Vec<FrameIndex>,
}

impl SampleMatrix for Displacements<'_> {
    fn rows(&self) -> usize {
        self.frames.len()
    }

    fn columns(&self) -> usize {
        3 * self.set.garment.rest.vertices.len()
    }

    fn read(&self, row: usize, columns: Range<usize>, out: &mut [f32]) {
        let FrameIndex { clip, frame } = self.frames[row];
        write_displacements(&self.set.garment, &self.set.train[clip], frame, columns, out);
    }
}

impl SampleMatrix for RootRelativePositions<'_> {
    fn rows(&self) -> usize {
        self.frames.len()
    }

    fn columns(&self) -> usize {
        3 * self.set.garment.rest.vertices.len()
    }

    fn read(&self, row: usize, columns: Range<usize>, out: &mut [f32]) {
        let FrameIndex { clip, frame } = self.frames[row];
        let clip = &self.set.train[clip];
        let state_from_world = clip.kinematics.world_from_state(frame).inverse();
        let world = &clip.captured.garment.frame(frame)[vertices(&columns)];
        for (x, out) in world.iter().zip(out.chunks_exact_mut(3)) {
            out.copy_from_slice(&state_from_world.point(*x).to_array());
        }
    }
}

/// The displacements of a frame of any clip, x y z of the vertices that `columns` cover.
pub(crate) fn write_displacements(
    garment: &Garment,
    clip: &PreparedClip,
    frame: usize,
    columns: Range<usize>,
    out: &mut [f32],
) {
    let world_from_rest = clip.kinematics.world_from_rest(frame);
    let world = clip.captured.garment.frame(frame);
    for (vertex, out) in vertices(&columns).zip(out.chunks_exact_mut(3)) {
        let own = PointFrame::new(garment, vertex, world_from_rest);
        out.copy_from_slice(&own.blended_displacement(world[vertex]).to_array());
    }
}

/// Blocks of columns begin and end between vertices.
fn vertices(columns: &Range<usize>) -> Range<usize> {
    debug_assert!(columns.start.is_multiple_of(3) && columns.end.is_multiple_of(3));
    columns.start / 3..columns.end / 3
}
