//! What goes into an animator and what comes out.

use super::AnimatorError;
use crate::{clip::Clip, model::Model, motion::MotionInput, skeleton::Pose};
use glam::Vec3;

/// Poses and grounds farther than this from the origin are refused, metres: f32 places nothing there
/// to better than 6 cm, and much farther off velocities overflow.
pub const FARTHEST: f32 = 1e6;

/// What one tick brings.
#[derive(Clone, Copy, Debug)]
pub struct StepInput<'a> {
    /// Pose of this frame, in world space.
    pub pose: &'a Pose,
    /// Pose of the next frame where it is known (offline): only models with forward velocities, the
    /// paper's, look at it, and take the backward difference without it.
    pub next_pose: Option<&'a Pose>,
    /// Height of the ground under the character, metres, world space.
    pub ground_height: f32,
    /// Velocity of the air around the character, m/s, world space; zero in still air.
    pub wind: Vec3,
}

impl<'a> StepInput<'a> {
    /// A frame of a clip, whose next pose is known.
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

/// What the garment is before the first step.
#[derive(Clone, Copy, Debug)]
pub enum Start<'a> {
    /// The mean shape seen in training, carried by the skeleton (the rest shape where the model has none).
    MeanShape,
    /// World positions in metres, one a garment vertex: from a simulation or a cache.
    Positions(&'a [Vec3]),
}

/// The garment after a step: borrowed from the animator, so that nothing is copied.
#[derive(Clone, Copy, Debug)]
pub struct GarmentFrame<'a> {
    /// World positions, metres, one a vertex of the model's mesh.
    pub positions: &'a [Vec3],
    /// Unit normals, area-weighted.
    pub normals: &'a [Vec3],
}

impl<'a> StepInput<'a> {
    /// What the motion vector of a model is made from.
    pub fn motion(&self, model: &Model) -> MotionInput<'a> {
        MotionInput {
            pose: self.pose,
            next_pose: self.next_pose,
            ground_height: self.ground_height,
            dt: 1.0 / model.config.fps,
            wind: self.wind,
        }
    }

    /// Are the poses of this model's skeleton, and usable numbers?
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
        match numbers.iter().all(|x| *x <= FARTHEST) && self.wind.is_finite() {
            true => Ok(()),
            false => Err(AnimatorError::Pose),
        }
    }
}

impl Start<'_> {
    /// Does it suit this model?
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

/// Is there one finite position for every vertex of this model's mesh?
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
