//! Baseline that repeats the previous frame.

use crate::{
    kinematics::PreparedClip,
    predictor::{Mode, Predictor, PredictorError},
};
use glam::Vec3;

/// Predicts the true previous frame, moved rigidly with the heading frame.
///
/// Its one-step error is the error of predicting no change.
#[derive(Clone, Copy, Debug)]
pub struct Hold;

impl Predictor for Hold {
    fn modes(&self) -> &[Mode] {
        &[Mode::OneStep]
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
        let world_from_frame = |t| clip.kinematics.world_from_frame(t);
        let now_from_before = world_from_frame(frame) * world_from_frame(frame - 1).inverse();
        let before = clip.captured.garment.frame(frame - 1);
        positions.clear();
        positions.extend(before.iter().map(|&x| now_from_before.point(x)));
        Ok(())
    }
}
