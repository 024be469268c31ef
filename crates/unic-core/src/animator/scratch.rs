//! Scratch memory of an animator, and the parts of it that are computed from the state.

use super::{Animator, deform::TileScratch, start_memory::Origin, state::VertexState, tiles::for_each_tile};
use crate::{
    config::StateConfig,
    features::{PointFrame, PointHistory},
    network::{EncoderScratch, FieldBiases},
    projection::{ContactPlane, ProjectionScratch},
    recurrence::RecurrenceScratch,
    replay::ReplayScratch,
    transform::Rigid,
};
use glam::Vec3;

/// Buffers that are computed from the state, or hold nothing between steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    /// Skinning transforms of the joints in the current frame.
    pub(super) world_from_rest: Vec<Rigid>,
    /// Skinned frames of the vertices in the last three frames.
    pub(super) histories: Vec<PointHistory>,
    /// Normalised pair of motion vectors.
    pub(super) encoder_input: Vec<f32>,
    pub(super) encoder: EncoderScratch,
    /// Gumbel noise of the current tick, one number a logit; empty without sampling.
    pub(super) code_noise: Vec<f32>,
    /// Latent vector of the current tick.
    pub(super) latent: Vec<f32>,
    /// Biases of the field with the latent vector folded in.
    pub(super) biases: FieldBiases,
    pub(super) tiles: Vec<TileScratch>,
    /// States of the sampled vertices, if the model has sampling.
    pub(super) sampled: Vec<VertexState>,
    pub(super) recurrence: RecurrenceScratch,
    pub(super) replay: ReplayScratch,
    /// Coefficients of the prior in the current frame.
    pub(super) coefficients: Vec<f32>,
    /// Coefficients of the current frame times the steps of the components, metres.
    pub(super) scaled_coefficients: Vec<f32>,
    /// Coefficients of the prior without those of the replay.
    pub(super) moved_coefficients: Vec<f32>,
    /// Coefficients of the replay in the current frame.
    pub(super) residual: Vec<f32>,
    /// Factor by which the states of the previous tick enter the current one.
    pub(super) decay: f32,
    /// Displacements of the prior in the current frame, metres.
    pub(super) prior: Vec<Vec3>,
    pub(super) projection: ProjectionScratch,
    /// Planes that shown vertices stay above.
    pub(super) planes: Vec<ContactPlane>,
    /// Shown world positions, metres.
    pub(super) positions: Vec<Vec3>,
    /// Shown unit normals.
    pub(super) normals: Vec<Vec3>,
}

impl Animator {
    /// Recomputes everything that derives from the state, after it was replaced.
    pub(super) fn rebuild_scratch(&mut self) {
        let Self {
            model,
            state,
            scratch,
            intersections,
            ..
        } = self;
        intersections.invalidate();
        let skeleton = &model.character.skeleton;
        let garment = &model.garment;
        scratch
            .histories
            .resize(model.vertex_count(), PointHistory::default());
        let motion = &state.motion;
        let (before, now) = motion.pair();
        model
            .normalisation
            .write_pair([before, now], &mut scratch.encoder_input);
        // The previous frame first, so that histories hold both.
        for world_from_joint in [motion.previous_world_from_joint(), motion.world_from_joint()] {
            skeleton.world_from_rest(world_from_joint, &mut scratch.world_from_rest);
            let transforms = &scratch.world_from_rest;
            for_each_tile(&mut scratch.histories, |first, tile| {
                for (i, history) in tile.iter_mut().enumerate() {
                    history.advance(PointFrame::new(garment, first + i, transforms));
                }
            });
        }
        self.evaluate_prior(match self.state.at_start {
            true => MotionUpdate::Start,
            false => MotionUpdate::Keep,
        });
    }

    /// Skins the garment's rest shape to the new pose and advances the histories.
    pub(super) fn skin(&mut self) {
        let Self {
            model,
            state,
            scratch,
            intersections,
            ..
        } = self;
        intersections.invalidate();
        let skeleton = &model.character.skeleton;
        skeleton.world_from_rest(state.motion.world_from_joint(), &mut scratch.world_from_rest);
        let (garment, transforms) = (&model.garment, &scratch.world_from_rest);
        for_each_tile(&mut scratch.histories, |first, tile| {
            for (i, history) in tile.iter_mut().enumerate() {
                history.advance(PointFrame::new(garment, first + i, transforms));
            }
        });
    }

    /// Corrects the states of frame 0 at the first step after a reset.
    ///
    /// The motion vector of frame 0 has no velocities until the second pose is known. With them the
    /// prior's displacements of frame 0 change. States are measured from these, so that they change
    /// the other way, and the garment of frame 0 stays where it is. The replay begins here, for its
    /// search needs the velocities too.
    pub(super) fn complete_start(&mut self) {
        // Moved out of the scratch memory, which is overwritten below.
        let before = std::mem::take(&mut self.scratch.prior);
        self.begin_replay();
        let (first, _) = self.state.motion.pair();
        self.model
            .normalisation
            .write_pair([first, first], &mut self.scratch.encoder_input);
        self.evaluate_prior(MotionUpdate::Start);
        self.state.start.count_from(&self.scratch.moved_coefficients);
        for (vertex, (old, new)) in self
            .state
            .vertices
            .iter_mut()
            .zip(before.iter().zip(&self.scratch.prior))
        {
            vertex.value += *old - *new;
            // The garment is at rest in frame 0.
            vertex.previous = vertex.value;
        }
        self.state.at_start = false;
    }

