//! The three products of training on tiles in panels ([`crate::panels`]), for every instruction set.
//!
//! Each output number is one chain of fused multiply-adds in the order of its inner index, whatever the lanes, so
//! every instruction set computes the same bytes. Matrix units are the exception: their factors are bf16.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m256, __m512};
use std::ops::Range;

use crate::blocks::{affine_strips, column_sums_lanes, outer_strips};
use crate::lanes::{InstructionSet, Quad};
use crate::panels::PANEL;

/// Where the sums of [`affine`] start.
#[derive(Clone, Copy)]
pub(crate) enum Start<'a> {
    /// At one value a column, panel after panel.
    Bias(&'a [f32]),
    /// At what the output holds.
    Output,
}

/// What happens to the sums of [`affine`] before they are stored.
#[derive(Clone, Copy)]
pub(crate) enum Finish<'a> {
    /// Nothing: the head, and gradients of inputs.
    Keep,
    /// max(0, ·): hidden layers.
    Relu,
    /// Zero where this tile, laid out as the output, is not positive: the gradient through a ReLU.
    Gate(&'a [f32]),
}

/// A tile seen by a product: panels whose rows lie `stride` floats a panel apart.
#[derive(Clone, Copy)]
pub(crate) struct Tile<'a> {
    pub(crate) data: &'a [f32],
    pub(crate) widths: &'a [usize],
    pub(crate) stride: usize,
}

/// `output = finish(start + input · weights)` for some rows of a tile.
pub(crate) struct Affine<'a> {
    pub(crate) input: Tile<'a>,
    /// For each output panel, for each input column, 32 floats.
    pub(crate) weights: &'a [f32],
    pub(crate) start: Start<'a>,
    pub(crate) finish: Finish<'a>,
    pub(crate) rows: Range<usize>,
    /// Columns in use in each output panel; strides are the input's.
    pub(crate) output_widths: &'a [usize],
    /// What the next product reads or writes: fetched into the second-level cache meanwhile, a share a block.
    /// Addresses alone, never followed.
    pub(crate) ahead: [Range<*const f32>; 2],
}

/// Nothing to fetch ahead.
pub(crate) fn nothing() -> Range<*const f32> {
    [].as_ptr_range()
}

/// Computes `job` into `output`.
pub(crate) fn affine(set: InstructionSet, job: &Affine, output: &mut [f32]) {
    let depth = job.input.widths.iter().sum::<usize>();
    let panels = job.output_widths.len();
    check_tile(&job.input, job.rows.end);
    assert!(job.weights.len() >= panels * depth * PANEL);
    assert!(output.len() >= tile_length(panels, job.input.stride, job.rows.end));
    assert!(job.output_widths.iter().all(|&width| width <= PANEL));
    match job.start {
        Start::Bias(bias) => assert!(bias.len() >= panels * PANEL),
        Start::Output => {}
    }
    match job.finish {
        Finish::Gate(gate) => assert!(gate.len() >= tile_length(panels, job.input.stride, job.rows.end)),
        Finish::Keep | Finish::Relu => {}
    }
    let output = output.as_mut_ptr();
    // SAFETY: every slice reaches as far as the loops read or write, and the set is one this processor runs: fields
    // refuse others.
    unsafe {
        match set {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Amx => crate::amx::affine(job, output),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => affine_avx512(job, output),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => affine_avx2(job, output),
            _ => affine_strips::<Quad, 4, 2>(job, output),
        }
    }
}

/// `sums += gradientᵀ · input` over the first `rows` rows: the gradient of a weight.
///
/// `sums` holds, for each input panel, for each column of `gradient`, 32 floats.
pub(crate) fn outer(set: InstructionSet, gradient: Tile, input: Tile, rows: usize, sums: &mut [f32]) {
    check_tile(&gradient, rows);
    check_tile(&input, rows);
    let outputs = gradient.widths.iter().sum::<usize>();
    assert!(sums.len() >= input.widths.len() * outputs * PANEL);
    assert!(
        gradient.widths.iter().rev().skip(1).all(|&width| width == PANEL),
        "one part"
    );
    let job = Outer {
        gradient,
        input,
        rows,
        outputs,
    };
    let sums = sums.as_mut_ptr();
    // SAFETY: as in `affine`.
    unsafe {
        match set {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Amx => crate::amx::outer(&job, sums),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => outer_avx512(&job, sums),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => outer_avx2(&job, sums),
            _ => outer_strips::<Quad, 4, 2>(&job, sums),
        }
    }
}

/// `sums += Σ over rows of tile`, one number a column, panel after panel: the gradient of a bias.
pub(crate) fn column_sums(set: InstructionSet, tile: Tile, rows: Range<usize>, sums: &mut [f32]) {
    check_tile(&tile, rows.end);
    assert!(sums.len() >= tile.widths.len() * PANEL);
    let sums = sums.as_mut_ptr();
    // SAFETY: as in `affine`.
    unsafe {
        match set {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Amx | InstructionSet::Avx512 => column_sums_avx512(&tile, rows, sums),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => column_sums_avx2(&tile, rows, sums),
            _ => column_sums_lanes::<Quad>(&tile, rows, sums),
        }
    }
}

fn check_tile(tile: &Tile, rows: usize) {
    assert!(tile.widths.iter().all(|&width| width <= PANEL));
    assert!(tile.data.len() >= tile_length(tile.widths.len(), tile.stride, rows));
}

fn tile_length(panels: usize, stride: usize, rows: usize) -> usize {
    assert!(rows * PANEL <= stride);
    panels * stride
}

/// The gradient of a weight, checked.
pub(crate) struct Outer<'a> {
    pub(crate) gradient: Tile<'a>,
    pub(crate) input: Tile<'a>,
    pub(crate) rows: usize,
    pub(crate) outputs: usize,
}

// Rows and registers a block: 12 x 2 = 24 sums fill most of AVX-512's 32 registers and need 14 loads for 24
// multiply-adds; 6 x 2 does the same for AVX2's 16 registers.
#[cfg(target_arch = "x86_64")]
macro_rules! entry_points {
    ($feature:literal, $register:ty, $affine_rows:literal, $outer_rows:literal,
     $affine:ident, $outer:ident, $column_sums:ident) => {
        #[target_feature(enable = $feature)]
        fn $affine(job: &Affine, output: *mut f32) {
            // SAFETY: checked by `affine`, the only caller.
            unsafe { affine_strips::<$register, $affine_rows, 2>(job, output) }
        }

        #[target_feature(enable = $feature)]
        fn $outer(job: &Outer, sums: *mut f32) {
            // SAFETY: checked by `outer`, the only caller.
            unsafe { outer_strips::<$register, $outer_rows, 2>(job, sums) }
        }

        #[target_feature(enable = $feature)]
        fn $column_sums(tile: &Tile, rows: Range<usize>, sums: *mut f32) {
            // SAFETY: checked by `column_sums`, the only caller.
            unsafe { column_sums_lanes::<$register>(tile, rows, sums) }
        }
    };
}

#[cfg(target_arch = "x86_64")]
entry_points!(
    "avx512f",
    __m512,
    12,
    8,
    affine_avx512,
    outer_avx512,
    column_sums_avx512
);
#[cfg(target_arch = "x86_64")]
entry_points!(
    "avx2,fma",
    __m256,
    6,
    4,
    affine_avx2,
    outer_avx2,
    column_sums_avx2
);
