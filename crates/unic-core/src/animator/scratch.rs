//! Buffers of an animator, and those of them that derive from its state.

use super::{Animator, deform::TileScratch, state::VertexState, tiles::for_each_tile};
use crate::{
    config::StateConfig,
    features::{Past, PointFrame, PointHistory},
    network::{EncoderScratch, FieldBiases},
    recurrence::RecurrenceScratch,
    transform::Rigid,
};
use glam::Vec3;

/// Buffers that any state can be continued with: derived from the state, or free of meaning
/// between steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    pub(super) world_from_rest: Vec<Rigid>,
    pub(super) histories: Vec<PointHistory>,
    pub(super) encoder_input: Vec<f32>,
    pub(super) encoder: EncoderScratch,
    /// Gumbel noise of the current tick, one number a logit; empty without sampling.
    pub(super) code_noise: Vec<f32>,
    pub(super) latent: Vec<f32>,
    pub(super) biases: FieldBiases,
    pub(super) tiles: Vec<TileScratch>,
    /// States of the samples, where only they are evaluated.
    pub(super) sampled: Vec<VertexState>,
    pub(super) recurrence: RecurrenceScratch,
    pub(super) coefficients: Vec<f32>,
    /// Displacements of the prior in the current frame.
    pub(super) prior: Vec<Vec3>,
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
}

impl Animator {
    /// Rebuilds what derives from the state: transforms and point histories.
    pub(super) fn refresh(&mut self) {
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
        for world_from_joint in [motion.previous_world_from_joint(), motion.world_from_joint()] {
            skeleton.world_from_rest(world_from_joint, &mut scratch.world_from_rest);
            let transforms = &scratch.world_from_rest;
            for_each_tile(&mut scratch.histories, |first, tile| {
                for (i, history) in tile.iter_mut().enumerate() {
                    history.advance(PointFrame::new(garment, first + i, transforms), Past::TwoFrames);
                }
            });
        }
        self.hang(match self.state.at_start {
            true => Tick::First,
            false => Tick::Same,
        });
    }

    /// Point histories of the new frame.
    pub(super) fn carry(&mut self) {
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
    pub(super) fn complete_start(&mut self) {
        let before = std::mem::take(&mut self.scratch.prior);
        let (first, _) = self.state.motion.pair();
        self.model
            .normalisation
            .write_pair([first, first], &mut self.scratch.encoder_input);
        self.hang(Tick::First);
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
    fn hang(&mut self, tick: Tick) {
        let Self {
            model,
            scratch,
            state,
            ..
        } = self;
        if model.config.state == StateConfig::RootRelative {
            return;
        }
        let prior = &model.prior;
        prior.coefficients(&scratch.encoder_input, &mut scratch.coefficients);
        if let Some(recurrence) = &prior.recurrence {
            let buffers = &mut scratch.recurrence;
            recurrence.read(&scratch.encoder_input, buffers);
            match tick {
                Tick::First => recurrence.start(buffers, &mut state.recurrence),
                Tick::Next => recurrence.advance(buffers, &mut state.recurrence),
                Tick::Same => {}
            }
            recurrence.add_to(&state.recurrence, buffers, &mut scratch.coefficients);
        }
        scratch.prior.resize(model.vertex_count(), Vec3::ZERO);
        let coefficients = &scratch.coefficients;
        for_each_tile(&mut scratch.prior, |first, tile| {
            for (i, displacement) in tile.iter_mut().enumerate() {
                *displacement = prior.displacement(first + i, coefficients);
            }
        });
    }

    /// Motion vectors to the prior's shapes and to the latent vector, folded into the field's biases.
    pub(super) fn encode(&mut self) {
        let (before, now) = self.state.motion.pair();
        self.model
            .normalisation
            .write_pair([before, now], &mut self.scratch.encoder_input);
        self.hang(Tick::Next);
        let Self {
            model,
            scratch,
            state,
            code_sampling,
            ..
        } = self;
        scratch.latent.resize(model.config.encoder.latent_len(), 0.0);
        code_sampling.write_noise(state.ticks, model.encoder.logit_count(), &mut scratch.code_noise);
        let (input, noise) = (&scratch.encoder_input, &scratch.code_noise);
        model
            .encoder
            .encode(input, noise, &mut scratch.encoder, &mut scratch.latent);
        model.field.fold(&scratch.latent, &mut scratch.biases);
    }
}

/// What the motion in the buffers is to the prior's recurrence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tick {
    /// The first of a sequence.
    First,
    /// The one after the state's.
    Next,
    /// The state's own.
    Same,
}
