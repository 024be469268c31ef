//! A garment on a live character: ticks at the model's rate within frames of any rate.

use super::{
    Animator, AnimatorError, AnimatorState, Display, GarmentFrame, Start, StepInput, Surroundings, TickClock,
    TickInterpolator,
};
use crate::{
    collider::Collider, config::IntersectionMode, intersection::Layers, model::Model, parallel::Threads,
    skeleton::Pose,
};
use std::sync::Arc;

/// Garment on a live character, which an engine moves once a frame.
///
/// It holds an [`Animator`], whose ticks come at the model's rate, a [`TickClock`] that says in which
/// frames they are due, and a [`TickInterpolator`] for the frames between them. A frame is two calls:
/// [`advance`](Self::advance) takes the pose, and [`show`](Self::show) returns the vertices.
///
/// The first frame begins at rest in the mean shape of training, as does the one after
/// [`restart`](Self::restart) or an error. A character that is
/// [teleported](super::TeleportLimit) takes its cloth along: the cloth keeps its folds, and is at
/// rest.
///
/// Poses are in the size of the model: an engine divides positions by the
/// [size](Surroundings::size) of its character, and multiplies those of the vertices by it.
///
/// ```
/// # use std::sync::Arc;
/// use unic_core::{LiveGarment, Model, Surroundings, animator::Display};
/// # mod tour { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/tour_model.rs")); }
/// # let model = Arc::new(Model::from_bytes(&tour::file()?)?);
///
/// let mut garment = LiveGarment::new(model.clone());
/// let mut pose = model.character().skeleton.bind_pose();
/// for _frame in 0..3 {
///     pose.trans.z += 0.01;
///     garment.advance(1.0 / 60.0, &pose, &Surroundings::default())?;
///     let shown = garment.show(Display::Interpolated)?;
///     assert_eq!(shown.positions.len(), model.vertex_count());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct LiveGarment {
    animator: Animator,
    interpolator: TickInterpolator,
    clock: TickClock,
    next: Next,
    /// Pose of the last frame.
    before: Pose,
    /// Pose of this frame.
    now: Pose,
}

/// Way in which the next frame goes on from the last one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Next {
    /// Time passes.
    Step,
    /// Time passes, after a state has been restored: where the character was before is unknown.
    Resume,
    /// The garment begins in the mean shape of training.
    Restart,
    /// The garment is carried to the new pose in its shape, at rest.
    Carry,
}

impl LiveGarment {
    /// Most ticks in one frame. A program that stops for seconds would otherwise step through them
    /// all.
    pub const MOST_TICKS: u32 = 4;

    /// Puts on a model. The garment begins in the first frame.
    pub fn new(model: Arc<Model>) -> Self {
        let pose = model.character().skeleton.bind_pose();
        Self {
            clock: TickClock::new(model.config().fps),
            animator: Animator::new(model),
            interpolator: TickInterpolator::default(),
            next: Next::Restart,
            before: pose.clone(),
            now: pose,
        }
    }

    /// The shared model.
    pub fn model(&self) -> &Arc<Model> {
        self.animator.model()
    }

    /// The animator, to be read.
    pub fn animator(&self) -> &Animator {
        &self.animator
    }

    /// Begins anew in the next frame, as after a cut: in the mean shape of training, at rest.
    pub fn restart(&mut self) {
        self.next = Next::Restart;
    }

    /// Carries the garment to the pose of the next frame in its shape, at rest.
    ///
    /// [`advance`](Self::advance) does so itself for movements beyond the
    /// [limit](Surroundings::teleports). A garment that begins in the next frame, or continues a
    /// restored state, has no shape to carry: it does that.
    pub fn teleport(&mut self) {
        if self.next == Next::Step {
            self.next = Next::Carry;
        }
    }

    /// Says that frames are left out, as in a pause or while the character is hidden. The garment
    /// begins anew afterwards, or continues a state that has been restored meanwhile.
    pub fn interrupt(&mut self) {
        if self.next != Next::Resume {
            self.next = Next::Restart;
        }
    }

    /// State after the last tick, to be saved; none before the first frame.
    pub fn state(&self) -> Option<&AnimatorState> {
        (self.next != Next::Restart).then(|| self.animator.state())
    }

    /// Continues from a saved state in the next frame, wherever the character is then.
    ///
    /// # Errors
    /// A state of another model. The garment goes on as before.
    pub fn restore(&mut self, state: AnimatorState) -> Result<(), AnimatorError> {
        self.animator.restore(state)?;
        self.interpolator.cut(&self.animator);
        self.clock.restart();
        self.next = Next::Resume;
        Ok(())
    }

