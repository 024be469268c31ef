//! The products of [`crate::product`] on Intel's matrix units (AMX): factors rounded to bf16, sums in f32.
//!
//! The intrinsics of the units are not stable, so that they are used by assembly. A block is 32 rows by 32 columns:
//! two tile registers of the left factor (16 rows × 32 numbers), two of the right one (16 pairs of rows × 16 columns),
//! four of sums. Both factors are converted once a call into buffers of the thread.

mod convert;

use std::{
    arch::{asm, x86_64::*},
    cell::RefCell,
};

use crate::buffer::Buffer;
use crate::panels::PANEL;
use crate::product::{Affine, Finish, Outer, Start};
use convert::{convert_columns, convert_pairs, convert_rows, convert_weights};
use unic_core::network::matrix_units;

/// Rows of a tile register; words in each of its rows.
const LANES: usize = 16;
/// Words of a tile register: pairs of bf16.
const REGISTER: usize = LANES * LANES;
/// Words of the two registers that a block reads at a time of each factor.
const PAIR: usize = 2 * REGISTER;
/// Sums of a block.
const BLOCK: usize = PANEL * PANEL;

/// Factors in bf16, two numbers a word, and the sums of one block; buffers of f32 for their alignment alone.
#[derive(Default)]
struct Scratch {
    left: Buffer,
    right: Buffer,
    sums: Buffer,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Does this processor have the units, and may this process use them?
pub(crate) fn is_available() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bf16")
        && is_x86_feature_detected!("avx512bw")
        && matrix_units::is_available()
}

/// As [`crate::product::affine`].
///
/// # Safety
/// The processor has the units, and `affine` has checked every slice.
pub(crate) unsafe fn affine(job: &Affine, output: *mut f32) {
    SCRATCH.with_borrow_mut(|scratch| {
        let (rows, panels) = (job.rows.len(), job.input.widths.len());
        let blocks = rows.div_ceil(PANEL);
        scratch.left.resize(blocks * panels * PAIR);
        scratch.right.resize(job.output_widths.len() * panels * PAIR);
        scratch.sums.resize(BLOCK);
        // SAFETY: the buffers hold `PAIR` words for every panel of every block; the rest is the caller's contract.
        unsafe {
            convert_rows(&job.input, job.rows.start, rows, &mut scratch.left);
            convert_weights(job, &mut scratch.right);
            affine_blocks(job, scratch, output);
        }
    });
}

/// As [`crate::product::outer`].
///
/// # Safety
/// The processor has the units, and `outer` has checked every slice.
pub(crate) unsafe fn outer(job: &Outer, target: *mut f32) {
    SCRATCH.with_borrow_mut(|scratch| {
        let steps = job.rows.div_ceil(PANEL);
        scratch.left.resize(job.gradient.widths.len() * steps * PAIR);
        scratch.right.resize(job.input.widths.len() * steps * PAIR);
        scratch.sums.resize(BLOCK);
        // SAFETY: the buffers hold `PAIR` words for every 32 rows of every panel; the rest is the caller's contract.
        unsafe {
            convert_columns(&job.gradient, job.rows, &mut scratch.left);
            convert_pairs(&job.input, job.rows, &mut scratch.right);
            outer_blocks(job, scratch, steps, target);
        }
    });
}

#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
unsafe fn affine_blocks(job: &Affine, scratch: &mut Scratch, output: *mut f32) {
    let (rows, panels) = (job.rows.len(), job.input.widths.len());
    let sums = scratch.sums.as_mut_ptr();
    // SAFETY: blocks end where their buffers do; rows and columns are those that `affine` has checked.
    unsafe {
        matrix_units::configure();
        for panel in 0..job.output_widths.len() {
            let weights = scratch.right.as_ptr().add(panel * panels * PAIR);
            for first in (0..rows).step_by(PANEL) {
                let count = PANEL.min(rows - first);
                let target = panel * job.input.stride + (job.rows.start + first) * PANEL;
                match job.start {
                    Start::Bias(bias) => repeat(bias.as_ptr().add(panel * PANEL), sums),
                    Start::Output => output.add(target).copy_to_nonoverlapping(sums, count * PANEL),
                }
                let input = scratch.left.as_ptr().add(first / PANEL * panels * PAIR);
                multiply(input, weights, panels, sums);
                finish(&job.finish, sums, target, count, output);
            }
        }
        matrix_units::release();
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
unsafe fn outer_blocks(job: &Outer, scratch: &mut Scratch, steps: usize, target: *mut f32) {
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

/// Sums of a block, `[32][32]`, plus the products of `steps` pairs of registers of each factor.
#[inline(always)]
unsafe fn multiply(left: *const f32, right: *const f32, steps: usize, sums: *mut f32) {
    debug_assert!(steps > 0);
    // SAFETY: the caller's contract: `steps` · [`PAIR`] words at `left` and `right`, a block at `sums`, units that
    // are configured. Nothing else is touched.
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

/// One row of 32 numbers to all rows of a block.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn repeat(row: *const f32, sums: *mut f32) {
    // SAFETY: 32 floats at `row`, a block at `sums`.
    unsafe {
        let halves = [_mm512_loadu_ps(row), _mm512_loadu_ps(row.add(LANES))];
        for line in 0..2 * PANEL {
            _mm512_storeu_ps(sums.add(line * LANES), halves[line % 2]);
        }
    }
}

/// `rows` rows of a block to their place, `target` floats into the output.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn finish(finish: &Finish, sums: *const f32, target: usize, rows: usize, output: *mut f32) {
    for line in (0..rows * PANEL).step_by(LANES) {
        // SAFETY: the block has `rows` rows; output and gate reach as far, by `affine`.
        unsafe {
            let sum = _mm512_loadu_ps(sums.add(line));
            let value = match finish {
                Finish::Keep => sum,
                // maxps returns its second operand when either is NaN.
                Finish::Relu => _mm512_max_ps(_mm512_setzero_ps(), sum),
                Finish::Gate(gate) => {
                    let gate = _mm512_loadu_ps(gate.as_ptr().add(target + line));
                    let is_open = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(gate, _mm512_setzero_ps());
                    _mm512_maskz_mov_ps(is_open, sum)
                }
            };
            _mm512_storeu_ps(output.add(target + line), value);
        }
    }
}
