//! Clips as pairs of motion vectors and coefficients.

use crate::{dataset::MotionVectors, mirror::View};
use glam::Vec3;
use rayon::prelude::*;
use unic_core::{character::Garment, features::PointFrame};
use unic_eval::{LinearMap, Moments, PreparedClip, PrincipalComponents, TrainingSet};

/// One clip: normalised pairs of motion vectors and components of the true displacement.
pub(super) struct Series {
    /// Of frames 0, 1, ...: 2 D numbers each; frame 0 is paired with itself.
    pub(super) inputs: Vec<Vec<f64>>,
    /// Of frames 0, 1, ...: K numbers each.
    pub(super) components: Vec<Vec<f64>>,
}

impl Series {
    /// Consecutive pieces, `count` at most.
    pub(super) fn cut(&self, count: usize) -> Vec<Self> {
        let frames = self.inputs.len().div_ceil(count).max(1);
        let pieces = self.inputs.chunks(frames).zip(self.components.chunks(frames));
        pieces
            .map(|(inputs, components)| Self {
                inputs: inputs.to_vec(),
                components: components.to_vec(),
            })
            .collect()
    }

    pub(super) fn new(
        set: &TrainingSet,
        clip: usize,
        motion: &MotionVectors,
        components: &PrincipalComponents,
    ) -> Self {
        let project = |t: usize| {
            let displacements = displacements(&set.garment, &set.train[clip], t);
            let sample: Vec<f32> = displacements.iter().flat_map(|u| u.to_array()).collect();
            components.project(&sample)
        };
        let frames = set.train[clip].len();
        Self {
            inputs: (0..frames).map(|t| pair(motion, t, View::Direct)).collect(),
            components: (0..frames).into_par_iter().map(project).collect(),
        }
    }

    pub(super) fn moments(&self) -> Moments {
        Moments::new(
            &self.inputs.concat(),
            &self.components.concat(),
            self.inputs.len(),
        )
    }

    pub(super) fn predicted(&self, map: Option<&LinearMap>, frame: usize) -> Vec<f64> {
        // Without another clip to fit, the mean is all that is known.
        map.map_or_else(
            || vec![0.0; self.components[frame].len()],
            |m| m.apply(&self.inputs[frame]),
        )
    }

    /// Sum of squared errors.
    pub(super) fn error(&self, map: Option<&LinearMap>) -> f64 {
        let squared = |t: usize| -> f64 {
            let predicted = self.predicted(map, t);
            predicted
                .iter()
                .zip(&self.components[t])
                .map(|(p, c)| (p - c).powi(2))
                .sum()
        };
        (0..self.inputs.len()).map(squared).sum()
    }

    pub(super) fn coefficients(&self, map: Option<&LinearMap>) -> Vec<Vec<f32>> {
        let frames = 0..self.inputs.len();
        frames
            .map(|t| self.predicted(map, t).iter().map(|a| *a as f32).collect())
            .collect()
    }
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
