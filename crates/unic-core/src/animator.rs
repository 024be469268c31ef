//! The animator: one instance of a model on one character, stepped once a tick.

mod error;
mod state;

pub use error::AnimatorError;
pub use state::AnimatorState;

use crate::{
    config::{IntersectionMode, StateConfig},
    features::{PointFrame, PointHistory, StateInputs, limited, write_frame_inputs},
    intersection::{BodySnapshot, PaperIntersection},
    mesh::vertex_normals,
    model::Model,
    motion::MotionInput,
    network::{EncoderScratch, FieldBiases, FieldScratch, TILE},
    skeleton::Pose,
    transform::Rigid,
};
use glam::Vec3;
use state::VertexState;
use std::sync::Arc;

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
}

/// What the garment is before the first step.
#[derive(Clone, Copy, Debug)]
pub enum Start<'a> {
    /// The mean shape seen in training, carried by the skeleton (the rest shape where the model has none).
    MeanShape,
    /// World positions in metres, one a garment vertex: from a simulation or a cache.
    Positions(&'a [Vec3]),
}

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
    coefficients: Vec<f32>,
    /// Displacements of the prior in the current frame.
    prior: Vec<Vec3>,
    body_vertices: Vec<Vec3>,
    body: BodySnapshot,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
}

/// The garment after a step: borrowed from the animator, so that nothing is copied.
#[derive(Clone, Copy, Debug)]
pub struct GarmentFrame<'a> {
    /// World positions, metres, one a vertex of the model's mesh.
    pub positions: &'a [Vec3],
    /// Unit normals, area-weighted.
    pub normals: &'a [Vec3],
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

    /// Replaces the model's intersection handling; kept over resets.
    pub fn set_intersection(&mut self, mode: IntersectionMode) {
        self.intersection = mode;
    }

    /// Frame 0 of a sequence, or the frame after a cut.
    ///
    /// # Errors
    /// A pose of another skeleton, positions of another mesh, numbers that are not finite; the
    /// state stays as it was.
    pub fn reset(&mut self, input: &StepInput, start: Start) -> Result<GarmentFrame<'_>, AnimatorError> {
        self.check(input)?;
        if let Start::Positions(positions) = start {
            self.check_positions(positions)?;
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
    /// A pose of another skeleton or with numbers that are not finite; the state stays as it was.
    pub fn step(&mut self, input: &StepInput) -> Result<GarmentFrame<'_>, AnimatorError> {
        self.check(input)?;
        let model = &self.model;
        let (spec, skeleton) = (&model.config.motion, &model.character.skeleton);
        self.state.motion.advance(spec, skeleton, &motion_input(model, input));
        self.carry();
        if self.state.at_start {
            self.complete_start();
        }
        self.encode();
        self.deform();
        self.handle_intersections();
        Ok(self.finish())
    }

    /// Replaces the garment at the current frame by given world positions, its velocity with it:
    /// teacher forcing, or a hand-over from a simulation.
    ///
    /// # Errors
    /// Positions of another mesh or that are not finite; the state stays as it was.
    pub fn set_garment(&mut self, positions: &[Vec3]) -> Result<(), AnimatorError> {
        self.check_positions(positions)?;
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
        let body = &self.model.character;
        body.weights.skin(&body.body.vertices, &self.scratch.world_from_rest, positions);
    }

    fn check(&self, input: &StepInput) -> Result<(), AnimatorError> {
        let expected = self.model.character.skeleton.len();
        for pose in [Some(input.pose), input.next_pose].into_iter().flatten() {
            let found = pose.local.len();
            if found != expected {
                return Err(AnimatorError::Joints { expected, found });
            }
            if !pose.is_valid() {
                return Err(AnimatorError::Pose);
            }
        }
        match input.ground_height.is_finite() {
            true => Ok(()),
            false => Err(AnimatorError::Pose),
        }
    }

    fn check_positions(&self, positions: &[Vec3]) -> Result<(), AnimatorError> {
        let (expected, found) = (self.model.vertex_count(), positions.len());
        if expected != found {
            return Err(AnimatorError::Vertices { expected, found });
        }
        match positions.iter().position(|p| !p.is_finite()) {
            None => Ok(()),
            Some(vertex) => Err(AnimatorError::Position { vertex }),
        }
    }

    /// Rebuilds what derives from the state: transforms and point histories.
    fn refresh(&mut self) {
        let Self { model, state, scratch, .. } = self;
        let skeleton = &model.character.skeleton;
        let garment = &model.garment;
        scratch.histories.resize(model.vertex_count(), PointHistory::default());
        let motion = &state.motion;
        let (before, now) = motion.pair();
        write_pair(model, [before, now], &mut scratch.encoder_input);
        for world_from_joint in [motion.previous_world_from_joint(), motion.world_from_joint()] {
            skeleton.world_from_rest(world_from_joint, &mut scratch.world_from_rest);
            let transforms = &scratch.world_from_rest;
            for_each_tile(&mut scratch.histories, |first, tile| {
                for (i, history) in tile.iter_mut().enumerate() {
                    history.advance(PointFrame::new(garment, first + i, transforms), false);
                }
            });
        }
        self.hang();
    }

    /// Point histories of the new frame.
    fn carry(&mut self) {
        let Self { model, state, scratch, .. } = self;
        let skeleton = &model.character.skeleton;
        skeleton.world_from_rest(state.motion.world_from_joint(), &mut scratch.world_from_rest);
        let (garment, transforms) = (&model.garment, &scratch.world_from_rest);
        let first_step = state.at_start;
        for_each_tile(&mut scratch.histories, |first, tile| {
            for (i, history) in tile.iter_mut().enumerate() {
                history.advance(PointFrame::new(garment, first + i, transforms), first_step);
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
        for (vertex, (old, new)) in self.state.vertices.iter_mut().zip(before.iter().zip(&self.scratch.prior)) {
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
        model.encoder.encode(&scratch.encoder_input, &mut scratch.encoder, &mut scratch.latent);
        model.field.fold(&scratch.latent, &mut scratch.biases);
    }

    /// The field over all vertices, tile by tile.
    fn deform(&mut self) {
        let Self { model, state, scratch, .. } = self;
        let (histories, biases) = (&scratch.histories, &scratch.biases);
        for_each_tile(&mut state.vertices, |first, vertices| {
            let tile = Tile {
                model,
                biases,
                histories: &histories[first..first + vertices.len()],
                first,
            };
            tile.advance(vertices);
        });
    }

    fn handle_intersections(&mut self) {
        let IntersectionMode::Paper { relaxation_m } = self.intersection else {
            return;
        };
        let rule = PaperIntersection { relaxation_m };
        let Self { model, state, scratch, .. } = self;
        let character = &model.character;
        character.weights.skin(&character.body.vertices, &scratch.world_from_rest, &mut scratch.body_vertices);
        scratch.body.prepare(&scratch.body_vertices, &character.body.faces);
        let body = &scratch.body;
        let at = Places::new(model, scratch, state.motion.world_from_frame());
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
        let at = Places::new(&self.model, &self.scratch, self.state.motion.world_from_frame());
        for (vertex, state) in self.state.vertices.iter_mut().enumerate() {
            state.value = at.of(vertex).to_state(positions[vertex]);
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
        let Self { model, state, scratch, .. } = self;
        let vertices = &state.vertices;
        let mut positions = std::mem::take(&mut scratch.positions);
        positions.resize(vertices.len(), Vec3::ZERO);
        let at = Places::new(model, scratch, state.motion.world_from_frame());
        for_each_tile(&mut positions, |first, positions| {
            for (i, position) in positions.iter_mut().enumerate() {
                let place = at.of(first + i);
                *position = place.to_world(vertices[first + i].value);
            }
        });
        scratch.positions = positions;
        vertex_normals(&scratch.positions, &model.garment.rest.faces, &mut scratch.normals);
        self.garment()
    }
}

/// Between states and world positions in one frame.
enum Places<'a> {
    /// States are positions in the frame of the motion vector.
    Frame(Rigid),
    /// States are displacements from where the prior puts each vertex, in its own frame.
    Points { histories: &'a [PointHistory], prior: &'a [Vec3] },
}

/// Between the state of one vertex and its world position: world = frame · (offset + state).
struct Place {
    frame: PointFrame,
    offset: Vec3,
}

impl<'a> Places<'a> {
    fn new(model: &Model, scratch: &'a Scratch, world_from_frame: Rigid) -> Self {
        match model.config.state {
            StateConfig::Position => Self::Frame(world_from_frame),
            StateConfig::Displacement(_) => {
                Self::Points { histories: &scratch.histories, prior: &scratch.prior }
            }
        }
    }

    fn of(&self, vertex: usize) -> Place {
        match self {
            Self::Frame(frame) => Place {
                frame: PointFrame { skinned: frame.translation, rotation: frame.rotation },
                offset: Vec3::ZERO,
            },
            Self::Points { histories, prior } => Place { frame: histories[vertex].now, offset: prior[vertex] },
        }
    }
}

impl Place {
    fn to_world(&self, state: Vec3) -> Vec3 {
        self.frame.position(self.offset + state)
    }

    fn to_state(&self, world: Vec3) -> Vec3 {
        self.frame.displacement(world) - self.offset
    }
}

/// Up to [`TILE`] neighbouring vertices on their way through the field.
struct Tile<'a> {
    model: &'a Model,
    biases: &'a FieldBiases,
    histories: &'a [PointHistory],
    first: usize,
}

impl Tile<'_> {
    fn advance(&self, vertices: &mut [VertexState]) {
        let field = &self.model.field;
        let mut inputs = vec![[0.0; TILE]; field.point_inputs()];
        let mut point = vec![0.0; field.point_inputs()];
        for (lane, vertex) in vertices.iter().enumerate() {
            self.write_inputs(lane, vertex, &mut point);
            inputs.iter_mut().zip(&point).for_each(|(channel, x)| channel[lane] = *x);
        }
        let mut outputs = [[0.0; TILE]; 3];
        field.evaluate(self.biases, &inputs, &mut FieldScratch::default(), &mut outputs);
        for (lane, vertex) in vertices.iter_mut().enumerate() {
            let output = Vec3::from_array(outputs.map(|channel| channel[lane]));
            let value = self.updated(vertex.value, output);
            *vertex = VertexState {
                value,
                previous: vertex.value,
            };
        }
    }

    fn write_inputs(&self, lane: usize, vertex: &VertexState, out: &mut [f32]) {
        match &self.model.config.state {
            StateConfig::Position => out.copy_from_slice(&vertex.value.to_array()),
            StateConfig::Displacement(config) => {
                let (state, frame) = out.split_at_mut(self.model.config.state.state_input_len());
                StateInputs::new(config).write(vertex.value, vertex.previous, state);
                let rest = self.model.garment.rest.vertices[self.first + lane];
                let rest = self.model.rest_box.normalised(rest);
                let dt = 1.0 / self.model.config.fps;
                write_frame_inputs(config, rest, &self.histories[lane], dt, frame);
            }
        }
    }

    fn updated(&self, value: Vec3, output: Vec3) -> Vec3 {
        match &self.model.config.state {
            StateConfig::Position => value + output,
            StateConfig::Displacement(config) => {
                let decay = config.decay(1.0 / self.model.config.fps);
                value * decay + limited(output, config.output_limit) * config.scale_m
            }
        }
    }
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

/// Calls `task` with the index of its first item for every [`TILE`] of items, on all threads.
fn for_each_tile<T: Send>(items: &mut [T], task: impl Fn(usize, &mut [T]) + Sync + Send) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        let tiles = items.par_chunks_mut(TILE).enumerate();
        tiles.for_each(|(i, tile)| task(i * TILE, tile));
    }
    #[cfg(not(feature = "rayon"))]
    for (i, tile) in items.chunks_mut(TILE).enumerate() {
        task(i * TILE, tile);
    }
}