    /// Takes the pose of this frame, and as many ticks as time has passed, at most
    /// [`MOST_TICKS`](Self::MOST_TICKS).
    ///
    /// `frame_s` are the seconds since the last frame. `pose` is in world space, its translation
    /// divided by the [size](Surroundings::size) of the character.
    ///
    /// # Errors
    /// Poses and surroundings that the model refuses. The garment begins anew in the next frame.
    pub fn advance(&mut self, frame_s: f64, pose: &Pose, around: &Surroundings) -> Result<(), AnimatorError> {
        std::mem::swap(&mut self.before, &mut self.now);
        self.now.clone_from(pose);
        let moved_m = self.now.trans.distance(self.before.trans) * around.size;
        if around.teleports.is_exceeded(moved_m, frame_s) {
            self.teleport();
        }
        // An error leaves a frame without its ticks.
        match std::mem::replace(&mut self.next, Next::Restart) {
            Next::Step => self.tick(frame_s, around)?,
            Next::Resume => {
                self.before.clone_from(&self.now);
                self.tick(frame_s, around)?;
            }
            Next::Restart => self.begin(Start::MeanShape, around)?,
            Next::Carry => self.carry(around)?,
        }
        self.next = Next::Step;
        Ok(())
    }

    /// Garment in this frame, in the size of the model.
    ///
    /// # Errors
    /// [`Display::Interpolated`] before the first frame, or after one with an error.
    pub fn show(&mut self, display: Display) -> Result<GarmentFrame<'_>, AnimatorError> {
        match display {
            Display::Ticks => Ok(self.animator.garment()),
            Display::Interpolated => {
                let share = self.clock.share();
                self.interpolator.show(&self.animator, &self.now, share)
            }
        }
    }

    /// Intersection handling in force.
    pub fn intersection(&self) -> IntersectionMode {
        self.animator.intersection()
    }

    /// Replaces the intersection handling, as [`Animator::set_intersection`] does.
    pub fn set_intersection(&mut self, mode: IntersectionMode) {
        self.animator.set_intersection(mode);
    }

    /// Sets ground and props in the size of the model, as [`Animator::set_colliders`] does.
    pub fn set_colliders(&mut self, colliders: impl IntoIterator<Item = Collider>) {
        self.animator.set_colliders(colliders);
    }

    /// Sets the layers of the garment, as [`Animator::set_layers`] does.
    ///
    /// # Errors
    /// Layers of another mesh.
    pub fn set_layers(&mut self, layers: Layers) -> Result<(), AnimatorError> {
        self.animator.set_layers(layers)
    }

    /// Sets the threads of all later calls, as [`Animator::set_threads`] does.
    pub fn set_threads(&mut self, threads: Arc<dyn Threads>) {
        self.animator.set_threads(threads);
    }

    /// Begins at the pose of this frame with the folds of the last one.
    fn carry(&mut self, around: &Surroundings) -> Result<(), AnimatorError> {
        let carried = self.interpolator.show(&self.animator, &self.now, 1.0)?;
        let carried = carried.positions.to_vec();
        // The carried vertices have been corrected already, and twice is too much.
        let intersection = self.animator.intersection();
        self.animator.set_intersection(IntersectionMode::Off);
        let begun = self.begin(Start::Positions(&carried), around);
        self.animator.set_intersection(intersection);
        // Folds of another motion are forgotten also by a character that stands.
        self.animator.state.start.let_fade();
        begun
    }

    fn begin(&mut self, start: Start<'_>, around: &Surroundings) -> Result<(), AnimatorError> {
        self.animator.reset(&input(&self.now, around), start)?;
        self.interpolator.cut(&self.animator);
        self.clock.restart();
        Ok(())
    }

    fn tick(&mut self, frame_s: f64, around: &Surroundings) -> Result<(), AnimatorError> {
        self.clock.advance(frame_s, Self::MOST_TICKS);
        while let Some(moment) = self.clock.take() {
            // Poses of ticks within a frame lie between those of two frames.
            let between = (moment < 1.0).then(|| self.before.interpolate(&self.now, moment));
            let pose = between.as_ref().unwrap_or(&self.now);
            self.animator.step(&input(pose, around))?;
            self.interpolator.tick(&self.animator);
        }
        Ok(())
    }
}

/// Input of a tick, in the size of the model.
fn input<'a>(pose: &'a Pose, around: &Surroundings) -> StepInput<'a> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: around.ground_height / around.size,
        wind: around.wind / around.size,
    }
}
