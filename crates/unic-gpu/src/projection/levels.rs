//! Coarse levels of the strain projection on the device.

use super::{
    packed::Constraints,
    sweep::{Positions, Sweep},
};
use crate::{
    GpuContext, GpuError,
    animator::Buffers,
    kernel::{Dispatch, GROUP, Kernel, Source},
};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use unic_core::{
    projection::{self, Freedom, LevelSmoothing},
    sampling::{InterpolationRow, NEIGHBOURS},
};
use wgpu::Buffer;

/// Bytes of the starts of a sample in `levels.wgsl`.
pub(crate) const SAMPLE_START_BYTES: usize = 2 * 16;

/// Coarse levels of one garment on the device. Asset.
#[derive(Debug)]
pub(crate) struct Levels {
    samples: usize,
    vertices: usize,
    /// Sweeps of a level in a tick.
    sweeps: usize,
    sample_vertices: Buffer,
    /// Rows of the finest level, those of all vertices.
    vertex_rows: Buffer,
    levels: Vec<Level>,
    kernels: Kernels,
}

/// One level: its chords and stencils, and the rows of what follows them.
#[derive(Debug)]
struct Level {
    /// Sweep over the chords, then over the stencils, if there is smoothing.
    sweep: Sweep,
    rows: Buffer,
    /// Factor of what each row's target takes: 0 for samples that the chords move.
    freedom: Buffer,
    row_count: usize,
}

/// Interpolation in the memory layout of `levels.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Row {
    samples: [u32; NEIGHBOURS],
    weights: [f32; NEIGHBOURS],
}

/// Compiled kernels of `levels.wgsl`, by their entry points.
#[derive(Debug)]
struct Kernels {
    gather_samples: Kernel,
    start_level: Kernel,
    carry_samples: Kernel,
    follow_samples: Kernel,
}

impl Levels {
    /// Uploads the levels; none for a garment without any.
    pub(crate) fn new(
        context: &GpuContext,
        levels: &projection::Levels,
        freedom: &Freedom,
        rest: &[Vec3],
    ) -> Option<Self> {
        let sample_rest: Vec<Vec3> = levels.samples().iter().map(|&v| rest[v as usize]).collect();
        let sweep = |level: &projection::Level| {
            let constraints = Constraints {
                edges: level.chord_colours().collect(),
                stencils: match levels.smoothing() {
                    LevelSmoothing::Off => Vec::new(),
                    LevelSmoothing::AfterEachSweep => level.stencil_colours().collect(),
                },
                freedom: levels.freedom(),
                rest: &sample_rest,
            };
            Sweep::new(context, &constraints)
        };
        let (finest, coarser) = levels.levels().split_last()?;
        let vertices = finest.rows().len() as u32;
        let coarser = coarser.iter().map(|level| {
            let next = level.samples() + level.rows().len();
            // Samples that the chords have moved have no rows of their own.
            let moves = |sample: u32| match sample < level.samples() as u32 {
                true => 0.0,
                false => levels.freedom().of(sample),
            };
            let freedom: Vec<f32> = (0..next as u32).map(moves).collect();
            let mut rows = vec![Row::zeroed(); level.samples()];
            rows.extend(level.rows().iter().map(packed_row));
            Level::new(context, sweep(level), &rows, &freedom)
        });
        let rows: Vec<Row> = finest.rows().iter().map(packed_row).collect();
        let moves: Vec<f32> = (0..vertices).map(|v| freedom.of(v)).collect();
        let last = Level::new(context, sweep(finest), &rows, &moves);
        Some(Self {
            samples: levels.samples().len(),
            vertices: rows.len(),
            vertex_rows: last.rows.clone(),
            sweeps: levels.sweeps(),
            sample_vertices: context.upload("sample vertices", levels.samples()),
            levels: coarser.chain(std::iter::once(last)).collect(),
            kernels: Kernels::new(context),
        })
    }

    /// Vertices that are samples.
    pub(super) fn sample_vertices(&self) -> &Buffer {
        &self.sample_vertices
    }

    /// Interpolation of all vertices from the samples.
    pub(super) fn vertex_rows(&self) -> &Buffer {
        &self.vertex_rows
    }

    /// Number of sums in the buffer of bends.
    pub(crate) fn bends(&self) -> usize {
        let levels = self.levels.iter().map(|level| level.sweep.bends());
        levels.max().unwrap_or(0)
    }

    /// Makes the dispatches that bring the chords into their limits, smooth the moves of the samples
    /// and move all vertices along.
    pub(crate) fn solve(
        &self,
        buffers: &Buffers,
        positions: &mut Positions,
        rounds: usize,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let kernels = &self.kernels;
        let (projected, starts) = ((18, positions.now), (29, &buffers.sample_starts));
        let mut samples = Positions::new(&buffers.samples);
        let gather = [projected, (23, samples.now), starts, (24, &self.sample_vertices)];
        let groups = |count: usize| count.div_ceil(GROUP);
        let mut dispatches = vec![kernels.gather_samples.dispatch(&gather, groups(self.samples))?];
        for (i, level) in self.levels.iter().enumerate() {
            if i > 0 {
                let bindings = [(23, samples.now), starts];
                dispatches.push(kernels.start_level.dispatch(&bindings, groups(self.samples))?);
            }
            let times = rounds * self.sweeps;
            dispatches.extend(level.sweep.measure_bends(samples.now, &buffers.bends)?);
            dispatches.extend(level.sweep.run(&mut samples, &buffers.bends, times)?);
            let now = (23, samples.now);
            let (rows, freedom) = ((27, &level.rows), (28, &level.freedom));
            dispatches.push(if i + 1 < self.levels.len() {
                let bindings = [now, starts, rows, freedom];
                (kernels.carry_samples).dispatch(&bindings, groups(level.row_count))?
            } else {
                let bindings = [projected, now, starts, rows, freedom];
                (kernels.follow_samples).dispatch(&bindings, groups(self.vertices))?
            });
        }
        Ok(dispatches)
    }
}

impl Level {
    /// Uploads a level, given its sweep and the factor of each row's target.
    fn new(context: &GpuContext, sweep: Sweep, rows: &[Row], targets: &[f32]) -> Self {
        Self {
            sweep,
            rows: context.upload("sample rows", rows),
            freedom: context.upload("sample freedom", targets),
            row_count: rows.len(),
        }
    }
}

fn packed_row(row: &InterpolationRow) -> Row {
    Row {
        samples: row.samples,
        weights: row.weights,
    }
}

impl Kernels {
    fn new(context: &GpuContext) -> Self {
        let kernel = |entry: &str| {
            let source = Source {
                text: include_str!("../kernels/levels.wgsl"),
                entry,
                constants: &[],
            };
            Kernel::new(context, &source)
        };
        Self {
            gather_samples: kernel("gather_samples"),
            start_level: kernel("start_level"),
            carry_samples: kernel("carry_samples"),
            follow_samples: kernel("follow_samples"),
        }
    }
}
