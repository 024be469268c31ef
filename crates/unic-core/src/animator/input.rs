//! Inputs and outputs of an animator.

use super::AnimatorError;
use crate::{clip::Clip, model::Model, motion::MotionInput, skeleton::Pose};
use glam::Vec3;

/// Largest coordinate of a pose or height of the ground that an animator accepts, metres.
///
/// At this distance f32 resolves 6 cm, and farther away velocities overflow.
pub const FARTHEST: f32 = 1e6;

/// Input of one tick.
#[derive(Clone, Copy, Debug)]
pub struct StepInput<'a> {
    /// Pose of this frame, in world space.
    pub pose: &'a Pose,
    /// Pose of the next frame, where it is known. Only models with forward velocities (preset
    /// `paper`) read it; without it they take backward differences.
    pub next_pose: Option<&'a Pose>,
    /// Height of the ground under the character, in metres, in world space.
    pub ground_height: f32,
    /// Velocity of the air around the character, in m/s, in world space; zero in still air.
    pub wind: Vec3,
}

impl<'a> StepInput<'a> {
    /// Makes the input of a frame of a clip, with the next pose if there is one.
    ///
    /// # Panics
    /// When the clip has no such frame.
    pub fn of_clip(clip: &'a Clip, frame: usize) -> Self {
        Self {
            pose: &clip.poses[frame],
            next_pose: clip.poses.get(frame + 1),
            ground_height: clip.ground_height,
            wind: clip.wind_at(frame),
        }
    }
}

/// Garment of frame 0, before the first step.
#[derive(Clone, Copy, Debug)]
pub enum Start<'a> {
    /// The mean displacement of training, skinned to the pose. Models without one start from the
    /// skinned rest shape.
    MeanShape,
    /// World positions in metres, one a garment vertex, from a simulation or a cache.
    Positions(&'a [Vec3]),
}

/// Garment after a step, borrowed from the animator so that nothing is copied.
#[derive(Clone, Copy, Debug)]
pub struct GarmentFrame<'a> {
    /// World positions in metres, one a vertex of the model's mesh.
    pub positions: &'a [Vec3],
    /// Unit normals, one a vertex, averaged over its faces by area.
    pub normals: &'a [Vec3],
}

impl<'a> StepInput<'a> {
    /// Converts to the input of the motion vector, with the tick of `model`.
    pub fn motion(&self, model: &Model) -> MotionInput<'a> {
        MotionInput {
            pose: self.pose,
            next_pose: self.next_pose,
            ground_height: self.ground_height,
            dt: 1.0 / model.config.fps,
            wind: self.wind,
        }
    }

    /// Checks that the poses are of the model's skeleton and that all numbers are usable.
    ///
    /// # Errors
    /// A pose of another skeleton, numbers that are not finite or beyond [`FARTHEST`].
    pub fn check(&self, model: &Model) -> Result<(), AnimatorError> {
        let expected = model.character.skeleton.len();
        for pose in [Some(self.pose), self.next_pose].into_iter().flatten() {
            let found = pose.local.len();
            if found != expected {
                return Err(AnimatorError::Joints { expected, found });
            }
            if !pose.is_valid() || pose.trans.abs().max_element() > FARTHEST {
                return Err(AnimatorError::Pose);
            }
        }
        let numbers = [self.ground_height.abs(), self.wind.abs().max_element()];
        // The maximum of a vector's elements may hide a NaN.
        match numbers.iter().all(|x| *x <= FARTHEST) && self.wind.is_finite() {
            true => Ok(()),
            false => Err(AnimatorError::Pose),
        }
    }
}

impl Start<'_> {
    /// Checks that given positions are finite and as many as the model's vertices.
    ///
    /// # Errors
    /// Positions of another mesh or that are not finite.
    pub fn check(&self, model: &Model) -> Result<(), AnimatorError> {
        match self {
            Self::MeanShape => Ok(()),
            Self::Positions(positions) => check_positions(model, positions),
        }
    }
}

/// Checks that there is one finite position for every vertex of the model's mesh.
pub(super) fn check_positions(model: &Model, positions: &[Vec3]) -> Result<(), AnimatorError> {
    let (expected, found) = (model.vertex_count(), positions.len());
    if expected != found {
        return Err(AnimatorError::Vertices { expected, found });
    }
    match positions.iter().position(|p| !p.is_finite()) {
        None => Ok(()),
        Some(vertex) => Err(AnimatorError::Position { vertex }),
    }
}
