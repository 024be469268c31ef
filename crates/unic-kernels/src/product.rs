//! The three matrix products of training, on tiles in panels ([`crate::panels`]), for every
//! instruction set.
//!
//! Each output value is one chain of fused multiply-adds in the order of the inner index, however
//! many lanes there are. Every instruction set therefore computes the same bytes. Matrix units are
//! the exception, because their factors are bf16.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m256, __m512};
use std::ops::Range;

use crate::microkernels::{affine_strips, column_sums_kernel, outer_strips};
use crate::panels::PANEL;
use crate::simd::{F32x4, InstructionSet};

/// Initial values of the sums of [`affine`].
#[derive(Clone, Copy)]
pub(crate) enum InitialSum<'a> {
    /// A bias: one value per column, panel after panel.
    Bias(&'a [f32]),
    /// The current contents of the output.
    Output,
}

/// Operation on the sums of [`affine`] before they are stored.
#[derive(Clone, Copy)]
pub(crate) enum Epilogue<'a> {
    /// No operation: for the head, and for gradients of the points' inputs.
    Identity,
    /// ReLU, max(0, ·): for hidden layers.
    Relu,
    /// Gradient of a ReLU: zero where the activation is not positive. The slice holds the
    /// activations in the layout of the output.
    ReluGradient(&'a [f32]),
}

/// A tile as an operand of a product.
#[derive(Clone, Copy)]
pub(crate) struct Tile<'a> {
    pub(crate) data: &'a [f32],
    /// Number of used columns of each panel.
    pub(crate) widths: &'a [usize],
    /// Number of floats from one panel to the next.
    pub(crate) stride: usize,
}

/// The product `output = epilogue(initial + input · weights)` for some rows of a tile.
pub(crate) struct AffineProduct<'a> {
    pub(crate) input: Tile<'a>,
    /// Packed weights: for each output panel, for each input column, 32 floats.
    pub(crate) weights: &'a [f32],
    pub(crate) initial: InitialSum<'a>,
    pub(crate) epilogue: Epilogue<'a>,
    /// Rows of the input and of the output.
    pub(crate) rows: Range<usize>,
    /// Number of used columns of each output panel; the output has the stride of the input.
    pub(crate) output_widths: &'a [usize],
    /// Memory that the next product accesses. Parts of it are prefetched into the second-level
    /// cache after each block. The pointers are never dereferenced.
    pub(crate) prefetch: [Range<*const f32>; 2],
}

/// Returns an empty range to prefetch.
pub(crate) fn no_prefetch() -> Range<*const f32> {
    [].as_ptr_range()
}

/// Computes an affine product into `output`.
pub(crate) fn affine(set: InstructionSet, job: &AffineProduct, output: &mut [f32]) {
    let depth = job.input.widths.iter().sum::<usize>();
    let panels = job.output_widths.len();
    check_tile(&job.input, job.rows.end);
    assert!(job.weights.len() >= panels * depth * PANEL);
    assert!(output.len() >= tile_length(panels, job.input.stride, job.rows.end));
    assert!(job.output_widths.iter().all(|&width| width <= PANEL));
    match job.initial {
        InitialSum::Bias(bias) => assert!(bias.len() >= panels * PANEL),
        InitialSum::Output => {}
    }
    match job.epilogue {
        Epilogue::ReluGradient(activations) => {
            assert!(activations.len() >= tile_length(panels, job.input.stride, job.rows.end));
        }
        Epilogue::Identity | Epilogue::Relu => {}
    }
    let output = output.as_mut_ptr();
    // SAFETY: the assertions above cover all reads and writes of the loops. The processor runs the
    // set, because no field is created with another one.
    unsafe {
        match set {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Amx => crate::amx::affine(job, output),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => affine_avx512(job, output),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => affine_avx2(job, output),
            _ => affine_strips::<F32x4, 4, 2>(job, output),
        }
    }
}

/// Computes the gradient of a weight: `sums += gradientᵀ · input` over the first `rows` rows.
///
/// `sums` holds, for each input panel, for each column of `gradient`, 32 floats.
pub(crate) fn outer(set: InstructionSet, gradient: Tile, input: Tile, rows: usize, sums: &mut [f32]) {
    check_tile(&gradient, rows);
    check_tile(&input, rows);
    let outputs = gradient.widths.iter().sum::<usize>();
    assert!(sums.len() >= input.widths.len() * outputs * PANEL);
    // Outputs are counted over used columns, so that only the last panel may have unused ones.
    assert!(
        gradient.widths.iter().rev().skip(1).all(|&width| width == PANEL),
        "all panels but the last are full"
    );
    let job = OuterProduct {
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
            _ => outer_strips::<F32x4, 4, 2>(&job, sums),
        }
    }
}

/// Computes the gradient of a bias: adds the sum over some rows of a tile to `sums`, which holds
/// one value per column, panel after panel.
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
            _ => column_sums_kernel::<F32x4>(&tile, rows, sums),
        }
    }
}

fn check_tile(tile: &Tile, rows: usize) {
    assert!(tile.widths.iter().all(|&width| width <= PANEL));
    assert!(tile.data.len() >= tile_length(tile.widths.len(), tile.stride, rows));
}

/// Returns the length of a tile in floats. Panics when its rows do not fit into the stride.
fn tile_length(panels: usize, stride: usize, rows: usize) -> usize {
    assert!(rows * PANEL <= stride);
    panels * stride
}

/// The operands of [`outer`], after all checks.
pub(crate) struct OuterProduct<'a> {
    pub(crate) gradient: Tile<'a>,
    pub(crate) input: Tile<'a>,
    pub(crate) rows: usize,
    /// Number of columns of `gradient`.
    pub(crate) outputs: usize,
}

// Sizes of a block, in rows × vectors. For affine products on AVX-512 it is 12 × 2: 24 sums fill
// most of the 32 registers and need 14 loads for 24 multiply-adds. AVX2 has 16 registers and takes
// 6 × 2.
#[cfg(target_arch = "x86_64")]
macro_rules! entry_points {
    ($feature:literal, $register:ty, $affine_rows:literal, $outer_rows:literal,
     $affine:ident, $outer:ident, $column_sums:ident) => {
        #[target_feature(enable = $feature)]
        fn $affine(job: &AffineProduct, output: *mut f32) {
            // SAFETY: `affine`, the only caller, has checked all slices.
            unsafe { affine_strips::<$register, $affine_rows, 2>(job, output) }
        }

        #[target_feature(enable = $feature)]
        fn $outer(job: &OuterProduct, sums: *mut f32) {
            // SAFETY: `outer`, the only caller, has checked all slices.
            unsafe { outer_strips::<$register, $outer_rows, 2>(job, sums) }
        }

        #[target_feature(enable = $feature)]
        fn $column_sums(tile: &Tile, rows: Range<usize>, sums: *mut f32) {
            // SAFETY: `column_sums`, the only caller, has checked all slices.
            unsafe { column_sums_kernel::<$register>(tile, rows, sums) }
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
