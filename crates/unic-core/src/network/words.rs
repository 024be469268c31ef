//! Products of 32-bit words: one number of f32, two of 16 bits or four of 8 bits.

use super::{
    arithmetic::{Arithmetic, Bf16, F32, Int8, Int16},
    float::Float,
};

/// A register's worth of words, one a vertex, and how their products are summed.
///
/// # Safety
/// Callers run on a machine that has the instructions of the implementing type, and pointers are
/// valid for `LANES` words.
pub(super) trait Dot {
    type Arithmetic: Arithmetic;
    type Sum: Copy;
    type Words: Copy;
    /// f32 on the same instructions.
    type Float: Float;
    const LANES: usize;
    unsafe fn zero() -> Self::Sum;
    unsafe fn load(from: *const u32) -> Self::Words;
    unsafe fn splat(word: u32) -> Self::Words;
    /// sum + Σ over the numbers of a word, weight · activation.
    unsafe fn add(sum: Self::Sum, weights: Self::Words, activations: Self::Words) -> Self::Sum;
    unsafe fn store(sum: Self::Sum, to: *mut u32);
    /// Asks for a line of memory; never faults.
    unsafe fn prefetch(_: *const u32) {}
}

/// Eight lanes of plain loops.
pub(super) struct Plain<A>(A);

const PLAIN: usize = 8;

macro_rules! plain {
    ($arithmetic:ty, $sum:ty, |$total:ident, $weight:ident, $activation:ident| $add:expr) => {
        impl Dot for Plain<$arithmetic> {
            type Arithmetic = $arithmetic;
            type Sum = [$sum; PLAIN];
            type Words = [u32; PLAIN];
            type Float = [f32; PLAIN];
            const LANES: usize = PLAIN;
            #[inline(always)]
            unsafe fn zero() -> Self::Sum {
                [<$sum>::default(); PLAIN]
            }
            #[inline(always)]
            unsafe fn load(from: *const u32) -> Self::Words {
                // SAFETY: the caller's pointer is valid for eight words.
                unsafe { from.cast::<Self::Words>().read() }
            }
            #[inline(always)]
            unsafe fn splat(word: u32) -> Self::Words {
                [word; PLAIN]
            }
            #[inline(always)]
            unsafe fn add(sum: Self::Sum, weights: Self::Words, activations: Self::Words) -> Self::Sum {
                std::array::from_fn(|i| {
                    let ($total, $weight, $activation) = (sum[i], weights[i], activations[i]);
                    $add
                })
            }
            #[inline(always)]
            unsafe fn store(sum: Self::Sum, to: *mut u32) {
                // SAFETY: the caller's pointer is valid for eight words.
                unsafe { to.cast::<Self::Sum>().write(sum) }
            }
        }
    };
}

plain!(F32, f32, |sum, w, x| multiply_add(
    f32::from_bits(w),
    f32::from_bits(x),
    sum
));
plain!(Bf16, f32, |sum, w, x| {
    let high = |word: u32| f32::from_bits(word & 0xFFFF_0000);
    let low = |word: u32| f32::from_bits(word << 16);
    multiply_add(low(w), low(x), multiply_add(high(w), high(x), sum))
});
plain!(Int16, i32, |sum, w, x| {
    let low = |word: u32| i32::from(word as u16 as i16);
    let high = |word: u32| (word as i32) >> 16;
    sum.wrapping_add(low(w).wrapping_mul(low(x)))
        .wrapping_add(high(w).wrapping_mul(high(x)))
});
plain!(Int8, i32, |sum, w, x| {
    let product = |k: u32| ((w << (24 - 8 * k)) as i32 >> 24).wrapping_mul(((x >> (8 * k)) & 0xFF) as i32);
    (0..4).fold(sum, |sum, k| sum.wrapping_add(product(k)))
});

