//! Intel's matrix units (AMX) for bf16 and int8: 16 and 32 times the multiply-adds of AVX-512 in f32.
//!
//! The intrinsics are not stable, assembly is. A block is 32 outputs by 32 vertices: two tile registers
//! of weights (16 outputs × 16 words), two of activations (16 words × 16 vertices), four of sums. Weights
//! stream from the second-level cache; that they are not to stay in the first (`tileloaddt1`) leaves it to the
//! activations: a tenth more is done.

use super::{
    arithmetic::{Arithmetic, Bf16, F32, Int8},
    kernel::{Kernel, Registers},
    matrix_units,
    words::x86::{Zmm, ZmmUnfused},
};
use std::arch::{asm, x86_64::__m512};

/// Rows of a tile register, words in each of its rows.
const TILE_ROWS: usize = 16;
/// Words of a tile register.
const TILE_WORDS: usize = TILE_ROWS * TILE_ROWS;

/// Products of words of `A` on matrix units, AVX-512 for the rest.
pub(super) struct Matrix<A>(A);

macro_rules! matrix {
    ($arithmetic:ty, $head:ty, $multiply:literal) => {
        impl Kernel for Matrix<$arithmetic> {
            type Arithmetic = $arithmetic;
            type Head = Registers<$head, $head, 8, 2>;
            type Float = __m512;
            const ROWS: usize = 2 * TILE_ROWS;
            const PADDED: usize = TILE_ROWS * <$arithmetic as Arithmetic>::CHANNELS;

            const SKIPS_ZEROS: bool = false;

            /// Tile register after tile register, in the order that they are read.
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
                    // SAFETY: `tiles` registers of weights for each half of the outputs, `tiles` · 16 rows of
                    // activations and 32 rows of sums, all of which the slices have.
                    unsafe {
                        let (weights, sums) = (weights.as_ptr(), sums.as_mut_ptr().add(vertex));
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

matrix!(Bf16, Zmm<F32>, "tdpbf16ps");
matrix!(Int8, ZmmUnfused<F32>, "tdpbsud");
