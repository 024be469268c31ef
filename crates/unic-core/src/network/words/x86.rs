//! Products of words on AVX-512 and AVX2.

use super::super::arithmetic::{Bf16, F32, Int8, Int16};
use super::{WordProducts, word_products};
use std::arch::x86_64::*;

/// AVX-512, products of f32 fused with sums.
pub(in super::super) struct Zmm<A>(A);
/// AVX2, products of f32 fused with sums.
pub(in super::super) struct Ymm<A>(A);
/// AVX-512 with products rounded before they are added.
///
/// The last layer after integer layers uses it: integers give the same bits on all instruction
/// sets, and an unfused last layer does, too.
pub(in super::super) struct ZmmUnfused<A>(A);
/// AVX2 with products rounded before they are added; see [`ZmmUnfused`].
pub(in super::super) struct YmmUnfused<A>(A);

macro_rules! zmm {
    ($name:ident<$arithmetic:ty>, $sum:ty: $zero:ident, $store:ident, |$s:ident, $w:ident, $x:ident| $add:expr) => {
        word_products!(
            $name<$arithmetic>, 16 of __m512, $sum: $zero(),
            __m512i: |from| _mm512_loadu_si512(from.cast()),
            |word| _mm512_set1_epi32(word as i32),
            |$s, $w, $x| $add,
            |sum, to| $store(to.cast(), sum),
            |line| _mm_prefetch::<_MM_HINT_T0>(line.cast())
        );
    };
}

macro_rules! ymm {
    ($name:ident<$arithmetic:ty>, $sum:ty: $zero:ident, $store:ident, |$s:ident, $w:ident, $x:ident| $add:expr) => {
        word_products!(
            $name<$arithmetic>, 8 of __m256, $sum: $zero(),
            __m256i: |from| _mm256_loadu_si256(from.cast()),
            |word| _mm256_set1_epi32(word as i32),
            |$s, $w, $x| $add,
            |sum, to| $store(to.cast(), sum),
            |line| _mm_prefetch::<_MM_HINT_T0>(line.cast())
        );
    };
}

zmm!(Zmm<F32>, __m512: _mm512_setzero_ps, _mm512_storeu_ps, |s, w, x| {
    _mm512_fmadd_ps(_mm512_castsi512_ps(w), _mm512_castsi512_ps(x), s)
});
zmm!(Zmm<Bf16>, __m512: _mm512_setzero_ps, _mm512_storeu_ps, |s, w, x| {
    let numbers = |words| std::mem::transmute::<__m512i, __m512bh>(words);
    _mm512_dpbf16_ps(s, numbers(w), numbers(x))
});
zmm!(Zmm<Int16>, __m512i: _mm512_setzero_si512, _mm512_storeu_si512, |s, w, x| {
    _mm512_dpwssd_epi32(s, w, x)
});
zmm!(Zmm<Int8>, __m512i: _mm512_setzero_si512, _mm512_storeu_si512, |s, w, x| {
    _mm512_dpbusd_epi32(s, x, w)
});
ymm!(Ymm<F32>, __m256: _mm256_setzero_ps, _mm256_storeu_ps, |s, w, x| {
    _mm256_fmadd_ps(_mm256_castsi256_ps(w), _mm256_castsi256_ps(x), s)
});
ymm!(Ymm<Bf16>, __m256: _mm256_setzero_ps, _mm256_storeu_ps, |s, w, x| {
    let high = |word| _mm256_castsi256_ps(_mm256_and_si256(word, _mm256_set1_epi32(!0xFFFF)));
    let low = |word| _mm256_castsi256_ps(_mm256_slli_epi32::<16>(word));
    _mm256_fmadd_ps(low(w), low(x), _mm256_fmadd_ps(high(w), high(x), s))
});
ymm!(Ymm<Int16>, __m256i: _mm256_setzero_si256, _mm256_storeu_si256, |s, w, x| {
    _mm256_add_epi32(s, _mm256_madd_epi16(w, x))
});
// Bytes are widened to 16 bits, even and odd ones separately. `_mm256_maddubs_epi16` would multiply
// them directly, but its 16-bit sums saturate.
ymm!(Ymm<Int8>, __m256i: _mm256_setzero_si256, _mm256_storeu_si256, |s, w, x| {
    let even = _mm256_madd_epi16(
        _mm256_srai_epi16::<8>(_mm256_slli_epi16::<8>(w)),
        _mm256_and_si256(x, _mm256_set1_epi16(0xFF)),
    );
    let odd = _mm256_madd_epi16(_mm256_srai_epi16::<8>(w), _mm256_srli_epi16::<8>(x));
    _mm256_add_epi32(s, _mm256_add_epi32(even, odd))
});
zmm!(ZmmUnfused<F32>, __m512: _mm512_setzero_ps, _mm512_storeu_ps, |s, w, x| {
    _mm512_add_ps(s, _mm512_mul_ps(_mm512_castsi512_ps(w), _mm512_castsi512_ps(x)))
});
ymm!(YmmUnfused<F32>, __m256: _mm256_setzero_ps, _mm256_storeu_ps, |s, w, x| {
    _mm256_add_ps(s, _mm256_mul_ps(_mm256_castsi256_ps(w), _mm256_castsi256_ps(x)))
});
