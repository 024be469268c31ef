//! Clips as pairs of motion vectors and coefficients.

use crate::{dataset::MotionVectors, mirror::View};
use glam::Vec3;
use rayon::prelude::*;
use std::{convert::Infallible, ops::Range};
use unic_core::{character::Garment, features::PointFrame};
use unic_eval::{LinearMap, Moments, PreparedClip, PrincipalComponents, TrainingSet};

/// Frames whose displacements are in memory at once.
const ROWS: usize = 64;

/// One clip: normalised pairs of motion vectors and components of the true displacement.
pub(super) struct Series {
    frames: usize,
    /// Frames × 2 D; frame 0 is paired with itself.
    inputs: Vec<f64>,
    /// Frames × K.
    components: Vec<f64>,
}

impl Series {
    pub(super) fn new(
        set: &TrainingSet,
        clip: usize,
        motion: &MotionVectors,
        components: &PrincipalComponents,
    ) -> Self {
        let frames = set.train[clip].len();
        let of_frame = |t| Ok::<_, Infallible>(displacements(&set.garment, &set.train[clip], t));
        let Ok(components) = projected(components, 0..frames, of_frame);
        Self {
            frames,
            inputs: (0..frames).flat_map(|t| pair(motion, t, View::Direct)).collect(),
            components,
        }
    }

    /// Number of frames.
    pub(super) fn len(&self) -> usize {
        self.frames
    }

    /// Consecutive pieces, `count` at most.
    pub(super) fn cut(&self, count: usize) -> Vec<Self> {
        let most = self.frames.div_ceil(count).max(1);
        let piece = |start: usize| {
            let frames = start..(start + most).min(self.frames);
            Self {
                frames: frames.len(),
                inputs: self.rows(&self.inputs, &frames).to_vec(),
                components: self.rows(&self.components, &frames).to_vec(),
            }
        };
        (0..self.frames).step_by(most).map(piece).collect()
    }

    fn rows<'a>(&self, of: &'a [f64], frames: &Range<usize>) -> &'a [f64] {
        let width = of.len() / self.frames.max(1);
        &of[frames.start * width..frames.end * width]
    }

    /// Of the true displacement: frames × K.
    pub(super) fn components(&self) -> &[f64] {
        &self.components
    }

    pub(super) fn moments(&self) -> Moments {
        Moments::new(&self.inputs, &self.components, self.frames)
    }

    /// What a map says of every frame: frames × K.
    pub(super) fn predicted(&self, map: Option<&LinearMap>) -> Vec<f64> {
        // Without another clip to fit, the mean is all that is known.
        map.map_or_else(
            || vec![0.0; self.components.len()],
            |m| m.apply_rows(&self.inputs),
        )
    }

    /// What a map leaves of the components: frames × K.
    pub(super) fn residual(&self, map: Option<&LinearMap>) -> impl Iterator<Item = f64> {
        let predicted = self.predicted(map).into_iter();
        self.components.iter().zip(predicted).map(|(c, p)| c - p)
    }
}

/// Components (frames × K) of what `of_frame` says, read a few frames at a time.
///
/// # Errors
/// Those of `of_frame`.
pub(super) fn projected<E: Send>(
    components: &PrincipalComponents,
    frames: Range<usize>,
    of_frame: impl Fn(usize) -> Result<Vec<Vec3>, E> + Sync,
) -> Result<Vec<f64>, E> {
    let starts: Vec<usize> = frames.clone().step_by(ROWS).collect();
    let piece = |start: usize| -> Result<Vec<f64>, E> {
        let mut samples = Vec::new();
        for frame in start..(start + ROWS).min(frames.end) {
            samples.extend(of_frame(frame)?.iter().flat_map(|u| u.to_array()));
        }
        Ok(components.project_rows(&samples))
    };
    let pieces: Result<Vec<Vec<f64>>, E> = starts.into_par_iter().map(piece).collect();
    Ok(pieces?.concat())
}

/// Displacements of a frame in the vertices' rotated frames as the mask leaves them, metres.
pub(crate) fn displacements(garment: &Garment, clip: &PreparedClip, frame: usize) -> Vec<Vec3> {
    let world_from_rest = clip.kinematics.world_from_rest(frame);
    let world = clip.captured.garment.frame(frame).iter().enumerate();
    world
        .map(|(v, x)| PointFrame::new(garment, v, world_from_rest).blended_displacement(*x))
        .collect()
}

/// Motion vectors of a frame and the one before; the first frame is paired with itself.
pub(super) fn pair(motion: &MotionVectors, frame: usize, view: View) -> Vec<f64> {
    let both = [frame.saturating_sub(1), frame].map(|t| motion.frame(t, view));
    both.concat().into_iter().map(f64::from).collect()
}
