//! Trained models as predictors.

use crate::{
    kinematics::PreparedClip,
    predictor::{Mode, Predictor, PredictorError},
};
use glam::Vec3;
use std::sync::Arc;
use thiserror::Error;
use unic_core::{Animator, Model, Start, StepInput, config::StateConfig, model::ModelError};

/// Error of a clip whose frame rate is not the model's.
#[derive(Debug, Error, PartialEq)]
#[error("expected a clip at the model's {expected} frames per second, found {found}")]
pub struct FrameRateError {
    /// Frames per second of the model.
    pub expected: f32,
    /// Frames per second of the clip.
    pub found: f32,
}

impl FrameRateError {
    /// Checks that a clip has the frame rate of the model.
    ///
    /// # Errors
    /// Rates that differ by more than a thousandth.
    pub fn check(expected: f32, found: f32) -> Result<(), Self> {
        // Tools round rates such as 29.97 differently.
        match (expected - found).abs() > 1e-3 * expected {
            true => Err(Self { expected, found }),
            false => Ok(()),
        }
    }
}

/// Runs a model as an engine does: an animator that is reset on frame 0 and stepped once per frame.
#[derive(Clone, Debug)]
pub struct ModelPredictor {
    animator: Animator,
    mode: Mode,
}

impl ModelPredictor {
    /// Makes a predictor with the model's own intersection handling.
    pub fn new(model: Arc<Model>) -> Self {
        Self::from_animator(Animator::new(model))
    }

    /// Makes a predictor with an animator's model and settings.
    pub fn from_animator(animator: Animator) -> Self {
        Self {
            animator,
            mode: Mode::FreeRunning,
        }
    }
}

/// Runs the prior of a displacement model without its field.
///
/// The displacement that the field adds is zero, so that the garment is skinning plus the prior.
/// The difference to the model's own error is what the field contributes.
#[derive(Clone, Debug)]
pub struct PriorPredictor(ModelPredictor);

impl PriorPredictor {
    /// Makes a predictor of an animator's model with its intersection handling.
    ///
    /// Returns `None` for a model without a prior, whose state is not a displacement.
    ///
    /// # Errors
    /// Parts that make no model. Models that were read or trained have none.
    pub fn new(animator: &Animator) -> Result<Option<Self>, ModelError> {
        let mut parts = animator.model().to_parts();
        let StateConfig::Displacement(config) = &mut parts.config.state else {
            return Ok(None);
        };
        // Without memory and with a field whose output is zero, nothing is added to the prior.
        (config.memory_s, config.excursion_m) = (0.0, None);
        if let Some(head) = parts.field.last_mut() {
            head.weight.fill(0.0);
            head.bias.fill(0.0);
        }
        let mut prior = Animator::new(Arc::new(Model::new(parts)?));
        prior.set_intersection(animator.intersection());
        Ok(Some(Self(ModelPredictor::from_animator(prior))))
    }
}

impl Predictor for PriorPredictor {
    /// Without a state both modes predict the same.
    fn modes(&self) -> &[Mode] {
        &[Mode::FreeRunning]
    }

    fn start(&mut self, clip: &PreparedClip, mode: Mode) -> Result<(), PredictorError> {
        self.0.start(clip, mode)
    }

    fn predict(
        &mut self,
        clip: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError> {
        self.0.predict(clip, frame, positions)
    }
}

/// Returns the animator's input in one frame of a clip.
fn input(clip: &PreparedClip, frame: usize) -> StepInput<'_> {
    StepInput::of_clip(&clip.captured.clip, frame)
}

impl Predictor for ModelPredictor {
    fn modes(&self) -> &[Mode] {
        &[Mode::OneStep, Mode::FreeRunning]
    }

    fn start(&mut self, clip: &PreparedClip, mode: Mode) -> Result<(), PredictorError> {
        FrameRateError::check(self.animator.model().config().fps, clip.captured.clip.fps)?;
        self.mode = mode;
        // Frame 0 of the truth is given to every predictor.
        let first = Start::Positions(clip.captured.garment.frame(0));
        self.animator.reset(&input(clip, 0), first)?;
        Ok(())
    }

    fn predict(
        &mut self,
        clip: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError> {
        if self.mode == Mode::OneStep {
            self.animator
                .set_garment(clip.captured.garment.frame(frame - 1))?;
        }
        let garment = self.animator.step(&input(clip, frame))?;
        positions.clear();
        // The animator's positions are overwritten by its next step.
        positions.extend_from_slice(garment.positions);
        Ok(())
    }
}
