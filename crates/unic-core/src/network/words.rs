//! Products of 32-bit words in vector registers: one f32, two 16-bit or four 8-bit numbers a word.

#[cfg(target_arch = "aarch64")]
pub(super) mod neon;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
pub(super) mod simd128;
#[cfg(target_arch = "x86_64")]
pub(super) mod x86;

use super::arithmetic::{Arithmetic, Bf16, F32, Int8, Int16};
use crate::simd::Float;

/// Products of a register of words, one word a vertex, and their sums.
///
/// # Safety
/// Callers run on a machine that has the instructions of the implementing type, and pointers are
/// valid for `LANES` words.
pub(super) trait WordProducts {
    /// Number format of the words.
    type Arithmetic: Arithmetic;
    /// Register of sums.
    type Sum: Copy;
    /// Words as they are multiplied, split into their numbers where the instruction needs it.
    type Words: Copy;
    /// Register of f32 on the same instructions.
    type Float: Float;
    /// Words in a register.
    const LANES: usize;
    unsafe fn zero() -> Self::Sum;
    unsafe fn load(from: *const u32) -> Self::Words;
    unsafe fn splat(word: u32) -> Self::Words;
    /// Returns `sum` + Σ weight · activation over the numbers of each word.
    unsafe fn add(sum: Self::Sum, weights: Self::Words, activations: Self::Words) -> Self::Sum;
    unsafe fn store(sum: Self::Sum, to: *mut u32);
    /// Prefetches a cache line; never faults, so that the address may lie beyond the buffer.
    unsafe fn prefetch(_: *const u32) {}
}

/// Implements [`WordProducts`]: `word_products!(Type<Arithmetic>, lanes of Float, sums: zero,
/// words: |from| load, |word| splat, |sum, weights, activations| add, |sum, to| store)`.
macro_rules! word_products {
    ($name:ident<$arithmetic:ty>, $lanes:tt of $float:ty, $sum:ty: $zero:expr,
     $words:ty: |$from:ident| $load:expr, |$word:ident| $splat:expr,
     |$s:ident, $w:ident, $x:ident| $add:expr, |$total:ident, $to:ident| $store:expr
     $(, |$line:ident| $prefetch:expr)?) => {
        // SAFETY (all blocks below): the trait's contract, passed on to the intrinsic; loads and
        // stores are the unaligned ones, and vectors of the same size are transmuted.
        #[allow(
            clippy::undocumented_unsafe_blocks,
            unused_unsafe,
            reason = "one contract for all, stated above; where a target always has the instructions, not all need it"
        )]
        impl WordProducts for $name<$arithmetic> {
            type Arithmetic = $arithmetic;
            type Sum = $sum;
            type Words = $words;
            type Float = $float;
            const LANES: usize = $lanes;
            #[inline(always)]
            unsafe fn zero() -> Self::Sum {
                unsafe { $zero }
            }
            #[inline(always)]
            unsafe fn load($from: *const u32) -> Self::Words {
                unsafe { $load }
            }
            #[inline(always)]
            unsafe fn splat($word: u32) -> Self::Words {
                unsafe { $splat }
            }
            #[inline(always)]
            unsafe fn add($s: Self::Sum, $w: Self::Words, $x: Self::Words) -> Self::Sum {
                unsafe { $add }
            }
            #[inline(always)]
            unsafe fn store($total: Self::Sum, $to: *mut u32) {
                unsafe { $store }
            }
            $(#[inline(always)]
            unsafe fn prefetch($line: *const u32) {
                unsafe { $prefetch }
            })?
        }
    };
}
use word_products;

/// Products in plain loops over eight lanes, for any processor. Products are rounded before they
/// are added.
pub(super) struct Plain<A>(A);

const PLAIN_LANES: usize = 8;

macro_rules! plain {
    ($arithmetic:ty, $sum:ty, |$total:ident, $weight:ident, $activation:ident| $add:expr) => {
        word_products!(
            Plain<$arithmetic>, PLAIN_LANES of [f32; PLAIN_LANES],
            [$sum; PLAIN_LANES]: [<$sum>::default(); PLAIN_LANES],
            [u32; PLAIN_LANES]: |from| from.cast::<[u32; PLAIN_LANES]>().read_unaligned(),
            |word| [word; PLAIN_LANES],
            |s, w, x| std::array::from_fn(|i| {
                let ($total, $weight, $activation) = (s[i], w[i], x[i]);
                $add
            }),
            |sum, to| to.cast::<[$sum; PLAIN_LANES]>().write_unaligned(sum)
        );
    };
}

plain!(F32, f32, |sum, w, x| sum + f32::from_bits(w) * f32::from_bits(x));
// A bf16 number is the upper half of an f32.
plain!(Bf16, f32, |sum, w, x| {
    let high = |word: u32| f32::from_bits(word & 0xFFFF_0000);
    let low = |word: u32| f32::from_bits(word << 16);
    sum + high(w) * high(x) + low(w) * low(x)
});
plain!(Int16, i32, |sum, w, x| {
    let low = |word: u32| i32::from(word as u16 as i16);
    let high = |word: u32| (word as i32) >> 16;
    sum.wrapping_add(low(w).wrapping_mul(low(x)))
        .wrapping_add(high(w).wrapping_mul(high(x)))
});
// The shift to the left and back extends the sign of a weight; activations have none.
plain!(Int8, i32, |sum, w, x| {
    let product = |k: u32| ((w << (24 - 8 * k)) as i32 >> 24).wrapping_mul(((x >> (8 * k)) & 0xFF) as i32);
    (0..4).fold(sum, |sum, k| sum.wrapping_add(product(k)))
});
