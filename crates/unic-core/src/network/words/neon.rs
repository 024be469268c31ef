//! Products of words on 64-bit ARM.
//!
//! Words are split into their numbers when they are loaded. A load serves several outputs, so that
//! splitting is done once for all of them.

use super::super::arithmetic::{Bf16, F32, Int8, Int16};
use super::{WordProducts, word_products};
use std::arch::{aarch64::*, asm};

/// NEON without extensions, four products an instruction in all precisions.
pub(in super::super) struct Neon<A>(A);
/// NEON with products of f32 rounded before they are added.
pub(in super::super) struct NeonUnfused<A>(A);
/// NEON with dot products of bf16 (FEAT_BF16) or bytes (FEAT_DotProd).
///
/// Assembly, because the intrinsics are not stable in Rust.
pub(in super::super) struct NeonDot<A>(A);

macro_rules! neon {
    ($name:ident<$arithmetic:ty>, $sum:ty: $zero:expr, $words:ty: |$from:ident| $load:expr, |$word:ident| $splat:expr,
     |$s:ident, $w:ident, $x:ident| $add:expr, |$total:ident, $to:ident| $store:expr) => {
        word_products!(
            $name<$arithmetic>, 4 of float32x4_t, $sum: $zero,
            $words: |$from| $load, |$word| $splat, |$s, $w, $x| $add, |$total, $to| $store
        );
    };
}

neon!(
    Neon<F32>, float32x4_t: vdupq_n_f32(0.0),
    float32x4_t: |from| vld1q_f32(from.cast()), |word| vdupq_n_f32(f32::from_bits(word)),
    |s, w, x| vfmaq_f32(s, w, x), |sum, to| vst1q_f32(to.cast(), sum)
);
neon!(
    NeonUnfused<F32>, float32x4_t: vdupq_n_f32(0.0),
    float32x4_t: |from| vld1q_f32(from.cast()), |word| vdupq_n_f32(f32::from_bits(word)),
    |s, w, x| vaddq_f32(s, vmulq_f32(w, x)), |sum, to| vst1q_f32(to.cast(), sum)
);
neon!(
    Neon<Bf16>, float32x4_t: vdupq_n_f32(0.0),
    [float32x4_t; 2]: |from| floats(vld1q_u32(from)), |word| floats(vdupq_n_u32(word)),
    |s, w, x| vfmaq_f32(vfmaq_f32(s, w[1], x[1]), w[0], x[0]), |sum, to| vst1q_f32(to.cast(), sum)
);
neon!(
    Neon<Int16>, int32x4_t: vdupq_n_s32(0),
    [int16x4_t; 2]: |from| halves(vld1q_u32(from)), |word| halves(vdupq_n_u32(word)),
    |s, w, x| vmlal_s16(vmlal_s16(s, w[0], x[0]), w[1], x[1]), |sum, to| vst1q_s32(to.cast(), sum)
);
// Weights have a sign, activations have none.
neon!(
    Neon<Int8>, int32x4_t: vdupq_n_s32(0),
    [int16x4_t; 4]: |from| bytes(vld1q_u32(from)), |word| signed_bytes(vdupq_n_u32(word)),
    |s, w, x| {
        let s = vmlal_s16(vmlal_s16(s, w[0], x[0]), w[1], x[1]);
        vmlal_s16(vmlal_s16(s, w[2], x[2]), w[3], x[3])
    },
    |sum, to| vst1q_s32(to.cast(), sum)
);
neon!(
    NeonDot<Bf16>, float32x4_t: vdupq_n_f32(0.0),
    uint32x4_t: |from| vld1q_u32(from), |word| vdupq_n_u32(word),
    |s, w, x| {
        let mut s = s;
        asm!(
            "bfdot {s:v}.4s, {w:v}.8h, {x:v}.8h",
            s = inout(vreg) s, w = in(vreg) w, x = in(vreg) x,
            options(pure, nomem, nostack, preserves_flags)
        );
        s
    },
    |sum, to| vst1q_f32(to.cast(), sum)
);
// `sdot` reads both factors as signed bytes, but activations take all 8 bits. An activation is
// split into its lower seven bits and 128 times its eighth bit, with a sum for each part.
neon!(
    NeonDot<Int8>, [int32x4_t; 2]: [vdupq_n_s32(0); 2],
    [uint8x16_t; 2]: |from| {
        let x = vld1q_u8(from.cast());
        [vandq_u8(x, vdupq_n_u8(0x7F)), vshrq_n_u8::<7>(x)]
    },
    |word| [vreinterpretq_u8_u32(vdupq_n_u32(word)); 2],
    |s, w, x| [signed_dot(s[0], w[0], x[0]), signed_dot(s[1], w[1], x[1])],
    |sum, to| vst1q_s32(to.cast(), vaddq_s32(sum[0], vshlq_n_s32::<7>(sum[1])))
);

