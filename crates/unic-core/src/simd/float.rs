//! Vector registers of f32 on every instruction set.

/// Vector register of f32, one lane a vertex.
///
/// # Safety
/// Callers run on a machine that has the instructions of the implementing type, and pointers are
/// valid for `LANES` numbers.
pub(crate) trait Float: Copy {
    const LANES: usize;
    unsafe fn load(from: *const f32) -> Self;
    /// Loads integers and converts them, rounded to even beyond 24 bits.
    unsafe fn load_integers(from: *const i32) -> Self;
    unsafe fn store(self, to: *mut f32);
    unsafe fn splat(value: f32) -> Self;
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    /// Returns max(0, x), and 0 for NaN.
    unsafe fn relu(self) -> Self;
    /// Stores two registers of non-negative numbers as words of two bf16: `low` in the lower
    /// halves, `high` in the upper halves.
    ///
    /// Rounds to nearest, ties upwards: one number in 2^16 is a tie, and rounding it to even would
    /// take two more instructions for all.
    unsafe fn store_bf16(low: Self, high: Self, to: *mut u32);
}

macro_rules! float {
    ($register:ty, $lanes:literal, |$from:ident| $load:expr, $whole:expr, |$to:ident, $x:ident| $store:expr,
     |$value:ident| $splat:expr, |$a:ident, $b:ident| $add:expr, $mul:expr, $relu:expr,
     |$low:ident, $high:ident, $words:ident| $bf16:expr) => {
        // SAFETY (all blocks below): the trait's contract, passed on; loads and stores are the
        // unaligned ones.
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
            unsafe fn load_integers($from: *const i32) -> Self {
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
            #[inline(always)]
            unsafe fn store_bf16($low: Self, $high: Self, $words: *mut u32) {
                unsafe { $bf16 }
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
    a.map(|x| if x > 0.0 { x } else { 0.0 }),
    |low, high, to| to.cast::<[u32; 8]>().write_unaligned(std::array::from_fn(|i| {
        let rounded = |x: f32| x.to_bits().wrapping_add(0x8000);
        rounded(low[i]) >> 16 | rounded(high[i]) & 0xFFFF_0000
    }))
);

// ReLU: maxps returns its second operand, here zero, where one of them is NaN.
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
        _mm512_max_ps(a, _mm512_setzero_ps()),
        |low, high, to| {
            let half = _mm512_set1_epi32(0x8000);
            let low = _mm512_add_epi32(_mm512_castps_si512(low), half);
            let high = _mm512_add_epi32(_mm512_castps_si512(high), half);
            let words = _mm512_mask_blend_epi16(0xAAAA_AAAA, _mm512_srli_epi32::<16>(low), high);
            _mm512_storeu_si512(to.cast(), words)
        }
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
        _mm256_max_ps(a, _mm256_setzero_ps()),
        |low, high, to| {
            let half = _mm256_set1_epi32(0x8000);
            let low = _mm256_add_epi32(_mm256_castps_si256(low), half);
            let high = _mm256_add_epi32(_mm256_castps_si256(high), half);
            let words = _mm256_blend_epi16::<0xAA>(_mm256_srli_epi32::<16>(low), high);
            _mm256_storeu_si256(to.cast(), words)
        }
    );
}

#[cfg(target_arch = "aarch64")]
mod neon {
    use super::Float;
    use std::arch::aarch64::*;

    // ReLU: vmaxnm returns the number, here zero, where the other operand is NaN.
    float!(
        float32x4_t,
        4,
        |from| vld1q_f32(from),
        vcvtq_f32_s32(vld1q_s32(from)),
        |to, x| vst1q_f32(to, x),
        |value| vdupq_n_f32(value),
        |a, b| vaddq_f32(a, b),
        vmulq_f32(a, b),
        vmaxnmq_f32(a, vdupq_n_f32(0.0)),
        |low, high, to| {
            let half = vdupq_n_u32(0x8000);
            let low = vaddq_u32(vreinterpretq_u32_f32(low), half);
            let high = vaddq_u32(vreinterpretq_u32_f32(high), half);
            // Shift right and insert: the upper half of `low` replaces the lower half of `high`.
            vst1q_u32(to, vsriq_n_u32::<16>(high, low))
        }
    );
}

#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128 {
    use super::Float;
    use std::arch::wasm32::*;

    // ReLU: pmax returns the second operand where it is larger, and the first, here zero,
    // otherwise. A comparison with NaN is false.
    float!(
        v128,
        4,
        |from| v128_load(from.cast()),
        f32x4_convert_i32x4(v128_load(from.cast())),
        |to, x| v128_store(to.cast(), x),
        |value| f32x4_splat(value),
        |a, b| f32x4_add(a, b),
        f32x4_mul(a, b),
        f32x4_pmax(f32x4_splat(0.0), a),
        |low, high, to| {
            let half = u32x4_splat(0x8000);
            let low = u32x4_shr(u32x4_add(low, half), 16);
            let high = v128_and(u32x4_add(high, half), u32x4_splat(0xFFFF_0000));
            v128_store(to.cast(), v128_or(low, high))
        }
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Packs `numbers` by [`Float::store_bf16`], taking registers for `low` and `high` in turn.
    ///
    /// # Safety
    /// The machine has the instructions of `F`.
    #[inline(always)]
    unsafe fn words<F: Float>(numbers: &[f32]) -> Vec<u32> {
        let mut words = vec![0; numbers.len() / 2];
        for (numbers, words) in numbers
            .chunks_exact(2 * F::LANES)
            .zip(words.chunks_exact_mut(F::LANES))
        {
            // SAFETY: the caller's promise; the chunks have two registers of numbers.
            unsafe {
                let (low, high) = (F::load(numbers.as_ptr()), F::load(numbers[F::LANES..].as_ptr()));
                F::store_bf16(low, high, words.as_mut_ptr());
            }
        }
        words
    }

    /// Compares `words` with rounding in integers, on ties, subnormals and infinity.
    fn check<F: Float>(words: unsafe fn(&[f32]) -> Vec<u32>) {
        let ulp = f32::from_bits(1.0f32.to_bits() + 1) - 1.0;
        let tie = 1.0 + 1.0 / 256.0;
        let firsts = [0.0, 1.0, tie, tie - ulp, 3.0e38, 1e-40, f32::INFINITY, 0.3];
        let numbers: Vec<f32> = (0..32)
            .flat_map(|i| firsts.map(|x| x / (1 << (i % 7)) as f32))
            .collect();
        // SAFETY: the caller has checked that the machine has the instructions.
        let found = unsafe { words(&numbers) };
        for (numbers, words) in numbers
            .chunks_exact(2 * F::LANES)
            .zip(found.chunks_exact(F::LANES))
        {
            for (i, word) in words.iter().enumerate() {
                let rounded = |x: f32| (x.to_bits() + 0x8000) >> 16;
                let [low, high] = [numbers[i], numbers[F::LANES + i]];
                assert_eq!(*word, rounded(low) | rounded(high) << 16, "{low} {high}");
            }
        }
    }

    #[test]
    fn bf16_words_hold_rounded_low_and_high_halves() {
        assert_eq!(
            // SAFETY: plain loops.
            unsafe { words::<[f32; 8]>(&[1.0; 8].into_iter().chain([2.0; 8]).collect::<Vec<_>>()) },
            [0x3F80 | 0x4000 << 16; 8]
        );
        check::<[f32; 8]>(words::<[f32; 8]>);
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::x86_64::{__m256, __m512};
            #[target_feature(enable = "avx2")]
            fn avx2(numbers: &[f32]) -> Vec<u32> {
                // SAFETY: the caller has the instructions.
                unsafe { words::<__m256>(numbers) }
            }
            #[target_feature(enable = "avx512f,avx512bw")]
            fn avx512(numbers: &[f32]) -> Vec<u32> {
                // SAFETY: the caller has the instructions.
                unsafe { words::<__m512>(numbers) }
            }
            match is_x86_feature_detected!("avx2") {
                true => check::<__m256>(avx2),
                false => eprintln!("skipped: no AVX2"),
            }
            match is_x86_feature_detected!("avx512bw") {
                true => check::<__m512>(avx512),
                false => eprintln!("skipped: no AVX-512"),
            }
        }
        #[cfg(target_arch = "aarch64")]
        check::<std::arch::aarch64::float32x4_t>(words::<std::arch::aarch64::float32x4_t>);
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        check::<std::arch::wasm32::v128>(words::<std::arch::wasm32::v128>);
    }
}
