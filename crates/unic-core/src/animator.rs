//! The animator: one instance of a model on one character, stepped once a tick.

mod deform;
mod error;
mod input;
mod place;
mod state;
mod tiles;

pub use error::AnimatorError;
pub use input::{GarmentFrame, Start, StepInput};
pub use state::AnimatorState;

use crate::{
    character::Character,
    config::{IntersectionMode, StateConfig},
    features::{Past, PointFrame, PointHistory},
    intersection::{BodySnapshot, PaperIntersection},
    mesh::vertex_normals,
    model::Model,
    motion::MotionInput,
    network::{EncoderScratch, FieldBiases},
    transform::Rigid,
};
use deform::{FieldFrame, TileScratch};
use glam::Vec3;
use input::check_positions;
use place::Places;
use std::sync::Arc;
use tiles::{for_each_tile, for_each_tile_with};

/// One garment in motion: a shared [`Model`], its own state and scratch memory.
///
/// Many animators share one model. [`reset`](Self::reset) at the first frame and after a cut, then
/// [`step`](Self::step) at the model's frame rate; the same inputs give the same bytes whatever the
/// number of threads.
#[derive(Clone, Debug)]
pub struct Animator {
    model: Arc<Model>,
    intersection: IntersectionMode,
    state: AnimatorState,
    scratch: Scratch,
}

/// Buffers that any state can be continued with: derived from the state, or free of meaning
/// between steps.
#[derive(Clone, Debug, Default)]
struct Scratch {
    world_from_rest: Vec<Rigid>,
    histories: Vec<PointHistory>,
    encoder_input: Vec<f32>,
    encoder: EncoderScratch,
    latent: Vec<f32>,
    biases: FieldBiases,
    tiles: Vec<TileScratch>,
    coefficients: Vec<f32>,
    /// Displacements of the prior in the current frame.
    prior: Vec<Vec3>,
    body_vertices: Vec<Vec3>,
    body: BodySnapshot,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl Animator {
    /// An animator at the bind pose; call [`reset`](Self::reset) before the first step.
    pub fn new(model: Arc<Model>) -> Self {
        let bind_pose = model.character.skeleton.bind_pose();
        let input = StepInput {
            pose: &bind_pose,
            next_pose: None,
            ground_height: 0.0,
        };
        let state = AnimatorState::start(&model, &motion_input(&model, &input));
        let mut animator = Self {
            intersection: model.config.intersection,
            scratch: Scratch::default(),
            state,
            model,
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
        self.intersection
    }

    /// Replaces the model's intersection handling; kept over resets. `mode` passes
    /// [`IntersectionMode::check`].
    pub fn set_intersection(&mut self, mode: IntersectionMode) {
        self.intersection = mode;
    }

    /// Frame 0 of a sequence, or the frame after a cut.
    ///
    /// # Errors
    /// A pose of another skeleton, positions of another mesh, numbers that are not finite; the
    /// state stays as it was.
    pub fn reset(&mut self, input: &StepInput, start: Start) -> Result<GarmentFrame<'_>, AnimatorError> {
        input.check(&self.model)?;
        if let Start::Positions(positions) = start {
            check_positions(&self.model, positions)?;
        }
        self.state = AnimatorState::start(&self.model, &motion_input(&self.model, input));
        self.refresh();
        match start {
            Start::Positions(positions) => self.place(positions),
            Start::MeanShape => self.place_mean_shape(),
        }
        for vertex in &mut self.state.vertices {
            vertex.previous = vertex.value;
        }
        Ok(self.finish())
    }

    /// One tick of 1 / fps seconds to a new pose.
    ///
    /// # Errors
    /// A pose of another skeleton, with numbers that are not finite or farther than 1000 km from the
    /// origin; the state stays as it was.
    pub fn step(&mut self, input: &StepInput) -> Result<GarmentFrame<'_>, AnimatorError> {
        input.check(&self.model)?;
        let model = &self.model;
        let (spec, skeleton) = (&model.config.motion, &model.character.skeleton);
        self.state
            .motion
            .advance(spec, skeleton, &motion_input(model, input));
        self.carry();
        if self.state.at_start {
            self.complete_start();
        }
        self.encode();
        self.deform();
        self.handle_intersections();
        Ok(self.finish())
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
        self.place(positions);
        self.finish();
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
        self.refresh();
        Ok(self.finish())
    }

