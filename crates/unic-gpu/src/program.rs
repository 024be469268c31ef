//! Programs: lists of dispatches that run in one submission.

use crate::{GpuContext, GpuError, kernel::Dispatch};
use wgpu::{BufferUsages, CommandEncoder, Features, QuerySet};

/// Part of a frame with a time of its own.
#[derive(Clone, Debug)]
pub(crate) struct Stage {
    pub(crate) name: &'static str,
    pub(crate) dispatches: Vec<Dispatch>,
}

/// Work of the device in one call of an animator.
#[derive(Clone, Debug, Default)]
pub(crate) struct Program(Vec<Stage>);

/// Time of one stage of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageTime {
    /// Name of the stage.
    pub name: &'static str,
    /// Time by the device's own clock, milliseconds.
    pub ms: f64,
}

impl Program {
    /// Appends a stage, unless it is empty.
    pub(crate) fn stage(&mut self, name: &'static str, dispatches: Vec<Dispatch>) {
        if !dispatches.is_empty() {
            self.0.push(Stage { name, dispatches });
        }
    }

    /// Returns whether the work has a stage of this name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.0.iter().any(|stage| stage.name == name)
    }

    pub(crate) fn submit(&self, context: &GpuContext) {
        let mut encoder = context.device().create_command_encoder(&Default::default());
        self.record(&mut encoder);
        context.queue().submit([encoder.finish()]);
    }

    /// Submits the work, blocks until it is done, and returns the time of each stage. Times of
    /// stages with one name are summed.
    ///
    /// # Errors
    /// Fails when the device has no timestamps or is lost.
    pub(crate) fn submit_timed(&self, context: &GpuContext) -> Result<Vec<StageTime>, GpuError> {
        if !context.has(Features::TIMESTAMP_QUERY) {
            return Err(GpuError::Feature {
                what: "timing",
                feature: "TIMESTAMP_QUERY",
            });
        }
        let count = 2 * self.0.len() as u32;
        let queries = context.device().create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("times"),
            ty: wgpu::QueryType::Timestamp,
            count,
        });
        let bytes = u64::from(count) * 8;
        let resolved = context.zeroed("times", bytes as usize, BufferUsages::QUERY_RESOLVE);
        let mut encoder = context.device().create_command_encoder(&Default::default());
        self.record_timed(&mut encoder, &queries);
        encoder.resolve_query_set(&queries, 0..count, &resolved, 0);
        context.queue().submit([encoder.finish()]);
        let times = context.download(&resolved, 0, bytes)?;
        let ns_per_tick = f64::from(context.queue().get_timestamp_period());
        let (pairs, _) = times.as_chunks::<16>();
        let pairs = pairs
            .iter()
            .map(|pair| bytemuck::cast::<[u8; 16], [u64; 2]>(*pair));
        let mut times: Vec<StageTime> = Vec::new();
        for (stage, [from, to]) in self.0.iter().zip(pairs) {
            // Some drivers report an end before the start of a short pass.
            let ms = to.saturating_sub(from) as f64 * ns_per_tick * 1e-6;
            match times.iter_mut().find(|time| time.name == stage.name) {
                Some(time) => time.ms += ms,
                None => times.push(StageTime { name: stage.name, ms }),
            }
        }
        Ok(times)
    }

    /// Records all stages in one pass: every pass costs time on the host.
    fn record(&self, encoder: &mut CommandEncoder) {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        let dispatches = self.0.iter().flat_map(|stage| &stage.dispatches);
        dispatches.for_each(|dispatch| dispatch.record(&mut pass));
    }

    /// Records one pass for each stage, because timestamps are written at the ends of passes.
    fn record_timed(&self, encoder: &mut CommandEncoder, query_set: &QuerySet) {
        for (i, stage) in (0..).step_by(2).zip(&self.0) {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(stage.name),
                timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                    query_set,
                    beginning_of_pass_write_index: Some(i),
                    end_of_pass_write_index: Some(i + 1),
                }),
            });
            let dispatches = stage.dispatches.iter();
            dispatches.for_each(|dispatch| dispatch.record(&mut pass));
        }
    }
}
