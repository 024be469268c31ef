//! The products of [`crate::product`] on Intel's matrix units (AMX), with factors in bf16 and sums
//! in f32.
//!
//! The units are driven by inline assembly, because their intrinsics are not stable in Rust. A
//! block of sums has 32 rows and 32 columns and uses all eight tile registers:
//!
//! - two for the left factor, each of 16 rows × 32 values,
//! - two for the right factor, each of 16 pairs of rows × 16 columns,
//! - four for the sums.
//!
//! Both factors are converted once per call, into buffers of the thread.

mod convert;

use std::{
    arch::{asm, x86_64::*},
    cell::RefCell,
};

use crate::buffer::Buffer;
use crate::panels::PANEL;
use crate::product::{AffineProduct, Epilogue, InitialSum, OuterProduct};
use convert::{convert_columns, convert_pairs, convert_rows, convert_weights};
use unic_core::simd::matrix_units;

/// Number of rows of a tile register, and number of 32-bit words in each of its rows.
const LANES: usize = 16;
/// Number of words of a tile register. A word of a factor holds two bf16 values.
const REGISTER: usize = LANES * LANES;
/// Number of words of the two registers that a block loads at a time from each factor.
const PAIR: usize = 2 * REGISTER;
/// Number of sums of a block.
const BLOCK: usize = PANEL * PANEL;

/// Buffers of one thread. The factors hold two bf16 values per word; they are f32 buffers for the
/// alignment only.
#[derive(Default)]
struct Scratch {
    /// The left factor.
    left: Buffer,
    /// The right factor.
    right: Buffer,
    /// The sums of one block.
    sums: Buffer,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Returns whether this processor has matrix units and the system lets this process use them.
pub(crate) fn is_available() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bf16")
        && is_x86_feature_detected!("avx512bw")
        && matrix_units::is_available()
}

/// Computes [`crate::product::affine`] on matrix units.
///
/// # Safety
/// [`is_available`] must hold, and `affine` must have checked every slice.
pub(crate) unsafe fn affine(job: &AffineProduct, output: *mut f32) {
    SCRATCH.with_borrow_mut(|scratch| {
        let (rows, panels) = (job.rows.len(), job.input.widths.len());
        let blocks = rows.div_ceil(PANEL);
        scratch.left.resize(blocks * panels * PAIR);
        scratch.right.resize(job.output_widths.len() * panels * PAIR);
        scratch.sums.resize(BLOCK);
        // SAFETY: the buffers hold `PAIR` words for every panel of every block; the caller
        // guarantees the rest.
        unsafe {
            convert_rows(&job.input, job.rows.start, rows, &mut scratch.left);
            convert_weights(job, &mut scratch.right);
            affine_blocks(job, scratch, output);
        }
    });
}

/// Computes [`crate::product::outer`] on matrix units.
///
/// # Safety
/// [`is_available`] must hold, and `outer` must have checked every slice.
pub(crate) unsafe fn outer(job: &OuterProduct, target: *mut f32) {
    SCRATCH.with_borrow_mut(|scratch| {
        let steps = job.rows.div_ceil(PANEL);
        scratch.left.resize(job.gradient.widths.len() * steps * PAIR);
        scratch.right.resize(job.input.widths.len() * steps * PAIR);
        scratch.sums.resize(BLOCK);
        // SAFETY: the buffers hold `PAIR` words for every 32 rows of every panel; the caller
        // guarantees the rest.
        unsafe {
            convert_columns(&job.gradient, job.rows, &mut scratch.left);
            convert_pairs(&job.input, job.rows, &mut scratch.right);
            outer_blocks(job, scratch, steps, target);
        }
    });
}