    /// World positions of the body's vertices in the current pose.
    pub fn body(&self, positions: &mut Vec<Vec3>) {
        pose_body(&self.model.character, &self.scratch.world_from_rest, positions);
    }

    /// Rebuilds what derives from the state: transforms and point histories.
    fn refresh(&mut self) {
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        let skeleton = &model.character.skeleton;
        let garment = &model.garment;
        scratch
            .histories
            .resize(model.vertex_count(), PointHistory::default());
        let motion = &state.motion;
        let (before, now) = motion.pair();
        write_pair(model, [before, now], &mut scratch.encoder_input);
        for world_from_joint in [motion.previous_world_from_joint(), motion.world_from_joint()] {
            skeleton.world_from_rest(world_from_joint, &mut scratch.world_from_rest);
            let transforms = &scratch.world_from_rest;
            for_each_tile(&mut scratch.histories, |first, tile| {
                for (i, history) in tile.iter_mut().enumerate() {
                    history.advance(PointFrame::new(garment, first + i, transforms), Past::TwoFrames);
                }
            });
        }
        self.hang();
    }

    /// Point histories of the new frame.
    fn carry(&mut self) {
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        let skeleton = &model.character.skeleton;
        skeleton.world_from_rest(state.motion.world_from_joint(), &mut scratch.world_from_rest);
        let (garment, transforms) = (&model.garment, &scratch.world_from_rest);
        let past = match state.at_start {
            true => Past::OneFrame,
            false => Past::TwoFrames,
        };
        for_each_tile(&mut scratch.histories, |first, tile| {
            for (i, history) in tile.iter_mut().enumerate() {
                history.advance(PointFrame::new(garment, first + i, transforms), past);
            }
        });
    }

    /// On the first step the velocities of frame 0 are known at last, and with them where the prior
    /// put the garment there: states are counted from it anew, the garment stays.
    fn complete_start(&mut self) {
        let before = std::mem::take(&mut self.scratch.prior);
        let (first, _) = self.state.motion.pair();
        write_pair(&self.model, [first, first], &mut self.scratch.encoder_input);
        self.hang();
        for (vertex, (old, new)) in self
            .state
            .vertices
            .iter_mut()
            .zip(before.iter().zip(&self.scratch.prior))
        {
            vertex.value += *old - *new;
            vertex.previous = vertex.value;
        }
        self.state.at_start = false;
    }

    /// Where the prior puts the garment for the motion in `encoder_input`.
    fn hang(&mut self) {
        let Self { model, scratch, .. } = self;
        if model.config.state == StateConfig::Position {
            return;
        }
        let prior = &model.prior;
        prior.coefficients(&scratch.encoder_input, &mut scratch.coefficients);
        scratch.prior.resize(model.vertex_count(), Vec3::ZERO);
        let coefficients = &scratch.coefficients;
        for_each_tile(&mut scratch.prior, |first, tile| {
            for (i, displacement) in tile.iter_mut().enumerate() {
                *displacement = prior.displacement(first + i, coefficients);
            }
        });
    }

    /// Motion vectors to the prior's shapes and to the latent vector, folded into the field's biases.
    fn encode(&mut self) {
        let (before, now) = self.state.motion.pair();
        write_pair(&self.model, [before, now], &mut self.scratch.encoder_input);
        self.hang();
        let Self { model, scratch, .. } = self;
        scratch.latent.resize(model.config.encoder.channels, 0.0);
        model
            .encoder
            .encode(&scratch.encoder_input, &mut scratch.encoder, &mut scratch.latent);
        model.field.fold(&scratch.latent, &mut scratch.biases);
    }

