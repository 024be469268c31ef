//! What goes to the device.

use super::Buffers;
use crate::GpuModel;
use glam::Vec3;
use unic_core::{config::IntersectionMode, motion::MotionState, transform::Rigid};

/// Host memory on its way to the device. Scratch.
#[derive(Debug, Default)]
pub(super) struct Upload {
    pair: Vec<f32>,
    world_from_rest: Vec<Rigid>,
    tick: Vec<[f32; 4]>,
    shown: Vec<[Vec3; 2]>,
}

/// Which of the two poses that a state knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Frame {
    Before,
    Now,
}

/// What a tick is, beside its pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct TickHead {
    pub(super) frame: Frame,
    pub(super) at_start: bool,
    pub(super) mode: IntersectionMode,
    /// m/s, world space.
    pub(super) wind: Vec3,
}

impl Upload {
    /// A pair of motion vectors, normalised.
    pub(super) fn pair(&mut self, asset: &GpuModel, buffers: &Buffers, pair: [&[f32]; 2]) {
        let pair_at = 4 * asset.networks.pair as u64;
        asset.model.normalisation().write_pair(pair, &mut self.pair);
        let queue = asset.context.queue();
        queue.write_buffer(&buffers.vectors, pair_at, bytemuck::cast_slice(&self.pair));
    }

    /// World positions to where they are shown.
    pub(super) fn positions(&mut self, asset: &GpuModel, buffers: &Buffers, positions: &[Vec3]) {
        self.shown.clear();
        self.shown.extend(positions.iter().map(|&p| [p, Vec3::ZERO]));
        let queue = asset.context.queue();
        queue.write_buffer(&buffers.shown, 0, bytemuck::cast_slice(&self.shown));
    }

    /// Pose and settings, as `places.wgsl` reads them.
    pub(super) fn tick(&mut self, asset: &GpuModel, buffers: &Buffers, motion: &MotionState, head: TickHead) {
        let world_from_joint = match head.frame {
            Frame::Before => motion.previous_world_from_joint(),
            Frame::Now => motion.world_from_joint(),
        };
        let skeleton = &asset.model.character().skeleton;
        skeleton.world_from_rest(world_from_joint, &mut self.world_from_rest);
        let handling = match head.mode {
            IntersectionMode::Off => 0.0,
            IntersectionMode::Paper { relaxation_m } => relaxation_m,
            IntersectionMode::Robust { margin_m, .. } => margin_m,
        };
        let first = if head.at_start { 1.0 } else { 0.0 };
        self.tick.clear();
        self.tick
            .extend(quadruples(&motion.world_from_state(skeleton), first));
        let Vec3 { x, y, z } = head.wind;
        self.tick.push([handling, x, y, z]);
        let joints = self.world_from_rest.iter();
        self.tick.extend(joints.flat_map(|joint| quadruples(joint, 0.0)));
        let queue = asset.context.queue();
        queue.write_buffer(&buffers.tick, 0, bytemuck::cast_slice(&self.tick));
    }
}

/// Rotation, then translation with a number of another meaning.
fn quadruples(transform: &Rigid, other: f32) -> [[f32; 4]; 2] {
    let translation = transform.translation.extend(other);
    [transform.rotation.to_array(), translation.to_array()]
}
