//! Coarse levels of the strain projection on the device.

use crate::{
    GpuContext, GpuError,
    animator::Buffers,
    kernel::{Dispatch, GROUP, Kernel, Source},
    projection::{PackedEdge, packed_edge},
};
use bytemuck::{Pod, Zeroable};
use unic_core::{
    projection::{self, Freedom, LEAST_LENGTH},
    sampling::{InterpolationRow, NEIGHBOURS},
};
use wgpu::Buffer;

/// Bytes of a sample in `levels.wgsl`.
pub(crate) const SAMPLE_BYTES: usize = 3 * 16;

/// Coarse levels of one garment on the device. Asset.
#[derive(Debug)]
pub(crate) struct Levels {
    samples: usize,
    vertices: usize,
    sample_vertices: Buffer,
    levels: Vec<Level>,
    kernels: Kernels,
}

/// One level: its chords, and the rows of what follows them.
#[derive(Debug)]
struct Level {
    chords: Buffer,
    /// End of each colour in `chords`.
    ends: Buffer,
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
    sweep_chords: Kernel,
    carry_samples: Kernel,
    follow_samples: Kernel,
}

impl Levels {
    /// Uploads the levels; none for a garment without any.
    pub(crate) fn new(context: &GpuContext, levels: &projection::Levels, freedom: &Freedom) -> Option<Self> {
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
            Level::new(context, level, levels.freedom(), &rows, &freedom)
        });
        let rows: Vec<Row> = finest.rows().iter().map(packed_row).collect();
        let moves: Vec<f32> = (0..vertices).map(|v| freedom.of(v)).collect();
        let last = Level::new(context, finest, levels.freedom(), &rows, &moves);
        Some(Self {
            samples: levels.samples().len(),
            vertices: rows.len(),
            sample_vertices: context.upload("sample vertices", levels.samples()),
            levels: coarser.chain(std::iter::once(last)).collect(),
            kernels: Kernels::new(context, levels),
        })
    }

    /// Makes the dispatches that bring the chords into their limits and move all vertices along.
    pub(crate) fn solve(&self, buffers: &Buffers, rounds: usize) -> Result<Vec<Dispatch>, GpuError> {
        let kernels = &self.kernels;
        let (projected, samples) = ((18, &buffers.projected), (23, &buffers.samples));
        let gather = [projected, samples, (24, &self.sample_vertices)];
        let groups = |count: usize| count.div_ceil(GROUP);
        let start = (kernels.start_level).dispatch(&[samples], groups(self.samples))?;
        let mut dispatches = vec![kernels.gather_samples.dispatch(&gather, groups(self.samples))?];
        for (i, level) in self.levels.iter().enumerate() {
            let chords = [samples, (25, &level.chords), (26, &level.ends)];
            let sweep = kernels.sweep_chords.dispatch(&chords, 1)?;
            let (rows, freedom) = ((27, &level.rows), (28, &level.freedom));
            if i > 0 {
                dispatches.push(start.clone());
            }
            dispatches.extend(std::iter::repeat_n(sweep, rounds));
            dispatches.push(if i + 1 < self.levels.len() {
                let bindings = [samples, rows, freedom];
                (kernels.carry_samples).dispatch(&bindings, groups(level.row_count))?
            } else {
                let bindings = [projected, samples, rows, freedom];
                (kernels.follow_samples).dispatch(&bindings, groups(self.vertices))?
            });
        }
        Ok(dispatches)
    }
}

impl Level {
    /// Uploads a level, given the freedom of the samples and the factor of each row's target.
    fn new(
        context: &GpuContext,
        level: &projection::Level,
        samples: &Freedom,
        rows: &[Row],
        targets: &[f32],
    ) -> Self {
        let mut chords: Vec<PackedEdge> = Vec::new();
        let mut ends: Vec<u32> = Vec::new();
        for colour in level.chord_colours() {
            chords.extend(colour.iter().map(|chord| packed_edge(chord, samples)));
            ends.push(chords.len() as u32);
        }
        Self {
            chords: context.upload("chords", &chords),
            ends: context.upload("chord colours", &ends),
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
    fn new(context: &GpuContext, levels: &projection::Levels) -> Self {
        let kernel = |entry: &str, constants: &[(&str, f64)]| {
            let source = Source {
                text: include_str!("kernels/levels.wgsl"),
                entry,
                constants,
            };
            Kernel::new(context, &source)
        };
        let sweeps = ("SWEEPS", levels.sweeps() as f64);
        let least = ("LEAST_LENGTH", f64::from(LEAST_LENGTH));
        Self {
            gather_samples: kernel("gather_samples", &[]),
            start_level: kernel("start_level", &[]),
            sweep_chords: kernel("sweep_chords", &[sweeps, least]),
            carry_samples: kernel("carry_samples", &[]),
            follow_samples: kernel("follow_samples", &[]),
        }
    }
}
