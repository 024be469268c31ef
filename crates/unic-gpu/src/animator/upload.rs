//! Uploads of an animator: motion vectors, poses and positions.

use super::Buffers;
use crate::GpuModel;
use glam::Vec3;
use unic_core::{
    IntersectionMode,
    motion::MotionState,
    replay::{ReplayScratch, ReplayState},
    transform::Rigid,
};

/// Host memory for uploads. Scratch.
#[derive(Debug, Default)]
pub(super) struct Upload {
    pair: Vec<f32>,
    replay: ReplayScratch,
    residuals: Vec<f32>,
    world_from_rest: Vec<Rigid>,
    tick: Vec<[f32; 4]>,
    shown: Vec<[Vec3; 2]>,
}

/// One of the two poses of a motion state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Frame {
    /// Pose of the previous frame.
    Previous,
    /// Pose of the current frame.
    Current,
}

/// Settings of a tick besides its pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct TickSettings {
    pub(super) frame: Frame,
    pub(super) mode: IntersectionMode,
    /// Wind in world space, m/s.
    pub(super) wind: Vec3,
}

impl Upload {
    /// Normalises a pair of motion vectors.
    pub(super) fn normalise(&mut self, asset: &GpuModel, pair: [&[f32]; 2]) {
        asset.model.normalisation().write_pair(pair, &mut self.pair);
    }

    /// Normalises and uploads a pair of motion vectors.
    pub(super) fn pair(&mut self, asset: &GpuModel, buffers: &Buffers, pair: [&[f32]; 2]) {
        let pair_at = 4 * asset.networks.pair as u64;
        self.normalise(asset, pair);
        let queue = asset.context.queue();
        queue.write_buffer(&buffers.vectors, pair_at, bytemuck::cast_slice(&self.pair));
    }

    /// Begins the replay with the pair that was normalised last.
    pub(super) fn begin(&self, asset: &GpuModel, state: Option<&mut ReplayState>) {
        if let (Some(replay), Some(state)) = (&asset.model.prior().replay, state) {
            replay.begin(&self.pair, 1.0 / asset.model.config().fps, state);
        }
    }

    /// Advances the replay to the pair that was normalised last.
    pub(super) fn advance(&mut self, asset: &GpuModel, state: Option<&mut ReplayState>) {
        if let (Some(replay), Some(state)) = (&asset.model.prior().replay, state) {
            let dt = 1.0 / asset.model.config().fps;
            replay.advance(&self.pair, dt, state, &mut self.replay);
        }
    }

    /// Uploads the residuals that the replay adds to the prior's coefficients.
    pub(super) fn residuals(&mut self, asset: &GpuModel, buffers: &Buffers, state: Option<&ReplayState>) {
        let prior = asset.model.prior();
        if let (Some(replay), Some(state)) = (&prior.replay, state) {
            self.residuals.clear();
            self.residuals.resize(prior.len(), 0.0);
            replay.add_to(state, &mut self.residuals);
            let at = 4 * asset.networks.start.residuals as u64;
            let queue = asset.context.queue();
            queue.write_buffer(&buffers.vectors, at, bytemuck::cast_slice(&self.residuals));
        }
    }

    /// Uploads world positions into the buffer of shown vertices.
    pub(super) fn positions(&mut self, asset: &GpuModel, buffers: &Buffers, positions: &[Vec3]) {
        self.shown.clear();
        self.shown.extend(positions.iter().map(|&p| [p, Vec3::ZERO]));
        let queue = asset.context.queue();
        queue.write_buffer(&buffers.shown, 0, bytemuck::cast_slice(&self.shown));
    }

    /// Uploads pose and settings in the memory layout of `vertex_state.wgsl`.
    pub(super) fn tick(
        &mut self,
        asset: &GpuModel,
        buffers: &Buffers,
        motion: &MotionState,
        settings: TickSettings,
    ) {
        let world_from_joint = match settings.frame {
            Frame::Previous => motion.previous_world_from_joint(),
            Frame::Current => motion.world_from_joint(),
        };
        let skeleton = &asset.model.character().skeleton;
        skeleton.world_from_rest(world_from_joint, &mut self.world_from_rest);
        let handling = match settings.mode {
            IntersectionMode::Off => 0.0,
            IntersectionMode::Paper { relaxation_m } => relaxation_m,
            IntersectionMode::Robust { margin_m, .. } => margin_m,
        };
        self.tick.clear();
        self.tick.extend(packed(&motion.world_from_state(skeleton)));
        let Vec3 { x, y, z } = settings.wind;
        self.tick.push([handling, x, y, z]);
        let joints = self.world_from_rest.iter();
        self.tick.extend(joints.flat_map(packed));
        let queue = asset.context.queue();
        queue.write_buffer(&buffers.tick, 0, bytemuck::cast_slice(&self.tick));
    }
}

/// Packs a transform into two vectors of four: the rotation, and the translation with 0.
fn packed(transform: &Rigid) -> [[f32; 4]; 2] {
    let translation = transform.translation.extend(0.0);
    [transform.rotation.to_array(), translation.to_array()]
}