    /// The field over all vertices, tile by tile.
    fn deform(&mut self) {
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        let frame = FieldFrame {
            model,
            biases: &scratch.biases,
            histories: &scratch.histories,
        };
        for_each_tile_with(
            &mut state.vertices,
            &mut scratch.tiles,
            |first, vertices, buffers| {
                frame.advance(first, vertices, buffers);
            },
        );
    }

    fn handle_intersections(&mut self) {
        let IntersectionMode::Paper { relaxation_m } = self.intersection else {
            return;
        };
        let rule = PaperIntersection { relaxation_m };
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        let character = &model.character;
        pose_body(character, &scratch.world_from_rest, &mut scratch.body_vertices);
        scratch
            .body
            .prepare(&scratch.body_vertices, &character.body.faces);
        let body = &scratch.body;
        let at = Places::new(
            model,
            &scratch.histories,
            &scratch.prior,
            state.motion.world_from_frame(),
        );
        for_each_tile(&mut state.vertices, |first, vertices| {
            for (i, vertex) in vertices.iter_mut().enumerate() {
                let place = at.of(first + i);
                if let Some(corrected) = rule.correct(body, place.to_world(vertex.value)) {
                    vertex.value = place.to_state(corrected);
                }
            }
        });
    }

    fn place(&mut self, positions: &[Vec3]) {
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        let at = Places::new(
            model,
            &scratch.histories,
            &scratch.prior,
            state.motion.world_from_frame(),
        );
        for (vertex, (state, position)) in state.vertices.iter_mut().zip(positions).enumerate() {
            state.value = at.of(vertex).to_state(*position);
        }
    }

    fn place_mean_shape(&mut self) {
        let mean = self.model.prior.mean.iter();
        let frames = self.scratch.histories.iter().map(|h| h.now);
        let positions: Vec<Vec3> = frames.zip(mean).map(|(f, &u)| f.position(u)).collect();
        self.place(&positions);
    }

    /// World positions and normals of the current state.
    fn finish(&mut self) -> GarmentFrame<'_> {
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        let vertices = &state.vertices;
        let at = Places::new(
            model,
            &scratch.histories,
            &scratch.prior,
            state.motion.world_from_frame(),
        );
        scratch.positions.resize(vertices.len(), Vec3::ZERO);
        for_each_tile(&mut scratch.positions, |first, positions| {
            for (i, position) in positions.iter_mut().enumerate() {
                *position = at.of(first + i).to_world(vertices[first + i].value);
            }
        });
        vertex_normals(
            &scratch.positions,
            &model.garment.rest.faces,
            &mut scratch.normals,
        );
        self.garment()
    }
}

/// Skinned body, world space, on all threads.
fn pose_body(character: &Character, world_from_rest: &[Rigid], positions: &mut Vec<Vec3>) {
    let (weights, rest) = (&character.weights, &character.body.vertices);
    positions.resize(rest.len(), Vec3::ZERO);
    for_each_tile(positions, |first, tile| {
        for (vertex, position) in (first..).zip(tile) {
            *position = weights.position(vertex, rest[vertex], world_from_rest);
        }
    });
}

/// Two motion vectors side by side, normalised.
fn write_pair(model: &Model, pair: [&[f32]; 2], out: &mut Vec<f32>) {
    out.clear();
    for vector in pair {
        let start = out.len();
        out.extend_from_slice(vector);
        model.normalisation.apply(&mut out[start..]);
    }
}

fn motion_input<'a>(model: &Model, input: &StepInput<'a>) -> MotionInput<'a> {
    MotionInput {
        pose: input.pose,
        next_pose: input.next_pose,
        ground_height: input.ground_height,
        dt: 1.0 / model.config.fps,
    }
}
