//! The animator: one instance of a model on one character, stepped once a tick.

mod deform;
mod display;
mod error;
mod garment;
mod input;
mod intersections;
mod place;
mod scratch;
mod stage;
mod state;
mod tiles;

pub use display::Display;
pub use error::AnimatorError;
pub use input::{FARTHEST, GarmentFrame, Start, StepInput};
pub use stage::Stage;
pub use state::{AnimatorState, VertexState};

use crate::{
    collider::Collider,
    config::IntersectionMode,
    intersection::{Layers, pose_body},
    model::Model,
    network::CodeSampling,
    parallel::{Threads, install_own},
};
use glam::Vec3;
use input::check_positions;
use intersections::Intersections;
use scratch::Scratch;
use std::sync::Arc;

/// One garment in motion: a shared [`Model`], its own state and scratch memory.
///
/// Many animators share one model. [`reset`](Self::reset) at the first frame and after a cut, then
/// [`step`](Self::step) at the model's frame rate; the same inputs give the same bytes whatever the
/// number of threads.
#[derive(Clone, Debug)]
pub struct Animator {
    model: Arc<Model>,
    intersections: Intersections,
    state: AnimatorState,
    scratch: Scratch,
    code_sampling: CodeSampling,
    /// Those that it was given.
    threads: Option<Arc<dyn Threads>>,
}

impl Animator {
    /// An animator at the bind pose; call [`reset`](Self::reset) before the first step.
    pub fn new(model: Arc<Model>) -> Self {
        let bind_pose = model.character.skeleton.bind_pose();
        let input = StepInput {
            pose: &bind_pose,
            next_pose: None,
            ground_height: 0.0,
            wind: Vec3::ZERO,
        };
        let state = AnimatorState::start(&model, &input.motion(&model));
        let mut animator = Self {
            intersections: Intersections::new(model.config.intersection, &model),
            scratch: Scratch::default(),
            state,
            model,
            code_sampling: CodeSampling::default(),
            threads: None,
        };
        animator.refresh();
        animator
    }

    /// The shared asset.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Intersection handling in force: the model's own, unless replaced.
    pub fn intersection(&self) -> IntersectionMode {
        self.intersections.mode()
    }

    /// Replaces the model's intersection handling from the next frame on; kept over resets. `mode`
    /// passes [`IntersectionMode::check`].
    pub fn set_intersection(&mut self, mode: IntersectionMode) {
        if mode != self.intersections.mode() {
            self.intersections.in_mode(mode, &self.model);
        }
    }

    /// How the categories of the motion's code are picked from the next step on; kept over resets.
    /// [`CodeSampling::Largest`] unless replaced.
    pub fn set_code_sampling(&mut self, sampling: CodeSampling) {
        self.code_sampling = sampling;
    }

    /// Steps on these threads from now on, to the same bytes as on any others: an engine's own, see
    /// [`parallel`](crate::parallel).
    ///
    /// Many animators may share them. What one that is given none steps on is [installed](crate::parallel::install)
    /// around the call, or the default.
    pub fn set_threads(&mut self, threads: Arc<dyn Threads>) {
        self.threads = Some(threads);
    }

    /// Ground and props that shown garments stay out of from the next frame on, world space, metres; kept
    /// over resets. [`IntersectionMode::Robust`] alone looks at them, after the body.
    ///
    /// ```
    /// # use glam::Vec3;
    /// # use unic_core::{animator::Animator, collider::Collider};
    /// # fn every_frame(animator: &mut Animator, hand: Vec3) {
    /// animator.set_colliders([Collider::ground(0.0), Collider::sphere(0.12, hand)]);
    /// // Or, when they are there already:
    /// animator.colliders_mut()[1].world_from_collider.translation = hand;
    /// # }
    /// ```
    pub fn set_colliders(&mut self, colliders: impl IntoIterator<Item = Collider>) {
        self.intersections.colliders.clear();
        self.intersections.colliders.extend(colliders);
    }

    /// The ground and the props, to be moved: a collider that moves is placed anew before every step.
    pub fn colliders_mut(&mut self) -> &mut [Collider] {
        &mut self.intersections.colliders
    }

