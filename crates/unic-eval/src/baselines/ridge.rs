//! Baselines by linear regression: ridge regression and linear dynamics.

use super::{
    components::{ComponentModel, SeriesSet},
    fit::{Feedback, FittedRegression},
    skinning::place,
};
use crate::{
    kinematics::PreparedClip,
    predictor::{Mode, Predictor, PredictorError},
};
use glam::Vec3;
use std::sync::Arc;

/// Predicts the principal components of the displacement by a linear map. Its inputs are two motion
/// vectors and, in linear dynamics, the previous components.
#[derive(Clone, Debug)]
pub struct ComponentRegression {
    model: Arc<ComponentModel>,
    fitted: Option<FittedRegression>,
    modes: &'static [Mode],
    mode: Mode,
    /// Components of the previous frame, metres.
    state: Vec<f64>,
    displacements: Vec<f32>,
}

impl ComponentRegression {
    /// Fits a map from the motion alone.
    pub(super) fn ridge(model: &Arc<ComponentModel>, series: &SeriesSet) -> Self {
        Self::new(model, series, Feedback::None)
    }

    /// Fits a map from the motion and the previous components. In free running these are
    /// predictions.
    pub(super) fn linear_dynamics(model: &Arc<ComponentModel>, series: &SeriesSet) -> Self {
        Self::new(model, series, Feedback::Previous)
    }

    /// Fits a map with or without feedback.
    fn new(model: &Arc<ComponentModel>, series: &SeriesSet, feedback: Feedback) -> Self {
        Self {
            modes: match feedback {
                // Without feedback both modes predict the same.
                Feedback::None => &[Mode::FreeRunning],
                Feedback::Previous => &[Mode::OneStep, Mode::FreeRunning],
            },
            mode: Mode::FreeRunning,
            model: Arc::clone(model),
            fitted: FittedRegression::new(series, feedback),
            state: Vec::new(),
            displacements: Vec::new(),
        }
    }

    /// Returns the chosen regularisation strength, in units of an input's variance.
    ///
    /// `None` stands for a map that was not fitted for want of training pairs. It predicts the mean
    /// displacement.
    pub fn strength(&self) -> Option<f64> {
        self.fitted.as_ref().map(|f| f.strength)
    }
}

impl Predictor for ComponentRegression {
    fn modes(&self) -> &[Mode] {
        self.modes
    }

    fn start(&mut self, clip: &PreparedClip, mode: Mode) -> Result<(), PredictorError> {
        self.mode = mode;
        // Frame 0 is given. Ridge regression does not read it.
        self.state = self.model.truth(clip, 0);
        Ok(())
    }

    fn predict(
        &mut self,
        clip: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError> {
        let model = &self.model;
        if self.mode == Mode::OneStep {
            self.state = model.truth(clip, frame - 1);
        }
        self.state = match &self.fitted {
            Some(fitted) => fitted.next(&model.inputs(clip, frame), &self.state),
            None => Vec::new(),
        };
        model.components.reconstruct(&self.state, &mut self.displacements);
        let world_from_rest = clip.kinematics.world_from_rest(frame);
        place(&model.garment, &self.displacements, world_from_rest, positions);
        Ok(())
    }
}
