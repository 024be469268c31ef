//! Interface of everything that is evaluated: predictors of garment positions.

use crate::kinematics::PreparedClip;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::error::Error;

/// Start of each prediction in a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Every frame is predicted from the true previous frame (teacher forcing).
    OneStep,
    /// Frame 0 is true. Every other frame is predicted from the prediction before it.
    FreeRunning,
}

impl Mode {
    /// Returns the name of the mode in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::OneStep => "one_step",
            Self::FreeRunning => "free_running",
        }
    }
}

/// Error of a predictor or an observer.
pub type PredictorError = Box<dyn Error + Send + Sync>;

/// Predicts garment positions frame by frame: a baseline, or a model with its animator.
///
/// The evaluation calls [`start`](Self::start) on a clip and then [`predict`](Self::predict) for
/// the frames 1, 2, ... in order. One frame at a time keeps memory independent of the length of
/// clips.
pub trait Predictor: Send {
    /// Returns the modes that differ. A predictor without state has only one.
    fn modes(&self) -> &[Mode];

    /// Starts a clip and forgets the one before. Frame 0 of the true garment is known.
    ///
    /// # Errors
    /// A clip that does not fit the predictor, such as one of another skeleton or garment.
    fn start(&mut self, clip: &PreparedClip, mode: Mode) -> Result<(), PredictorError>;

    /// Writes the world positions of the garment in frame `frame`, metres, into `positions`.
    ///
    /// In [`Mode::OneStep`] it may read frame `frame` − 1 of the true garment. In
    /// [`Mode::FreeRunning`] it may read only frame 0.
    ///
    /// # Errors
    /// A clip that does not fit the predictor.
    fn predict(
        &mut self,
        clip: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError>;
}

/// Name of the model under evaluation, among the predictors of an evaluation.
pub const MODEL: &str = "model";

/// Name of a displacement model's prior without the field; the first of the baselines.
pub const PRIOR: &str = "prior";

/// Name of a second simulation of the evaluated motions with another history, among the baselines.
pub const CONTROL: &str = "control";

/// Predictor with its name in tables and JSON.
pub struct NamedPredictor {
    /// Name of the row in tables and key in JSON: [`MODEL`], or the name of a baseline.
    pub name: String,
    /// Predictor that is measured.
    pub predictor: Box<dyn Predictor>,
}

impl NamedPredictor {
    /// Wraps the model under evaluation.
    pub fn model(predictor: impl Predictor + 'static) -> Self {
        Self::baseline(MODEL, predictor)
    }

    /// Wraps a predictor that the model is compared with.
    pub fn baseline(name: &str, predictor: impl Predictor + 'static) -> Self {
        Self {
            name: name.to_owned(),
            predictor: Box::new(predictor),
        }
    }
}
