//! Baseline that predicts the mean training frame.

use crate::{
    kinematics::PreparedClip,
    pca::mean,
    predictor::{Mode, Predictor, PredictorError},
    training::{RootRelativePositions, TrainingSet},
};
use glam::Vec3;

/// Predicts the mean of the training frames, moved rigidly with the heading frame.
#[derive(Clone, Debug)]
pub struct MeanShape {
    /// Mean positions relative to the root joint, in the heading frame, metres.
    shape: Vec<Vec3>,
}

impl MeanShape {
    /// Computes the mean over all training frames.
    pub fn fit(set: &TrainingSet) -> Self {
        let frames = set.frames();
        Self {
            shape: points(&mean(&RootRelativePositions { set, frames })).collect(),
        }
    }
}

/// Reads consecutive x, y, z as points.
pub(super) fn points(numbers: &[f32]) -> impl Iterator<Item = Vec3> {
    numbers.chunks_exact(3).map(Vec3::from_slice)
}

impl Predictor for MeanShape {
    fn modes(&self) -> &[Mode] {
        &[Mode::FreeRunning]
    }

    fn start(&mut self, _: &PreparedClip, _: Mode) -> Result<(), PredictorError> {
        Ok(())
    }

    fn predict(
        &mut self,
        clip: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError> {
        let world_from_state = clip.kinematics.world_from_state(frame);
        positions.clear();
        positions.extend(self.shape.iter().map(|&x| world_from_state.point(x)));
        Ok(())
    }
}