#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
unsafe fn affine_blocks(job: &AffineProduct, scratch: &mut Scratch, output: *mut f32) {
    let (rows, panels) = (job.rows.len(), job.input.widths.len());
    let sums = scratch.sums.as_mut_ptr();
    // SAFETY: blocks end where their buffers do; `affine` has checked all rows and columns.
    unsafe {
        matrix_units::configure();
        for panel in 0..job.output_widths.len() {
            let weights = scratch.right.as_ptr().add(panel * panels * PAIR);
            for first in (0..rows).step_by(PANEL) {
                let count = PANEL.min(rows - first);
                let target = panel * job.input.stride + (job.rows.start + first) * PANEL;
                match job.initial {
                    InitialSum::Bias(bias) => broadcast_row(bias.as_ptr().add(panel * PANEL), sums),
                    InitialSum::Output => output.add(target).copy_to_nonoverlapping(sums, count * PANEL),
                }
                let input = scratch.left.as_ptr().add(first / PANEL * panels * PAIR);
                multiply(input, weights, panels, sums);
                store(&job.epilogue, sums, target, count, output);
            }
        }
        // Tile registers that are in use make every context switch slower.
        matrix_units::release();
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
unsafe fn outer_blocks(job: &OuterProduct, scratch: &mut Scratch, steps: usize, target: *mut f32) {
    let sums = scratch.sums.as_mut_ptr();
    // SAFETY: as in `affine_blocks`.
    unsafe {
        matrix_units::configure();
        for input in 0..job.input.widths.len() {
            let right = scratch.right.as_ptr().add(input * steps * PAIR);
            let mut column = 0;
            for (gradient, &width) in job.gradient.widths.iter().enumerate() {
                let left = scratch.left.as_ptr().add(gradient * steps * PAIR);
                sums.write_bytes(0, BLOCK);
                multiply(left, right, steps, sums);
                let target = target.add((input * job.outputs + column) * PANEL);
                for line in (0..width * PANEL).step_by(LANES) {
                    let sum =
                        _mm512_add_ps(_mm512_loadu_ps(target.add(line)), _mm512_loadu_ps(sums.add(line)));
                    _mm512_storeu_ps(target.add(line), sum);
                }
                column += width;
            }
        }
        matrix_units::release();
    }
}

/// Adds the products of `steps` pairs of registers of each factor to the sums of a block,
/// `[32][32]`.
#[inline(always)]
unsafe fn multiply(left: *const f32, right: *const f32, steps: usize, sums: *mut f32) {
    // The loop tests at its end, so that it would not stop for zero steps.
    debug_assert!(steps > 0);
    // Registers 0 to 3 are sums, 4 and 5 the left factor, 6 and 7 the right one. Loads of the
    // second left register overlap with the first product.
    //
    // SAFETY: the caller guarantees `steps` · `PAIR` words at `left` and `right`, a block at `sums`
    // and units that are configured. The code accesses nothing else.
    unsafe {
        asm!(
            "tileloadd tmm0, [{sums} + {row}]",
            "tileloadd tmm1, [{sums} + {row} + 64]",
            "tileloadd tmm2, [{under} + {row}]",
            "tileloadd tmm3, [{under} + {row} + 64]",
            "2:",
            "tileloadd tmm4, [{left} + {line}]",
            "tileloadd tmm6, [{right} + {line}]",
            "tileloadd tmm7, [{right} + {line} + 1024]",
            "tdpbf16ps tmm0, tmm4, tmm6",
            "tileloadd tmm5, [{left} + {line} + 1024]",
            "tdpbf16ps tmm1, tmm4, tmm7",
            "tdpbf16ps tmm2, tmm5, tmm6",
            "tdpbf16ps tmm3, tmm5, tmm7",
            "add {left}, 2048",
            "add {right}, 2048",
            "dec {steps}",
            "jnz 2b",
            "tilestored [{sums} + {row}], tmm0",
            "tilestored [{sums} + {row} + 64], tmm1",
            "tilestored [{under} + {row}], tmm2",
            "tilestored [{under} + {row} + 64], tmm3",
            left = inout(reg) left => _,
            right = inout(reg) right => _,
            steps = inout(reg) steps => _,
            sums = in(reg) sums,
            under = in(reg) sums.add(BLOCK / 2),
            row = in(reg) PANEL * size_of::<f32>(),
            line = in(reg) LANES * size_of::<f32>(),
            out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
            out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
            options(nostack)
        );
    }
}

/// Copies one row of 32 values to all rows of a block.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn broadcast_row(row: *const f32, sums: *mut f32) {
    // SAFETY: 32 floats at `row`, a block at `sums`.
    unsafe {
        let halves = [_mm512_loadu_ps(row), _mm512_loadu_ps(row.add(LANES))];
        for line in 0..2 * PANEL {
            _mm512_storeu_ps(sums.add(line * LANES), halves[line % 2]);
        }
    }
}

/// Applies the epilogue to the first `rows` rows of a block and stores them in the output, from the
/// offset `target` on.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn store(epilogue: &Epilogue, sums: *const f32, target: usize, rows: usize, output: *mut f32) {
    for line in (0..rows * PANEL).step_by(LANES) {
        // SAFETY: the block has `rows` rows; `affine` has checked that output and activations
        // contain them.
        unsafe {
            let sum = _mm512_loadu_ps(sums.add(line));
            let value = match epilogue {
                Epilogue::Identity => sum,
                // maxps returns its second operand when either is NaN, so that NaN is not hidden.
                Epilogue::Relu => _mm512_max_ps(_mm512_setzero_ps(), sum),
                Epilogue::ReluGradient(activations) => {
                    let activation = _mm512_loadu_ps(activations.as_ptr().add(target + line));
                    let is_active = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(activation, _mm512_setzero_ps());
                    _mm512_maskz_mov_ps(is_active, sum)
                }
            };
            _mm512_storeu_ps(output.add(target + line), value);
        }
    }
}