/// Rounded once where the target always has such an instruction; elsewhere that would be a call.
#[inline(always)]
fn multiply_add(a: f32, b: f32, c: f32) -> f32 {
    match cfg!(any(target_arch = "aarch64", target_feature = "fma")) {
        true => a.mul_add(b, c),
        false => a * b + c,
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) mod x86 {
    use super::super::arithmetic::{Bf16, F32, Int8, Int16};
    use super::Dot;
    use std::arch::x86_64::*;

    /// AVX-512.
    pub(in super::super) struct Zmm<A>(A);
    /// AVX2.
    pub(in super::super) struct Ymm<A>(A);
    /// AVX-512, products rounded before they are added, as where there is no fused multiply-add.
    pub(in super::super) struct ZmmUnfused<A>(A);
    /// AVX2, the same.
    pub(in super::super) struct YmmUnfused<A>(A);

    macro_rules! x86 {
        ($name:ident<$arithmetic:ty>, $lanes:literal, $words:ty, $float:ty, $sum:ty, $zero:ident, $load:ident, $splat:ident, $store:ident,
         |$total:ident, $weight:ident, $activation:ident| $add:expr) => {
            // SAFETY (all blocks below): the trait's contract, passed on to the intrinsic; loads and
            // stores are the unaligned ones, and vectors of the same size are transmuted.
            #[allow(
                clippy::undocumented_unsafe_blocks,
                reason = "one contract for all, stated above"
            )]
            impl Dot for $name<$arithmetic> {
                type Arithmetic = $arithmetic;
                type Sum = $sum;
                type Words = $words;
                type Float = $float;
                const LANES: usize = $lanes;
                #[inline(always)]
                unsafe fn zero() -> Self::Sum {
                    unsafe { $zero() }
                }
                #[inline(always)]
                unsafe fn load(from: *const u32) -> Self::Words {
                    unsafe { $load(from.cast()) }
                }
                #[inline(always)]
                unsafe fn splat(word: u32) -> Self::Words {
                    unsafe { $splat(word as i32) }
                }
                #[inline(always)]
                unsafe fn add(
                    $total: Self::Sum,
                    $weight: Self::Words,
                    $activation: Self::Words,
                ) -> Self::Sum {
                    unsafe { $add }
                }
                #[inline(always)]
                unsafe fn store(sum: Self::Sum, to: *mut u32) {
                    unsafe { $store(to.cast(), sum) }
                }
                #[inline(always)]
                unsafe fn prefetch(line: *const u32) {
                    unsafe { _mm_prefetch::<_MM_HINT_T0>(line.cast()) }
                }
            }
        };
    }
    x86!(
        Zmm<F32>,
        16,
        __m512i,
        __m512,
        __m512,
        _mm512_setzero_ps,
        _mm512_loadu_si512,
        _mm512_set1_epi32,
        _mm512_storeu_ps,
        |s, w, x| _mm512_fmadd_ps(_mm512_castsi512_ps(w), _mm512_castsi512_ps(x), s)
    );
    x86!(
        Zmm<Bf16>,
        16,
        __m512i,
        __m512,
        __m512,
        _mm512_setzero_ps,
        _mm512_loadu_si512,
        _mm512_set1_epi32,
        _mm512_storeu_ps,
        |s, w, x| _mm512_dpbf16_ps(
            s,
            std::mem::transmute::<__m512i, __m512bh>(w),
            std::mem::transmute::<__m512i, __m512bh>(x)
        )
    );
    x86!(
        Zmm<Int16>,
        16,
        __m512i,
        __m512,
        __m512i,
        _mm512_setzero_si512,
        _mm512_loadu_si512,
        _mm512_set1_epi32,
        _mm512_storeu_si512,
        |s, w, x| _mm512_dpwssd_epi32(s, w, x)
    );
    x86!(
        Zmm<Int8>,
        16,
        __m512i,
        __m512,
        __m512i,
        _mm512_setzero_si512,
        _mm512_loadu_si512,
        _mm512_set1_epi32,
        _mm512_storeu_si512,
        |s, w, x| _mm512_dpbusd_epi32(s, x, w)
    );
    x86!(
        Ymm<F32>,
        8,
        __m256i,
        __m256,
        __m256,
        _mm256_setzero_ps,
        _mm256_loadu_si256,
        _mm256_set1_epi32,
        _mm256_storeu_ps,
        |s, w, x| _mm256_fmadd_ps(_mm256_castsi256_ps(w), _mm256_castsi256_ps(x), s)
    );
    x86!(
        Ymm<Bf16>,
        8,
        __m256i,
        __m256,
        __m256,
        _mm256_setzero_ps,
        _mm256_loadu_si256,
        _mm256_set1_epi32,
        _mm256_storeu_ps,
        |s, w, x| {
            let high = |word| _mm256_castsi256_ps(_mm256_and_si256(word, _mm256_set1_epi32(!0xFFFF)));
            let low = |word| _mm256_castsi256_ps(_mm256_slli_epi32::<16>(word));
            _mm256_fmadd_ps(low(w), low(x), _mm256_fmadd_ps(high(w), high(x), s))
        }
    );
    x86!(
        Ymm<Int16>,
        8,
        __m256i,
        __m256,
        __m256i,
        _mm256_setzero_si256,
        _mm256_loadu_si256,
        _mm256_set1_epi32,
        _mm256_storeu_si256,
        |s, w, x| _mm256_add_epi32(s, _mm256_madd_epi16(w, x))
    );
    // Bytes are widened to 16 bits: the instruction that multiplies them as they are saturates.
    x86!(
        Ymm<Int8>,
        8,
        __m256i,
        __m256,
        __m256i,
        _mm256_setzero_si256,
        _mm256_loadu_si256,
        _mm256_set1_epi32,
        _mm256_storeu_si256,
        |s, w, x| {
            let even = _mm256_madd_epi16(
                _mm256_srai_epi16::<8>(_mm256_slli_epi16::<8>(w)),
                _mm256_and_si256(x, _mm256_set1_epi16(0xFF)),
            );
            let odd = _mm256_madd_epi16(_mm256_srai_epi16::<8>(w), _mm256_srli_epi16::<8>(x));
            _mm256_add_epi32(s, _mm256_add_epi32(even, odd))
        }
    );
    x86!(
        ZmmUnfused<F32>,
        16,
        __m512i,
        __m512,
        __m512,
        _mm512_setzero_ps,
        _mm512_loadu_si512,
        _mm512_set1_epi32,
        _mm512_storeu_ps,
        |s, w, x| _mm512_add_ps(s, _mm512_mul_ps(_mm512_castsi512_ps(w), _mm512_castsi512_ps(x)))
    );
    x86!(
        YmmUnfused<F32>,
        8,
        __m256i,
        __m256,
        __m256,
        _mm256_setzero_ps,
        _mm256_loadu_si256,
        _mm256_set1_epi32,
        _mm256_storeu_ps,
        |s, w, x| _mm256_add_ps(s, _mm256_mul_ps(_mm256_castsi256_ps(w), _mm256_castsi256_ps(x)))
    );
}
