//! Saved states of an animator: copies from the device, and uploads to it.

use super::{GpuAnimator, buffers::STATE_BYTES, upload::Frame};
use crate::{GpuError, garment::is_in_frame};
use glam::Vec4;
use std::sync::Arc;
use unic_core::{
    AnimatorState,
    animator::{StartMemory, VertexState},
};
use wgpu::Buffer;

impl GpuAnimator {
    /// Copies the state: everything that the next step depends on, here or on the CPU. Blocks until
    /// the device is done.
    ///
    /// # Errors
    /// Fails when the device is lost.
    pub fn state(&self) -> Result<AnimatorState, GpuError> {
        let (asset, context) = (&self.asset, &self.asset.context);
        let vertices = asset.model.vertex_count();
        let offsets = asset.model.projection().map_or(0, |_| vertices);
        let memory = &asset.networks.memory;
        let (from, bytes) = (4 * memory.start as u64, 4 * memory.len() as u64);
        let remembered = context.download(&self.buffers.vectors, from, bytes)?;
        let start = self.start_memory()?;
        Ok(AnimatorState {
            start,
            motion: self.motion.clone(),
            at_start: self.at_start,
            ticks: self.ticks,
            vertices: self.vertex_states(&self.buffers.states, vertices)?,
            recurrence: bytemuck::pod_collect_to_vec(&remembered),
            replay: self.replay.clone(),
            offsets: self.vertex_states(&self.buffers.offsets, offsets)?,
        })
    }

    /// Continues from a saved state of an animator on a device or on the CPU.
    ///
    /// # Errors
    /// Fails on a state of another model; the current state then stays.
    pub fn restore(&mut self, state: AnimatorState) -> Result<(), GpuError> {
        let asset = Arc::clone(&self.asset);
        state.check(&asset.model)?;
        let context = &asset.context;
        let states = packed(&state.vertices, |vertex| asset.model.garment().share(vertex));
        // Kernels read no mask of an offset.
        let offsets = packed(&state.offsets, |_| 0.0);
        let memory = 4 * asset.networks.memory.start as u64;
        let (given, start) = (&asset.networks.start, &state.start);
        let queue = context.queue();
        let numbers = [start.excursion_m, start.share];
        for (at, numbers) in [
            (given.given.start, &start.coefficients[..]),
            (given.memory, &numbers),
        ] {
            queue.write_buffer(
                &self.buffers.vectors,
                4 * at as u64,
                bytemuck::cast_slice(numbers),
            );
        }
        queue.write_buffer(&self.buffers.states, 0, bytemuck::cast_slice(&states));
        queue.write_buffer(&self.buffers.offsets, 0, bytemuck::cast_slice(&offsets));
        queue.write_buffer(
            &self.buffers.vectors,
            memory,
            bytemuck::cast_slice(&state.recurrence),
        );
        (self.motion, self.at_start, self.ticks) = (state.motion, state.at_start, state.ticks);
        self.replay = state.replay;
        self.upload.residuals(&asset, &self.buffers, self.replay.as_ref());
        // The points of the previous frame first: velocities are differences to them.
        self.upload_tick(Frame::Previous);
        self.programs.skin_previous.submit(context);
        let (before, now) = self.motion.pair();
        self.upload.pair(&asset, &self.buffers, [before, now]);
        self.upload_tick(Frame::Current);
        let program = match self.at_start {
            true => &self.programs.resume_at_start,
            false => &self.programs.resume,
        };
        program.submit(context);
        Ok(())
    }

    /// Copies what is left of the given garment.
    fn start_memory(&self) -> Result<StartMemory, GpuError> {
        let regions = &self.asset.networks.start;
        let copied = |at: usize, count: usize| {
            let (from, bytes) = (4 * at as u64, 4 * count as u64);
            self.asset.context.download(&self.buffers.vectors, from, bytes)
        };
        // Root-relative states are measured from no prior.
        let count = match is_in_frame(&self.asset.model) {
            true => 0,
            false => regions.given.len(),
        };
        let numbers: Vec<f32> = bytemuck::pod_collect_to_vec(&copied(regions.memory, 2)?);
        Ok(StartMemory {
            coefficients: bytemuck::pod_collect_to_vec(&copied(regions.given.start, count)?),
            excursion_m: numbers[0],
            share: numbers[1],
        })
    }

    /// Copies the first `count` states of vertices from a buffer.
    fn vertex_states(&self, buffer: &Buffer, count: usize) -> Result<Vec<VertexState>, GpuError> {
        let bytes = (STATE_BYTES * count) as u64;
        let copied = self.asset.context.download(buffer, 0, bytes)?;
        let states: Vec<[Vec4; 2]> = bytemuck::pod_collect_to_vec(&copied);
        let vertex = |[value, previous]: &[Vec4; 2]| VertexState {
            value: value.truncate(),
            previous: previous.truncate(),
        };
        Ok(states.iter().map(vertex).collect())
    }
}

/// Packs states of vertices, each with its mask, in the memory layout of `vertex_state.wgsl`.
fn packed(states: &[VertexState], mask: impl Fn(usize) -> f32) -> Vec<[Vec4; 2]> {
    let states = states.iter().enumerate();
    states
        .map(|(vertex, state)| [state.value, state.previous].map(|v| v.extend(mask(vertex))))
        .collect()
}
