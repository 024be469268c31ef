//! State of an animator, which it keeps from one step to the next.

use super::{AnimatorError, StartMemory};
use crate::{
    config::StateConfig,
    model::Model,
    motion::{MotionInput, MotionState},
    replay::{Replay, ReplayState},
};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Everything that the next step depends on.
///
/// A state that is saved, serialised and restored continues with the same bytes. It can also move
/// between the CPU and a GPU.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnimatorState {
    /// Motion vectors and joint transforms of the last two frames.
    pub motion: MotionState,
    /// True until the first step after a reset.
    pub at_start: bool,
    /// Number of steps since the reset, which seeds the noise on the motion's code.
    // No default: saved states that lack it may hold positions in the frame of the first root pose,
    // which nothing reads.
    pub ticks: u64,
    /// State of the garment, one entry a vertex.
    pub vertices: Vec<VertexState>,
    /// Memory of the garment whose positions were given last.
    // No default: without it the next step would not follow from the saved state.
    pub start: StartMemory,
    /// State of the prior's recurrence; empty if the model has none.
    #[serde(default)]
    pub recurrence: Vec<f32>,
    /// State of the prior's replay; none if the model has none.
    #[serde(default)]
    pub replay: Option<ReplayState>,
    /// Offsets of the strain projection in the vertices' own frames, one entry a vertex; empty if
    /// the model has none.
    #[serde(default)]
    pub offsets: Vec<VertexState>,
}

/// State of one vertex, in metres: a position relative to the root joint, or a displacement,
/// depending on [`StateConfig`](crate::config::StateConfig). An offset of the strain projection has
/// the same form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VertexState {
    /// Value after the last step, at time t.
    pub value: Vec3,
    /// Value one step earlier, at time t − 1.
    pub previous: Vec3,
}

impl AnimatorState {
    /// Makes the state of frame 0, with all vertices at zero.
    pub fn start(model: &Model, input: &MotionInput) -> Self {
        Self {
            motion: MotionState::start(&model.config.motion, &model.character.skeleton, input),
            at_start: true,
            ticks: 0,
            vertices: vec![VertexState::default(); model.vertex_count()],
            start: StartMemory::default(),
            // The animator sets it when it evaluates the prior for the first time.
            recurrence: vec![0.0; model.prior.state_len()],
            replay: model.prior.replay.as_ref().map(Replay::start),
            offsets: vec![VertexState::default(); offset_count(model)],
        }
    }

    /// Checks that the state fits `model` and that its numbers are finite.
    ///
    /// # Errors
    /// Arrays of another length, numbers that are not finite.
    pub fn check(&self, model: &Model) -> Result<(), AnimatorError> {
        let skeleton = &model.character.skeleton;
        let wrong_motion = |e: crate::motion::MotionError| AnimatorError::State(e.to_string());
        self.motion
            .check(&model.config.motion, skeleton)
            .map_err(wrong_motion)?;
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
        if !self.start.is_usable(remembered_len(model)) {
            let text = "a memory of the start with numbers that are not usable, or of another prior";
            return Err(AnimatorError::State(text.to_owned()));
        }
        check_replay(model, self.replay.as_ref())?;
        let (expected, found) = (offset_count(model), self.offsets.len());
        if expected != found {
            let text = format!("{found} offsets of the strain projection, where it has {expected}");
            return Err(AnimatorError::State(text));
        }
        let finite = |v: &VertexState| v.value.is_finite() && v.previous.is_finite();
        let vertices = [&self.vertices, &self.offsets];
        match vertices
            .into_iter()
            .find_map(|states| states.iter().position(|v| !finite(v)))
        {
            None => Ok(()),
            Some(vertex) => Err(AnimatorError::Position { vertex }),
        }
    }
}

fn check_replay(model: &Model, state: Option<&ReplayState>) -> Result<(), AnimatorError> {
    match (&model.prior.replay, state) {
        (Some(replay), Some(state)) => replay
            .check(state)
            .map_err(|e| AnimatorError::State(e.to_string())),
        (None, None) => Ok(()),
        (Some(_), None) => Err(AnimatorError::State(
            "no replay, where the model has one".to_owned(),
        )),
        (None, Some(_)) => Err(AnimatorError::State(
            "a replay, where the model has none".to_owned(),
        )),
    }
}

/// Number of coefficients that the memory of the start holds.
fn remembered_len(model: &Model) -> usize {
    match model.config.state {
        StateConfig::RootRelative => 0,
        StateConfig::Displacement(_) => model.prior.len(),
    }
}

/// Number of offsets of the strain projection.
fn offset_count(model: &Model) -> usize {
    match model.projection {
        Some(_) => model.vertex_count(),
        None => 0,
    }
}
