//! Registers of f32 for what happens between layers.

/// Numbers of one channel, one a vertex.
///
/// # Safety
/// Callers run on a machine that has the instructions of the implementing type, and pointers are
/// valid for `LANES` numbers.
pub(super) trait Float: Copy {
    const LANES: usize;
    unsafe fn load(from: *const f32) -> Self;
    /// Whole numbers, rounded to even where they are too long.
    unsafe fn load_whole(from: *const i32) -> Self;
    unsafe fn store(self, to: *mut f32);
    unsafe fn splat(value: f32) -> Self;
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    /// max(0, x), and 0 for what is no number.
    unsafe fn relu(self) -> Self;
}

macro_rules! float {
    ($register:ty, $lanes:literal, |$from:ident| $load:expr, $whole:expr, |$to:ident, $x:ident| $store:expr,
     |$value:ident| $splat:expr, |$a:ident, $b:ident| $add:expr, $mul:expr, $relu:expr) => {
        // SAFETY (all blocks below): the trait's contract, passed on; loads and stores are the unaligned
        // ones.
        #[allow(
            clippy::undocumented_unsafe_blocks,
            unused_unsafe,
            reason = "one contract for all, stated above; plain arrays need no unsafe for all of it"
        )]
        impl Float for $register {
            const LANES: usize = $lanes;
            #[inline(always)]
            unsafe fn load($from: *const f32) -> Self {
                unsafe { $load }
            }
            #[inline(always)]
            unsafe fn load_whole($from: *const i32) -> Self {
                unsafe { $whole }
            }
            #[inline(always)]
            unsafe fn store(self, $to: *mut f32) {
                let $x = self;
                unsafe { $store }
            }
            #[inline(always)]
            unsafe fn splat($value: f32) -> Self {
                unsafe { $splat }
            }
            #[inline(always)]
            unsafe fn add(self, $b: Self) -> Self {
                let $a = self;
                unsafe { $add }
            }
            #[inline(always)]
            unsafe fn mul(self, $b: Self) -> Self {
                let $a = self;
                unsafe { $mul }
            }
            #[inline(always)]
            unsafe fn relu(self) -> Self {
                let $a = self;
                unsafe { $relu }
            }
        }
    };
}

float!(
    [f32; 8],
    8,
    |from| from.cast::<Self>().read_unaligned(),
    from.cast::<[i32; 8]>().read_unaligned().map(|x| x as f32),
    |to, x| to.cast::<Self>().write_unaligned(x),
    |value| [value; 8],
    |a, b| std::array::from_fn(|i| a[i] + b[i]),
    std::array::from_fn(|i| a[i] * b[i]),
    a.map(|x| if x > 0.0 { x } else { 0.0 })
);

// maxps gives its second operand where one is no number.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::Float;
    use std::arch::x86_64::*;

    float!(
        __m512,
        16,
        |from| _mm512_loadu_ps(from),
        _mm512_cvtepi32_ps(_mm512_loadu_si512(from.cast())),
        |to, x| _mm512_storeu_ps(to, x),
        |value| _mm512_set1_ps(value),
        |a, b| _mm512_add_ps(a, b),
        _mm512_mul_ps(a, b),
        _mm512_max_ps(a, _mm512_setzero_ps())
    );
    float!(
        __m256,
        8,
        |from| _mm256_loadu_ps(from),
        _mm256_cvtepi32_ps(_mm256_loadu_si256(from.cast())),
        |to, x| _mm256_storeu_ps(to, x),
        |value| _mm256_set1_ps(value),
        |a, b| _mm256_add_ps(a, b),
        _mm256_mul_ps(a, b),
        _mm256_max_ps(a, _mm256_setzero_ps())
    );
}

#[cfg(target_arch = "aarch64")]
mod neon {
    use super::Float;
    use std::arch::aarch64::*;

    // Of zero and what is no number, the maximum of numbers is zero.
    float!(
        float32x4_t,
        4,
        |from| vld1q_f32(from),
        vcvtq_f32_s32(vld1q_s32(from)),
        |to, x| vst1q_f32(to, x),
        |value| vdupq_n_f32(value),
        |a, b| vaddq_f32(a, b),
        vmulq_f32(a, b),
        vmaxnmq_f32(a, vdupq_n_f32(0.0))
    );
}

#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128 {
    use super::Float;
    use std::arch::wasm32::*;

    // The second operand where it is larger, the first otherwise.
    float!(
        v128,
        4,
        |from| v128_load(from.cast()),
        f32x4_convert_i32x4(v128_load(from.cast())),
        |to, x| v128_store(to.cast(), x),
        |value| f32x4_splat(value),
        |a, b| f32x4_add(a, b),
        f32x4_mul(a, b),
        f32x4_pmax(f32x4_splat(0.0), a)
    );
}
