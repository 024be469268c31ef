//! Training clips of a capture, and matrices over them that are read piece by piece.

use crate::{
    error::{Error, Result},
    kinematics::PreparedClip,
    pca::SampleMatrix,
};
use std::ops::Range;
use unic_core::{
    character::Garment,
    features::PointFrame,
    motion::{MotionLayout, MotionSpec, VelocityScheme},
};
use unic_io::{Capture, Split};

/// Clips that baselines may be fitted on. Test clips are never among them.
#[derive(Clone, Debug)]
pub struct TrainingSet {
    /// Garment of the clips.
    pub garment: Garment,
    /// Training clips, to fit.
    pub train: Vec<PreparedClip>,
    /// Validation clips, to choose regularisation strengths. Without any, cross-validation leaves
    /// out one training clip at a time.
    pub validation: Vec<PreparedClip>,
}

/// Reads the clips that baselines are fitted on.
///
/// A garment in a `.npy` file is mapped and takes no memory of its own. A garment in an npz file is
/// read completely.
///
/// # Errors
/// No training clips of two frames or more, and files that cannot be used.
pub fn training_set(capture: &Capture) -> Result<TrainingSet> {
    training_set_of(capture, &baseline_motion_spec(capture)?)
}

/// Reads the clips of a capture to fit on, with motion vectors of the given specification.
///
/// # Errors
/// No training clips of two frames or more, and files that cannot be used.
pub fn training_set_of(capture: &Capture, spec: &MotionSpec) -> Result<TrainingSet> {
    let load = |split| -> Result<Vec<PreparedClip>> {
        let names = capture.clip_names(split).iter();
        let prepare = |name: &String| {
            let captured = capture.load_clip(name)?;
            Ok(PreparedClip::new(spec, &capture.character.skeleton, captured))
        };
        names.map(prepare).collect()
    };
    let train = load(Split::Train)?;
    if train.iter().all(|clip| clip.len() < 2) {
        let capture = capture.manifest.name.clone();
        return Err(Error::NoTraining { capture });
    }
    Ok(TrainingSet {
        garment: capture.garment.clone(),
        train,
        validation: load(Split::Validation)?,
    })
}

/// Returns the specification of the motion vectors that baselines read: heading layout, backward
/// velocities.
pub(crate) fn baseline_motion_spec(capture: &Capture) -> Result<MotionSpec> {
    let (layout, velocity) = (MotionLayout::Heading, VelocityScheme::Backward);
    Ok(MotionSpec::new(
        layout,
        velocity,
        capture.contact_joints,
        &capture.character,
    )?)
}

/// Position of a frame among the training clips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameIndex {
    /// Index of the clip among the training clips.
    pub clip: usize,
    /// Index of the frame in its clip.
    pub frame: usize,
}

impl TrainingSet {
    /// Returns every frame of every training clip.
    pub fn frames(&self) -> Vec<FrameIndex> {
        let frames =
            |(clip, c): (usize, &PreparedClip)| (0..c.len()).map(move |frame| FrameIndex { clip, frame });
        self.train.iter().enumerate().flat_map(frames).collect()
    }

    /// Returns the number of each training clip's motion, see [`motion_numbers`].
    pub fn motions(&self) -> Vec<usize> {
        motion_numbers(&self.train)
    }

    /// Returns at most `most` frames, evenly spaced over all of them.
    pub fn spread_frames(&self, most: usize) -> Vec<FrameIndex> {
        let all = self.frames();
        let kept = all.len().min(most);
        // Integer spacing takes the first frame and never the same one twice.
        (0..kept).map(|k| all[k * all.len() / kept]).collect()
    }
}

/// Matrix of displacements m_i R_iᵀ (x − LBS_i(rest)), with m the garment's mask. A sample is a
/// frame: x, y, z of every vertex, metres.
#[derive(Clone, Debug)]
pub struct Displacements<'a> {
    /// Training set of the frames.
    pub set: &'a TrainingSet,
    /// Frame of each sample.
    pub frames: Vec<FrameIndex>,
}

/// Matrix of positions relative to the root joint, in the orientation of the motion vectors. A
/// sample is a frame: x, y, z of every vertex, metres.
#[derive(Clone, Debug)]
pub struct RootRelativePositions<'a> {
    /// Training set of the frames.
    pub set: &'a TrainingSet,
    /// Frame of each sample.
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
        // Removing place and heading leaves what a shape model can learn.
        let state_from_world = clip.kinematics.world_from_state(frame).inverse();
        let world = &clip.captured.garment.frame(frame)[vertices(&columns)];
        for (x, out) in world.iter().zip(out.chunks_exact_mut(3)) {
            out.copy_from_slice(&state_from_world.point(*x).to_array());
        }
    }
}

/// Writes the displacements of a frame: x, y, z of the vertices that `columns` cover, metres.
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

/// Converts a range of columns into a range of vertices. Blocks of columns begin and end between
/// vertices.
fn vertices(columns: &Range<usize>) -> Range<usize> {
    debug_assert!(columns.start.is_multiple_of(3) && columns.end.is_multiple_of(3));
    columns.start / 3..columns.end / 3
}

/// Returns the number of each clip's motion, from 0 on.
///
/// Clips of one motion in several winds share a number: cross-validation leaves them out together,
/// since a fit that has seen the motion is no measure of unseen motion. Where all clips show the
/// same motion, each has a number of its own.
pub fn motion_numbers(clips: &[PreparedClip]) -> Vec<usize> {
    let clip = |i: usize| &clips[i].captured.clip;
    let mut firsts: Vec<usize> = Vec::new();
    let number = |i: usize| {
        let known = firsts.iter().position(|&j| clip(j).has_motion_of(clip(i)));
        known.unwrap_or_else(|| {
            firsts.push(i);
            firsts.len() - 1
        })
    };
    let numbers: Vec<usize> = (0..clips.len()).map(number).collect();
    // With a single motion, leaving it out would leave nothing to fit: its winds are held out
    // instead.
    match firsts.len() {
        1 => (0..clips.len()).collect(),
        _ => numbers,
    }
}
