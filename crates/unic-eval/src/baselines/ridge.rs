//! Ridge regression and linear dynamics: the rows to be ashamed of losing to.

use super::{
    components::{ComponentModel, SeriesSet},
    fit::{Feedback, Fitted},
    skinning::place,
};
use crate::{
    kinematics::PreparedClip,
    predictor::{Mode, Predictor, PredictorError},
};
use glam::Vec3;
use std::sync::Arc;

/// A linear map from two motion vectors, and in linear dynamics the previous components, to the
/// principal components of the displacement.
#[derive(Clone, Debug)]
pub struct ComponentRegression {
    model: Arc<ComponentModel>,
    fitted: Option<Fitted>,
    modes: &'static [Mode],
    mode: Mode,
    /// Components of the frame predicted last.
    state: Vec<f64>,
    displacements: Vec<f32>,
}

impl ComponentRegression {
    /// From the motion alone.
    pub(super) fn ridge(model: &Arc<ComponentModel>, series: &SeriesSet) -> Self {
        Self::new(model, series, Feedback::None)
    }

    /// From the motion and the components before, which in a free run are its own.
    pub(super) fn linear_dynamics(model: &Arc<ComponentModel>, series: &SeriesSet) -> Self {
        Self::new(model, series, Feedback::Previous)
    }

    fn new(model: &Arc<ComponentModel>, series: &SeriesSet, feedback: Feedback) -> Self {
        Self {
            modes: match feedback {
                // Without feedback both modes are one.
                Feedback::None => &[Mode::FreeRunning],
                Feedback::Previous => &[Mode::OneStep, Mode::FreeRunning],
            },
            mode: Mode::FreeRunning,
            model: Arc::clone(model),
            fitted: Fitted::new(series, feedback),
            state: Vec::new(),
            displacements: Vec::new(),
        }
    }

    /// The ridge strength chosen, in units of an input's variance; none when there was nothing to
    /// fit and the mean displacement is predicted.
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
