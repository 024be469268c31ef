//! A trained model as a row of the table.

use crate::{
    kinematics::PreparedClip,
    predictor::{Mode, Predictor, PredictorError},
};
use glam::Vec3;
use std::sync::Arc;
use thiserror::Error;
use unic_core::{
    animator::{Animator, Start, StepInput},
    config::StateConfig,
    model::{Model, ModelError},
};

/// A clip at another rate than the model ticks.
#[derive(Debug, Error, PartialEq)]
#[error("expected a clip at the model's {expected} frames per second, found {found}")]
pub struct FrameRateError {
    /// The model's.
    pub expected: f32,
    /// The clip's.
    pub found: f32,
}

impl FrameRateError {
    /// Whether a clip's rate is the model's: rates such as 29.97 are rounded differently by different tools.
    ///
    /// # Errors
    /// Rates more than a thousandth apart.
    pub fn check(expected: f32, found: f32) -> Result<(), Self> {
        match (expected - found).abs() > 1e-3 * expected {
            true => Err(Self { expected, found }),
            false => Ok(()),
        }
    }
}

/// Runs a model as an engine would: one animator, reset on frame 0 and stepped once a frame.
#[derive(Clone, Debug)]
pub struct ModelPredictor {
    animator: Animator,
    mode: Mode,
}

impl ModelPredictor {
    /// With the model's own intersection handling.
    pub fn new(model: Arc<Model>) -> Self {
        Self::from_animator(Animator::new(model))
    }

    /// With an animator's settings.
    pub fn from_animator(animator: Animator) -> Self {
        Self {
            animator,
            mode: Mode::FreeRunning,
        }
    }
}

/// A displacement model's prior on its own: the state of every vertex is zero, so that the garment
/// hangs where the motion up to now says. What the field has to beat.
#[derive(Clone, Debug)]
pub struct PriorPredictor(ModelPredictor);

impl PriorPredictor {
    /// Of an animator's model, with its intersection handling; `None` where the state is no
    /// displacement and there is no prior.
    ///
    /// # Errors
    /// None for a model that has been read or trained.
    pub fn new(animator: &Animator) -> Result<Option<Self>, ModelError> {
        let mut parts = animator.model().to_parts();
        let StateConfig::Displacement(config) = &mut parts.config.state else {
            return Ok(None);
        };
        // The vertices remember nothing, and nothing is added to the prior.
        config.memory_s = 0.0;
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
    /// Without a state both modes are one.
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
        positions.extend_from_slice(garment.positions);
        Ok(())
    }
}