    /// Begins the replay, whose residual the prior of frame 0 has too.
    fn begin_replay(&mut self) {
        if let (Some(replay), Some(playing)) = (&self.model.prior.replay, &mut self.state.replay) {
            let (first, second) = self.state.motion.pair();
            let pair = &mut self.scratch.encoder_input;
            self.model.normalisation.write_pair([first, second], pair);
            replay.begin(pair, 1.0 / self.model.config.fps, playing);
        }
    }

    /// Begins the memory of a garment in the current frame.
    pub(super) fn begin_memory(&mut self, origin: Origin) {
        // Root-relative states are measured from no prior, and never fade.
        let origin = match self.model.config.state {
            StateConfig::RootRelative => Origin::MeanShape,
            StateConfig::Displacement(_) => origin,
        };
        self.state.start.begin(origin, &self.scratch.moved_coefficients);
    }

    /// Computes the prior's displacements of the current frame again, after the memory of the start
    /// has changed.
    pub(super) fn keep_prior(&mut self) {
        self.evaluate_prior(MotionUpdate::Keep);
    }

    /// Computes the prior's displacements for the motion in `encoder_input`.
    fn evaluate_prior(&mut self, update: MotionUpdate) {
        let Self {
            model,
            scratch,
            state,
            intersections,
            ..
        } = self;
        // Root-relative states are not measured from a prior.
        let StateConfig::Displacement(config) = &model.config.state else {
            return;
        };
        let dt = 1.0 / model.config.fps;
        let prior = &model.prior;
        prior.coefficients(&scratch.encoder_input, &mut scratch.coefficients);
        if let Some(recurrence) = &prior.recurrence {
            let buffers = &mut scratch.recurrence;
            recurrence.embed(&scratch.encoder_input, buffers);
            match update {
                MotionUpdate::Start => recurrence.start(buffers, &mut state.recurrence),
                MotionUpdate::Advance => recurrence.advance(buffers, &mut state.recurrence),
                MotionUpdate::Keep => {}
            }
            recurrence.add_to(&state.recurrence, buffers, &mut scratch.coefficients);
        }
        scratch.moved_coefficients.clone_from(&scratch.coefficients);
        if update == MotionUpdate::Advance {
            let (sizes, keeping) = (&model.component_sizes, intersections.keeping());
            let coefficients = &scratch.coefficients;
            scratch.decay = state.start.advance(config, keeping, sizes, coefficients, dt);
        }
        if let (Some(replay), Some(playing)) = (&prior.replay, &mut state.replay) {
            if update == MotionUpdate::Advance {
                replay.advance(&scratch.encoder_input, dt, playing, &mut scratch.replay);
            }
            let (residual, shown) = (&mut scratch.residual, state.start.added_share());
            residual.clear();
            residual.resize(prior.len(), 0.0);
            replay.add_to(playing, residual);
            let coefficients = scratch.coefficients.iter_mut().zip(residual);
            coefficients.for_each(|(a, residual)| *a += *residual * shown);
        }
        scratch.prior.resize(model.vertex_count(), Vec3::ZERO);
        let scaled = &mut scratch.scaled_coefficients;
        prior.components.scale(&scratch.coefficients, scaled);
        for_each_tile(&mut scratch.prior, |first, tile| {
            prior.displacements(first, scaled, tile);
        });
    }

    /// Computes the prior, the latent vector and the field's biases from the motion vectors.
    pub(super) fn encode(&mut self) {
        let (before, now) = self.state.motion.pair();
        self.model
            .normalisation
            .write_pair([before, now], &mut self.scratch.encoder_input);
        self.evaluate_prior(MotionUpdate::Advance);
        let Self {
            model,
            scratch,
            state,
            code_sampling,
            ..
        } = self;
        // A field that is zero needs no inputs.
        if model.is_field_skipped() {
            return;
        }
        scratch.latent.resize(model.config.encoder.latent_len(), 0.0);
        code_sampling.write_noise(state.ticks, model.encoder.logit_count(), &mut scratch.code_noise);
        let (input, noise) = (&scratch.encoder_input, &scratch.code_noise);
        model
            .encoder
            .encode(input, noise, &mut scratch.encoder, &mut scratch.latent);
        model.field.fold(&scratch.latent, &mut scratch.biases);
    }
}

/// Change of the states of recurrence and replay by the motion in the buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MotionUpdate {
    /// The motion begins a sequence: the steady state replaces the state.
    Start,
    /// The motion is one tick later than the state, which advances.
    Advance,
    /// The motion is that of the state, which stays.
    Keep,
}
