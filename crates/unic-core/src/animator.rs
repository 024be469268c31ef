//! The animator: one garment in motion, stepped once a tick.
//!
//! For engines. The crate's root re-exports the names that they need; [`Stage`] is for
//! measurements, [`VertexState`] for other implementations of a step, such as one on a GPU.

mod deform;
mod error;
mod garment;
mod input;
mod intersections;
mod live_garment;
mod saved;
mod scratch;
mod stage;
mod start_memory;
mod state;
mod state_frames;
mod surroundings;
mod tick_clock;
mod tick_interpolator;
mod tiles;

pub use error::AnimatorError;
pub use input::{FARTHEST, GarmentFrame, Start, StepInput};
pub use live_garment::LiveGarment;
pub use saved::SavedStateError;
pub use stage::Stage;
pub use start_memory::{Keeping, LEAST_SHARE, NEVER_GIVEN_M, Origin, StartMemory, component_sizes};
pub use state::{AnimatorState, VertexState};
pub use surroundings::{Display, Surroundings, TeleportLimit};
pub use tick_clock::TickClock;
pub use tick_interpolator::TickInterpolator;

use crate::{
    collider::Collider,
    config::IntersectionMode,
    intersection::{Layers, pose_body},
    model::Model,
    network::CodeSampling,
    parallel::{Threads, install_if_some},
    projection::Memory,
};
use glam::Vec3;
use input::check_positions;
use intersections::Intersections;
use scratch::Scratch;
use std::sync::Arc;

/// One garment in motion: a shared [`Model`] with its own state and scratch memory.
///
/// Many animators can share one model. [`reset`](Self::reset) the animator at the first frame and
/// after every cut, then [`step`](Self::step) it at the model's frame rate. The same inputs give
/// the same bytes for any number of threads.
#[derive(Clone, Debug)]
pub struct Animator {
    model: Arc<Model>,
    intersections: Intersections,
    state: AnimatorState,
    scratch: Scratch,
    code_sampling: CodeSampling,
    /// Threads of [`set_threads`](Self::set_threads).
    threads: Option<Arc<dyn Threads>>,
}

