//! What an animator remembers from one step to the next.

use super::AnimatorError;
use crate::{
    model::Model,
    motion::{MotionInput, MotionState},
};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Everything that the next step depends on; serialise it to save a game or to cut a clip, or go on with it
/// on another device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnimatorState {
    /// Of the skeleton.
    pub motion: MotionState,
    /// Has no step been taken since the reset?
    pub at_start: bool,
    /// Steps since the reset: noise on the motion's code is drawn by it.
    // Without a default: saved states that lack it may hold positions with the distance travelled.
    pub ticks: u64,
    /// Of the garment, one a vertex.
    pub vertices: Vec<VertexState>,
    /// Of the prior's recurrence; empty without one.
    #[serde(default)]
    pub recurrence: Vec<f32>,
}

/// State of one vertex: a position relative to the root joint, or a displacement, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VertexState {
    /// At t.
    pub value: Vec3,
    /// At t − 1.
    pub previous: Vec3,
}

impl AnimatorState {
    /// Frame 0, before the garment is placed.
    pub fn start(model: &Model, input: &MotionInput) -> Self {
        Self {
            motion: MotionState::start(&model.config.motion, &model.character.skeleton, input),
            at_start: true,
            ticks: 0,
            vertices: vec![VertexState::default(); model.vertex_count()],
            // At rest; the first look at the motion starts it.
            recurrence: vec![0.0; model.prior.state_len()],
        }
    }

    /// Does a state that comes from elsewhere belong to this model, and is it made of numbers?
    ///
    /// # Errors
    /// Arrays of another length, numbers that are not finite.
    pub fn check(&self, model: &Model) -> Result<(), AnimatorError> {
        let skeleton = &model.character.skeleton;
        let other = |e: crate::motion::MotionError| AnimatorError::State(e.to_string());
        self.motion.check(skeleton).map_err(other)?;
        let (expected, found) = (model.vertex_count(), self.vertices.len());
        if expected != found {
            return Err(AnimatorError::Vertices { expected, found });
        }
        let (expected, found) = (model.prior.state_len(), self.recurrence.len());
        if expected != found {
            let text = format!("{found} numbers of the prior's recurrence, where it has {expected}");
            return Err(AnimatorError::State(text));
        }
        if self.recurrence.iter().any(|h| !h.is_finite()) {
            let text = "numbers of the prior's recurrence that are not finite";
            return Err(AnimatorError::State(text.to_owned()));
        }
        let finite = |v: &VertexState| v.value.is_finite() && v.previous.is_finite();
        match self.vertices.iter().position(|v| !finite(v)) {
            None => Ok(()),
            Some(vertex) => Err(AnimatorError::Position { vertex }),
        }
    }
}
