//! A garment on a rig, without the engine.

use glam::{Affine3A, Vec3};
use std::sync::Arc;
use thiserror::Error;
use unic_core::{
    AnimatorError, AnimatorState, GarmentFrame, IntersectionMode, LiveGarment, Model, Pose, Surroundings,
    animator::Display,
    rig::{RigError, RigFit},
};

/// Handling of vertices that the model puts into the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BodyContact {
    /// The rule that the model was trained with: most models move these vertices out.
    #[default]
    OfModel,
    /// Vertices stay where they are, which is faster.
    Ignored,
}

/// Choices and world of a garment in a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameChoice {
    /// Garment between two ticks.
    pub display: Display,
    /// Handling of vertices inside the body.
    pub contact: BodyContact,
    /// Air, ground and teleports. The size is that of the rig in each frame.
    pub around: Surroundings,
}

/// Garment in a frame, in the size of the model.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Size of the character in the world, 1 for that of the model.
    pub size: f32,
    /// Positions in metres divided by the size, world space, one a vertex of the model.
    pub positions: &'a [Vec3],
    /// Unit normals, one a vertex of the model.
    pub normals: &'a [Vec3],
}

/// Error of a frame: the garment stays where it is.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum FrameError {
    /// A character that the model does not dress.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A pose that the model refuses.
    #[error(transparent)]
    Pose(#[from] AnimatorError),
}

/// State of a garment on a character.
#[derive(Debug)]
pub struct Garment {
    fit: RigFit,
    live: LiveGarment,
    /// Intersection handling of the model.
    intersection: IntersectionMode,
    /// Pose of this frame.
    pose: Pose,
}

impl Garment {
    /// Puts a model on a rig. It begins in the first frame.
    pub fn new(model: &Arc<Model>, fit: RigFit) -> Self {
        // The engine moves its nodes one after the other, so that a garment may have all cores.
        let live = LiveGarment::new(Arc::clone(model));
        Self {
            fit,
            intersection: live.intersection(),
            live,
            pose: model.character().skeleton.bind_pose(),
        }
    }

    /// Bone for each joint of the model; none for a tip that the rig has not.
    pub fn bones(&self) -> impl Iterator<Item = Option<usize>> + '_ {
        self.fit.sources()
    }

    /// Starts the garment anew in the next frame, as after a cut.
    pub fn restart(&mut self) {
        self.live.restart();
    }

    /// Says that frames are left out. The garment begins anew afterwards, or continues a state that
    /// has been restored meanwhile.
    pub fn interrupt(&mut self) {
        self.live.interrupt();
    }

    /// Carries the garment to the pose of the next frame in its shape, at rest.
    pub fn teleport(&mut self) {
        self.live.teleport();
    }

    /// State after the last tick; none before the first frame.
    pub fn state(&self) -> Option<&AnimatorState> {
        self.live.state()
    }

    /// Continues from a state of the same model.
    ///
    /// # Errors
    /// A state of another mesh or skeleton.
    pub fn restore(&mut self, state: AnimatorState) -> Result<(), AnimatorError> {
        self.live.restore(state)
    }

    /// Takes the pose of this frame, and as many ticks as time has passed. Returns the garment, or
    /// none if the rig has no size.
    ///
    /// `world_from_bone` has one transform for each joint of the model, as in [`RigFit::pose`].
    ///
    /// # Errors
    /// Characters and poses that the model refuses.
    pub fn advance(
        &mut self,
        world_from_bone: &[Affine3A],
        frame_s: f64,
        choice: &FrameChoice,
    ) -> Result<Option<Frame<'_>>, FrameError> {
        let model = Arc::clone(self.live.model());
        let skeleton = &model.character().skeleton;
        let size = self.fit.pose(skeleton, world_from_bone, &mut self.pose);
        let Some(size) = size.inspect_err(|_| self.live.interrupt())? else {
            self.live.interrupt();
            return Ok(None);
        };
        self.live.set_intersection(match choice.contact {
            BodyContact::OfModel => self.intersection,
            BodyContact::Ignored => IntersectionMode::Off,
        });
        let around = Surroundings {
            size,
            ..choice.around
        };
        self.live.advance(frame_s, &self.pose, &around)?;
        let GarmentFrame { positions, normals } = self.live.show(choice.display)?;
        Ok(Some(Frame {
            size,
            positions,
            normals,
        }))
    }
}
