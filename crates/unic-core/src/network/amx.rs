//! Kernel of Intel's matrix units (AMX) for bf16 and int8, which have 16 and 32 times the
//! multiply-adds of AVX-512 in f32.
//!
//! It is written in assembly, because the intrinsics are not stable in Rust. A block is 32 outputs
//! by 32 vertices: two tile registers of weights (16 outputs × 16 words), two of activations (16
//! words × 16 vertices) and four of sums.
//!
//! Weights stream from the second-level cache. `tileloaddt1` keeps them from displacing the
//! activations in the first-level cache, which makes the kernel a tenth faster.

use super::{
    arithmetic::{Arithmetic, Bf16, F32, Int8},
    kernel::{Kernel, Registers},
    words::x86::{Zmm, ZmmUnfused},
};
use crate::simd::matrix_units;
use std::arch::{asm, x86_64::__m512};

/// Rows of a tile register, and words in each row.
const TILE_ROWS: usize = 16;
/// Words of a tile register.
const TILE_WORDS: usize = TILE_ROWS * TILE_ROWS;

/// Kernel for words of format `A`: products on matrix units, everything else on AVX-512.
pub(super) struct MatrixUnits<A>(A);

macro_rules! matrix_units {
    ($arithmetic:ty, $head:ty, $multiply:literal) => {
        impl Kernel for MatrixUnits<$arithmetic> {
            type Arithmetic = $arithmetic;
            type Head = Registers<$head, $head, 8, 2>;
            type Float = __m512;
            const ROWS: usize = 2 * TILE_ROWS;
            const PADDED: usize = TILE_ROWS * <$arithmetic as Arithmetic>::CHANNELS;

            // A tile register multiplies 32 channels or more at once, which are rarely all zero.
            const SKIPS_ZEROS: bool = false;

            // Weights are stored in the order in which the loop below loads tile registers.
            fn place(row: usize, group: usize, _: usize) -> usize {
                let tile = 2 * (group / TILE_ROWS) + row / TILE_ROWS;
                tile * TILE_WORDS + row % TILE_ROWS * TILE_ROWS + group % TILE_ROWS
            }

            #[inline(always)]
            unsafe fn begin() {
                // SAFETY: the caller has AMX.
                unsafe { matrix_units::configure() }
            }

            #[inline(always)]
            unsafe fn end() {
                // SAFETY: the caller has AMX.
                unsafe { matrix_units::release() }
            }

            #[inline(always)]
            unsafe fn block<const W: usize>(
                weights: &[u32],
                words: &[u32],
                _: &[u32],
                sums: &mut [<$arithmetic as Arithmetic>::Sum],
            ) {
                const { assert!(W.is_multiple_of(Self::ROWS)) };
                let tiles = weights.len() / (2 * TILE_WORDS);
                assert!(tiles > 0 && words.len() >= tiles * TILE_ROWS * W && sums.len() >= Self::ROWS * W);
                for vertex in (0..W).step_by(Self::ROWS) {
                    // SAFETY: the slices hold `tiles` registers of weights for each half of the
                    // outputs, `tiles` · 16 rows of activations and 32 rows of sums.
                    unsafe {
                        let (weights, sums) = (weights.as_ptr(), sums.as_mut_ptr().add(vertex));
                        // tmm0-3 hold sums, tmm4-5 weights, tmm6-7 activations. Loads stand between
                        // products, so that the units do not wait for them.
                        asm!(
                            "tilezero tmm0",
                            "tilezero tmm1",
                            "tilezero tmm2",
                            "tilezero tmm3",
                            "2:",
                            "tileloadd tmm6, [{words} + {row}]",
                            "tileloaddt1 tmm4, [{weights} + {line}]",
                            "tileloadd tmm7, [{words} + {row} + 64]",
                            concat!($multiply, " tmm0, tmm4, tmm6"),
                            "tileloaddt1 tmm5, [{weights} + {line} + 1024]",
                            concat!($multiply, " tmm1, tmm4, tmm7"),
                            concat!($multiply, " tmm2, tmm5, tmm6"),
                            concat!($multiply, " tmm3, tmm5, tmm7"),
                            "add {weights}, 2048",
                            "add {words}, {step}",
                            "dec {tiles}",
                            "jnz 2b",
                            "tilestored [{sums} + {row}], tmm0",
                            "tilestored [{sums} + {row} + 64], tmm1",
                            "tilestored [{under} + {row}], tmm2",
                            "tilestored [{under} + {row} + 64], tmm3",
                            words = inout(reg) words.as_ptr().add(vertex) => _,
                            weights = inout(reg) weights => _,
                            tiles = inout(reg) tiles => _,
                            sums = in(reg) sums,
                            under = in(reg) sums.add(TILE_ROWS * W),
                            row = in(reg) W * size_of::<u32>(),
                            line = in(reg) TILE_ROWS * size_of::<u32>(),
                            step = in(reg) TILE_ROWS * W * size_of::<u32>(),
                            out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
                            out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
                            options(nostack)
                        );
                    }
                }
            }
        }
    };
}

matrix_units!(Bf16, Zmm<F32>, "tdpbf16ps");
matrix_units!(Int8, ZmmUnfused<F32>, "tdpbsud");
