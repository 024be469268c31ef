//! What is evaluated: anything that says where the garment is.

use crate::kinematics::PreparedClip;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::error::Error;

/// Where each prediction of a clip starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Every frame starts from the true previous frame (teacher forcing).
    OneStep,
    /// Frame 0 is true, every other frame starts from the prediction before it.
    FreeRunning,
}

impl Mode {
    /// As in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::OneStep => "one_step",
            Self::FreeRunning => "free_running",
        }
    }
}

/// Why a predictor cannot go on.
pub type PredictorError = Box<dyn Error + Send + Sync>;

/// Gives garment positions, frame by frame: a baseline, or a model with its animator.
///
/// The evaluation calls [`start`](Self::start) on a clip and then [`predict`](Self::predict) for
/// the frames 1, 2, ... in order. Asking for frames, rather than handing over whole clips, keeps
/// memory independent of their length.
pub trait Predictor: Send {
    /// The modes that make sense: a predictor without state has one.
    fn modes(&self) -> &[Mode];

    /// Forgets the previous clip; frame 0 of the garment is known.
    ///
    /// # Errors
    /// The clip does not fit the predictor: another skeleton, another garment, ...
    fn start(&mut self, clip: &PreparedClip, mode: Mode) -> Result<(), PredictorError>;

    /// Writes the garment's world positions of frame `frame`, metres, into `positions`.
    ///
    /// In [`Mode::OneStep`] frame `frame` − 1 of the clip's garment may be read, in
    /// [`Mode::FreeRunning`] only frame 0.
    ///
    /// # Errors
    /// As [`start`](Self::start).
    fn predict(
        &mut self,
        clip: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError>;
}
