//! A garment in motion, without the engine: ticks at the model's rate, frames at the display's.

use crate::rig::Rig;
use glam::Vec3;
use std::sync::Arc;
use unic_core::{
    Animator, AnimatorError, AnimatorState, GarmentFrame, IntersectionMode, Model, Pose, Start, StepInput,
    TickClock, TickInterpolator, transform::Rigid,
};

/// Most ticks in one frame. A program that stops for seconds would otherwise step through them all.
const MOST_TICKS: u32 = 4;

/// Pictures between two ticks of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Picture {
    /// The cloth is interpolated on the pose of each frame, up to a tick behind.
    #[default]
    Interpolated,
    /// The cloth moves with the ticks alone.
    Tick,
}

/// Handling of vertices that the model puts into the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BodyContact {
    /// The rule that the model was trained with: most models move these vertices out.
    #[default]
    OfModel,
    /// Vertices stay where they are, which is faster.
    Ignored,
}

/// World of a garment in a frame.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// Pictures between two ticks.
    pub picture: Picture,
    /// Handling of vertices inside the body.
    pub contact: BodyContact,
    /// Velocity of the air, m/s.
    pub wind: Vec3,
    /// Height of the ground, metres.
    pub ground_height: f32,
    /// Movement of the root within a frame that is a teleport, metres.
    pub teleport_m: f32,
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

/// Way in which the next frame goes on from the last one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Next {
    /// Time passes.
    Step,
    /// Time passes, after a state has been restored: where the character was before is unknown.
    Resume,
    /// The garment starts anew, in the mean shape of training.
    Restart,
    /// The garment is carried to the new pose in its shape, at rest.
    Teleport,
}

/// State of a garment on a character.
#[derive(Debug)]
pub struct Garment {
    rig: Rig,
    animator: Animator,
    interpolator: TickInterpolator,
    /// Intersection handling of the model.
    intersection: IntersectionMode,
    next: Next,
    clock: TickClock,
    /// Poses of the last and of this frame.
    before: Pose,
    now: Pose,
    /// Size of the character in the world, 1 for that of the model.
    size: f32,
}

impl Garment {
    /// Puts a model on a rig. It begins in the first frame.
    pub fn new(model: &Arc<Model>, rig: Rig) -> Self {
        let pose = model.character().skeleton.bind_pose();
        // The engine moves its nodes one after the other, so that a garment may have all cores.
        let animator = Animator::new(Arc::clone(model));
        Self {
            rig,
            intersection: animator.intersection(),
            animator,
            interpolator: TickInterpolator::default(),
            next: Next::Restart,
            clock: TickClock::new(model.config().fps),
            before: pose.clone(),
            now: pose,
            size: 1.0,
        }
    }

    /// Bone for each joint of the model; none for a tip that the rig has not.
    pub fn bones(&self) -> impl Iterator<Item = Option<usize>> + '_ {
        self.rig.bones()
    }

    /// Starts the garment anew in the next frame, as after a cut.
    pub fn restart(&mut self) {
        self.next = Next::Restart;
    }

    /// Carries the garment to the pose of the next frame in its shape, at rest.
    pub fn teleport(&mut self) {
        if self.next == Next::Step {
            self.next = Next::Teleport;
        }
    }

    /// State after the last tick; none before the first frame.
    pub fn state(&self) -> Option<&AnimatorState> {
        (self.next != Next::Restart).then(|| self.animator.state())
    }

    /// Continues from a state of the same model.
    ///
    /// # Errors
    /// A state of another mesh or skeleton.
    pub fn restore(&mut self, state: AnimatorState) -> Result<(), AnimatorError> {
        self.animator.restore(state)?;
        self.interpolator.cut(&self.animator);
        self.next = Next::Resume;
        self.clock.restart();
        Ok(())
    }

    /// Takes the pose of this frame, and as many ticks as time has passed. Returns the garment, or
    /// none if the rig has no size.
    ///
    /// `world_from_bone` has one transform for each joint of the model, as in [`Rig::pose`].
    ///
    /// # Errors
    /// Poses that the model refuses.
    pub fn advance(
        &mut self,
        world_from_bone: &[Rigid],
        frame_s: f64,
        around: &Surroundings,
    ) -> Result<Option<Frame<'_>>, AnimatorError> {
        std::mem::swap(&mut self.before, &mut self.now);
        let model = Arc::clone(self.animator.model());
        let skeleton = &model.character().skeleton;
        let Some(size) = self.rig.pose(skeleton, world_from_bone, &mut self.now) else {
            self.next = Next::Restart;
            return Ok(None);
        };
        self.size = size;
        if self.now.trans.distance(self.before.trans) * size > around.teleport_m {
            self.teleport();
        }
        self.animator.set_intersection(match around.contact {
            BodyContact::OfModel => self.intersection,
            BodyContact::Ignored => IntersectionMode::Off,
        });
        match self.next {
            Next::Step => self.tick(around, frame_s)?,
            Next::Resume => {
                self.before.clone_from(&self.now);
                self.next = Next::Step;
                self.tick(around, frame_s)?;
            }
            Next::Restart => self.begin(around, Start::MeanShape)?,
            Next::Teleport => self.carry(around)?,
        }
        let GarmentFrame { positions, normals } = self.show(around.picture)?;
        Ok(Some(Frame {
            size,
            positions,
            normals,
        }))
    }

    /// Begins at the pose of this frame with the folds of the last one.
    fn carry(&mut self, around: &Surroundings) -> Result<(), AnimatorError> {
        let carried = self.interpolator.show(&self.animator, &self.now, 1.0)?;
        let carried = carried.positions.to_vec();
        // The carried vertices have been corrected already, and twice is too much.
        let intersection = self.animator.intersection();
        self.animator.set_intersection(IntersectionMode::Off);
        let begun = self.begin(around, Start::Positions(&carried));
        self.animator.set_intersection(intersection);
        begun
    }

    fn begin(&mut self, around: &Surroundings, start: Start<'_>) -> Result<(), AnimatorError> {
        let input = input(&self.now, around, self.size);
        self.animator.reset(&input, start)?;
        self.interpolator.cut(&self.animator);
        self.next = Next::Step;
        self.clock.restart();
        Ok(())
    }

    fn tick(&mut self, around: &Surroundings, frame_s: f64) -> Result<(), AnimatorError> {
        self.clock.advance(frame_s, MOST_TICKS);
        while let Some(moment) = self.clock.take() {
            // Poses of ticks within a frame lie between those of two frames.
            let between = (moment < 1.0).then(|| self.before.interpolate(&self.now, moment));
            let pose = between.as_ref().unwrap_or(&self.now);
            self.animator.step(&input(pose, around, self.size))?;
            self.interpolator.tick(&self.animator);
        }
        Ok(())
    }

    fn show(&mut self, picture: Picture) -> Result<GarmentFrame<'_>, AnimatorError> {
        match picture {
            Picture::Tick => Ok(self.animator.garment()),
            Picture::Interpolated => {
                let share = self.clock.share();
                self.interpolator.show(&self.animator, &self.now, share)
            }
        }
    }
}

fn input<'a>(pose: &'a Pose, around: &Surroundings, size: f32) -> StepInput<'a> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: around.ground_height / size,
        wind: around.wind / size,
    }
}