impl Animator {
    /// Makes an animator at the bind pose; call [`reset`](Self::reset) before the first step.
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
        // A step without a reset starts from the bind pose.
        animator.rebuild_scratch();
        animator.begin_memory(Origin::MeanShape);
        animator
    }

    /// The shared model.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Intersection handling in force: the model's own unless it was replaced.
    pub fn intersection(&self) -> IntersectionMode {
        self.intersections.mode()
    }

    /// Replaces the intersection handling from the next frame on; resets keep it.
    ///
    /// `mode` must pass [`IntersectionMode::check`].
    pub fn set_intersection(&mut self, mode: IntersectionMode) {
        // Search trees are built for a mode, which takes longer than a step.
        if mode != self.intersections.mode() {
            self.intersections.set_mode(mode, &self.model);
        }
    }

    /// Replaces the rule by which the categories of the motion's code are picked, from the next
    /// step on; resets keep it.
    ///
    /// The default is [`CodeSampling::Largest`]. Models whose field is zero read no code.
    pub fn set_code_sampling(&mut self, sampling: CodeSampling) {
        self.code_sampling = sampling;
    }

    /// Sets the threads of all later calls, an engine's own (see [`parallel`](crate::parallel)).
    ///
    /// Animators can share them. An animator without threads uses those that are
    /// [installed](crate::parallel::install) around the call, or the default ones. Results are the
    /// same bytes for all threads.
    pub fn set_threads(&mut self, threads: Arc<dyn Threads>) {
        self.threads = Some(threads);
    }

    /// Sets ground and props, in world space and metres, from the next frame on; resets keep them.
    ///
    /// [`IntersectionMode::Robust`] moves shown vertices out of them, after the body. The other
    /// modes ignore them.
    ///
    /// ```
    /// # use glam::Vec3;
    /// # use unic_core::{animator::Animator, collider::Collider};
    /// # fn every_frame(animator: &mut Animator, hand: Vec3) {
    /// animator.set_colliders([Collider::ground(0.0), Collider::sphere(0.12, hand)]);
    /// // Later, when it has moved:
    /// animator.colliders_mut()[1].world_from_collider.translation = hand;
    /// # }
    /// ```
    pub fn set_colliders(&mut self, colliders: impl IntoIterator<Item = Collider>) {
        self.intersections.colliders.clear();
        self.intersections.colliders.extend(colliders);
    }

    /// Ground and props, to be moved before a step.
    pub fn colliders_mut(&mut self) -> &mut [Collider] {
        &mut self.intersections.colliders
    }

    /// Sets the layers of the garment, whose order is kept from the next frame on; resets keep
    /// them.
    ///
    /// [`IntersectionMode::Robust`] moves shown vertices of outer layers out of inner ones. The
    /// other modes ignore layers.
    ///
    /// # Errors
    /// Layers of another mesh.
    pub fn set_layers(&mut self, layers: Layers) -> Result<(), AnimatorError> {
        let (expected, found) = (self.model.vertex_count(), layers.layer_of_vertex().len());
        if expected != found {
            return Err(AnimatorError::Vertices { expected, found });
        }
        self.intersections.set_layers(layers);
        Ok(())
    }

    /// Begins a sequence: at its first frame, or at the frame after a cut.
    ///
    /// # Errors
    /// A pose of another skeleton, positions of another mesh, numbers that are not finite. The
    /// state stays as it was.
    pub fn reset(&mut self, input: &StepInput, start: Start) -> Result<GarmentFrame<'_>, AnimatorError> {
        input.check(&self.model)?;
        start.check(&self.model)?;
        // The threads are cloned, because the closure borrows the animator.
        install_if_some(self.threads.clone(), || self.begin(input, start));
        Ok(self.garment())
    }

    fn begin(&mut self, input: &StepInput, start: Start) {
        self.state = AnimatorState::start(&self.model, &input.motion(&self.model));
        self.rebuild_scratch();
        match start {
            Start::Positions(positions) => {
                self.begin_memory(Origin::Given);
                self.place(positions);
            }
            Start::MeanShape => {
                self.begin_memory(Origin::MeanShape);
                self.place_mean_shape();
            }
        }
        // The garment starts at rest.
        for vertex in &mut self.state.vertices {
            vertex.previous = vertex.value;
        }
        self.predict_positions();
        // A mean over many shapes is too short, unlike given positions.
        if matches!(start, Start::MeanShape) {
            self.project(Memory::None);
        }
        self.show(&mut |_| ());
    }

    /// Advances the garment by one tick of 1 / fps seconds, to a new pose.
    ///
    /// # Errors
    /// A pose of another skeleton, with numbers that are not finite or farther than 1000 km from
    /// the origin. The state stays as it was.
    pub fn step(&mut self, input: &StepInput) -> Result<GarmentFrame<'_>, AnimatorError> {
        self.step_observed(input, &mut |_| ())
    }

    /// Advances the garment like [`step`](Self::step) and calls `observe` after each part of it.
    ///
    /// Stages that a step does in two parts are reported twice.
    ///
    /// # Errors
    /// The errors of [`step`](Self::step).
    pub fn step_observed(
        &mut self,
        input: &StepInput,
        observe: &mut dyn FnMut(Stage),
    ) -> Result<GarmentFrame<'_>, AnimatorError> {
        input.check(&self.model)?;
        install_if_some(self.threads.clone(), || self.advance(input, observe));
        Ok(self.garment())
    }

    fn advance(&mut self, input: &StepInput, observe: &mut dyn FnMut(Stage)) {
        let model = &self.model;
        let (spec, skeleton) = (&model.config.motion, &model.character.skeleton);
        self.state.motion.advance(spec, skeleton, &input.motion(model));
        self.state.ticks += 1;
        observe(Stage::Motion);
        self.skin();
        observe(Stage::Skinning);
        // The motion state has the second pose now, which completes frame 0.
        if self.state.at_start {
            self.complete_start();
        }
        self.encode();
        observe(Stage::Encoder);
        self.deform(input.wind);
        observe(Stage::Field);
        self.correct_state();
        observe(Stage::Intersections);
        self.predict_positions();
        observe(Stage::Positions);
        self.project(Memory::Previous);
        observe(Stage::Projection);
        self.show(observe);
    }

    /// Replaces the garment at the current frame by world positions in metres, for teacher forcing
    /// or to take over from a simulation.
    ///
    /// The garment of the previous frame stays, and velocities are differences to it. Called after
    /// every step, the next step sees given positions alone. Called once, the jump counts as
    /// motion. The residual of a replay ends, and returns as the given garment is forgotten
    /// ([`StartMemory`]).
    ///
    /// # Errors
    /// Positions of another mesh or that are not finite. The state stays as it was.
    pub fn set_garment(&mut self, positions: &[Vec3]) -> Result<(), AnimatorError> {
        check_positions(&self.model, positions)?;
        install_if_some(self.threads.clone(), || {
            self.begin_memory(Origin::Given);
            // Without the residual of a replay now, which would be forgotten with the rest.
            self.keep_prior();
            self.place(positions);
            self.finish();
        });
        Ok(())
    }

    /// Garment at the current frame.
    pub fn garment(&self) -> GarmentFrame<'_> {
        GarmentFrame {
            positions: &self.scratch.positions,
            normals: &self.scratch.normals,
        }
    }

    /// State at the current frame: everything that the next step depends on.
    pub fn state(&self) -> &AnimatorState {
        &self.state
    }

    /// Replaces the state by a saved one. Later steps give the same bytes as they gave after it.
    ///
    /// # Errors
    /// A state of another model. The current state stays.
    pub fn restore(&mut self, state: AnimatorState) -> Result<GarmentFrame<'_>, AnimatorError> {
        state.check(&self.model)?;
        self.state = state;
        install_if_some(self.threads.clone(), || {
            self.rebuild_scratch();
            self.finish();
        });
        Ok(self.garment())
    }

    /// Writes the world positions of the body's vertices in the current pose, metres.
    pub fn body(&self, positions: &mut Vec<Vec3>) {
        install_if_some(self.threads.clone(), || {
            pose_body(&self.model.character, &self.scratch.world_from_rest, positions);
        });
    }
}