/// Adds four products of signed bytes to each lane of `sum`.
///
/// # Safety
/// The machine has FEAT_DotProd.
#[inline(always)]
unsafe fn signed_dot(mut sum: int32x4_t, w: uint8x16_t, x: uint8x16_t) -> int32x4_t {
    // SAFETY: the caller's promise; registers alone are read and written.
    unsafe {
        asm!(
            "sdot {s:v}.4s, {w:v}.16b, {x:v}.16b",
            s = inout(vreg) sum, w = in(vreg) w, x = in(vreg) x,
            options(pure, nomem, nostack, preserves_flags)
        );
    }
    sum
}

/// Splits words of two bf16 into f32: the low and the high halves.
#[inline(always)]
fn floats(words: uint32x4_t) -> [float32x4_t; 2] {
    // SAFETY: every 64-bit ARM that Rust compiles this for has NEON; so have those below.
    #[allow(unused_unsafe, reason = "not all intrinsics need it")]
    unsafe {
        let low = vshlq_n_u32::<16>(words);
        let high = vandq_u32(words, vdupq_n_u32(0xFFFF_0000));
        [vreinterpretq_f32_u32(low), vreinterpretq_f32_u32(high)]
    }
}

/// Splits words into their low and high halves, 16-bit integers with a sign.
#[inline(always)]
fn halves(words: uint32x4_t) -> [int16x4_t; 2] {
    // SAFETY: see `floats`.
    #[allow(unused_unsafe, reason = "not all intrinsics need it")]
    unsafe {
        let (low, high) = (vmovn_u32(words), vshrn_n_u32::<16>(words));
        [vreinterpret_s16_u16(low), vreinterpret_s16_u16(high)]
    }
}

/// Splits words into four bytes without a sign, the lowest first.
#[inline(always)]
fn bytes(words: uint32x4_t) -> [int16x4_t; 4] {
    let [low, high] = halves(words);
    // SAFETY: see `floats`.
    #[allow(unused_unsafe, reason = "not all intrinsics need it")]
    unsafe {
        let byte = vdup_n_s16(0xFF);
        let upper = |half| vreinterpret_s16_u16(vshr_n_u16::<8>(vreinterpret_u16_s16(half)));
        [vand_s16(low, byte), upper(low), vand_s16(high, byte), upper(high)]
    }
}

/// Splits words into four bytes with a sign, the lowest first.
#[inline(always)]
fn signed_bytes(words: uint32x4_t) -> [int16x4_t; 4] {
    let [low, high] = halves(words);
    // SAFETY: see `floats`.
    #[allow(unused_unsafe, reason = "not all intrinsics need it")]
    unsafe {
        let lower = |half| vshr_n_s16::<8>(vshl_n_s16::<8>(half));
        [
            lower(low),
            vshr_n_s16::<8>(low),
            lower(high),
            vshr_n_s16::<8>(high),
        ]
    }
}