    /// Keeps layers of the shown garment in order from the next frame on; kept over resets.
    /// [`IntersectionMode::Robust`] alone does. The layers are those of this model's garment.
    ///
    /// # Errors
    /// Layers of another mesh.
    pub fn set_layers(&mut self, layers: Layers) -> Result<(), AnimatorError> {
        let (expected, found) = (self.model.vertex_count(), layers.of_vertices().len());
        if expected != found {
            return Err(AnimatorError::Vertices { expected, found });
        }
        self.intersections.set_layers(layers);
        Ok(())
    }

    /// Frame 0 of a sequence, or the frame after a cut.
    ///
    /// # Errors
    /// A pose of another skeleton, positions of another mesh, numbers that are not finite; the
    /// state stays as it was.
    pub fn reset(&mut self, input: &StepInput, start: Start) -> Result<GarmentFrame<'_>, AnimatorError> {
        input.check(&self.model)?;
        start.check(&self.model)?;
        install_own(self.threads.clone(), || self.begin(input, start));
        Ok(self.garment())
    }

    fn begin(&mut self, input: &StepInput, start: Start) {
        self.state = AnimatorState::start(&self.model, &input.motion(&self.model));
        self.refresh();
        match start {
            Start::Positions(positions) => self.place(positions),
            Start::MeanShape => self.place_mean_shape(),
        }
        for vertex in &mut self.state.vertices {
            vertex.previous = vertex.value;
        }
        self.finish();
    }

    /// One tick of 1 / fps seconds to a new pose.
    ///
    /// # Errors
    /// A pose of another skeleton, with numbers that are not finite or farther than 1000 km from the
    /// origin; the state stays as it was.
    pub fn step(&mut self, input: &StepInput) -> Result<GarmentFrame<'_>, AnimatorError> {
        self.step_observed(input, &mut |_| ())
    }

    /// As [`step`](Self::step); `observe` is called after each part of it, after some of them twice.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn step_observed(
        &mut self,
        input: &StepInput,
        observe: &mut dyn FnMut(Stage),
    ) -> Result<GarmentFrame<'_>, AnimatorError> {
        input.check(&self.model)?;
        install_own(self.threads.clone(), || self.advance(input, observe));
        Ok(self.garment())
    }

    fn advance(&mut self, input: &StepInput, observe: &mut dyn FnMut(Stage)) {
        let model = &self.model;
        let (spec, skeleton) = (&model.config.motion, &model.character.skeleton);
        self.state.motion.advance(spec, skeleton, &input.motion(model));
        self.state.ticks += 1;
        observe(Stage::Motion);
        self.carry();
        observe(Stage::Skinning);
        if self.state.at_start {
            self.complete_start();
        }
        self.encode();
        observe(Stage::Encoder);
        self.deform(input.wind);
        observe(Stage::Field);
        self.correct_state();
        observe(Stage::Intersections);
        self.finish_observed(observe);
    }

    /// Replaces the garment at the current frame by given world positions in metres: teacher forcing, or
    /// a hand-over from a simulation.
    ///
    /// The garment of the frame before stays, and velocities are differences to it: called after
    /// every step, the next one sees given positions alone; called once, the jump counts as motion.
    ///
    /// # Errors
    /// Positions of another mesh or that are not finite; the state stays as it was.
    pub fn set_garment(&mut self, positions: &[Vec3]) -> Result<(), AnimatorError> {
        check_positions(&self.model, positions)?;
        install_own(self.threads.clone(), || {
            self.place(positions);
            self.finish();
        });
        Ok(())
    }

    /// The garment as it is.
    pub fn garment(&self) -> GarmentFrame<'_> {
        GarmentFrame {
            positions: &self.scratch.positions,
            normals: &self.scratch.normals,
        }
    }

    /// Everything that the next step depends on; save and restore it at will.
    pub fn state(&self) -> &AnimatorState {
        &self.state
    }

    /// Goes on from a saved state, to the same bytes as if nothing had happened.
    ///
    /// # Errors
    /// A state of another model; the current state stays.
    pub fn restore(&mut self, state: AnimatorState) -> Result<GarmentFrame<'_>, AnimatorError> {
        state.check(&self.model)?;
        self.state = state;
        install_own(self.threads.clone(), || {
            self.refresh();
            self.finish();
        });
        Ok(self.garment())
    }

    /// World positions of the body's vertices in the current pose.
    pub fn body(&self, positions: &mut Vec<Vec3>) {
        install_own(self.threads.clone(), || {
            pose_body(&self.model.character, &self.scratch.world_from_rest, positions);
        });
    }
}
