//! Products of words in WebAssembly's 128-bit vectors, which have no fused multiply-add.

use super::super::arithmetic::{Bf16, F32, Int8, Int16};
use super::{WordProducts, word_products};
use std::arch::wasm32::*;

/// WebAssembly's simd128, products rounded before they are added.
pub(in super::super) struct Simd128<A>(A);

macro_rules! simd128 {
    ($arithmetic:ty, $words:ty: |$from:ident| $load:expr, |$word:ident| $splat:expr,
     |$s:ident, $w:ident, $x:ident| $add:expr) => {
        word_products!(
            Simd128<$arithmetic>, 4 of v128, v128: u32x4_splat(0),
            $words: |$from| $load, |$word| $splat, |$s, $w, $x| $add,
            |sum, to| v128_store(to.cast(), sum)
        );
    };
}

simd128!(
    F32, v128: |from| v128_load(from.cast()), |word| u32x4_splat(word),
    |s, w, x| f32x4_add(s, f32x4_mul(w, x))
);
simd128!(
    Bf16, [v128; 2]: |from| floats(v128_load(from.cast())), |word| floats(u32x4_splat(word)),
    |s, w, x| f32x4_add(f32x4_add(s, f32x4_mul(w[1], x[1])), f32x4_mul(w[0], x[0]))
);
simd128!(
    Int16, v128: |from| v128_load(from.cast()), |word| u32x4_splat(word),
    |s, w, x| i32x4_add(s, i32x4_dot_i16x8(w, x))
);
// Even and odd bytes are widened to 16 bits separately; weights have a sign, activations have none.
simd128!(
    Int8, [v128; 2]:
    |from| {
        let x = v128_load(from.cast());
        [v128_and(x, u16x8_splat(0xFF)), u16x8_shr(x, 8)]
    },
    |word| {
        let w = u32x4_splat(word);
        [i16x8_shr(i16x8_shl(w, 8), 8), i16x8_shr(w, 8)]
    },
    |s, w, x| {
        let products = i32x4_add(i32x4_dot_i16x8(w[0], x[0]), i32x4_dot_i16x8(w[1], x[1]));
        i32x4_add(s, products)
    }
);

/// Splits words of two bf16 into f32: the low and the high halves.
#[inline(always)]
fn floats(words: v128) -> [v128; 2] {
    [u32x4_shl(words, 16), v128_and(words, u32x4_splat(0xFFFF_0000))]
}
