//! SIMD vectors of f32, and the choice between instruction sets at run time.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

/// Instruction sets that the kernels run on. All except [`Amx`](Self::Amx) compute the same bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum InstructionSet {
    /// AMX, the matrix units of Intel processors since Sapphire Rapids. Factors are rounded to
    /// bf16, sums are f32. Several times as fast as the others, but never chosen by default.
    Amx,
    /// AVX-512 with 16 lanes: Intel since Skylake-X, AMD since Zen 4.
    Avx512,
    /// AVX2 with 8 lanes and fused multiply-add: x86 since 2013.
    Avx2,
    /// Plain Rust with 4 lanes; slow where the target has no fused multiply-add.
    Portable,
}

impl InstructionSet {
    /// Returns the widest set with exact f32 arithmetic that this processor runs.
    pub fn detect() -> Self {
        [Self::Avx512, Self::Avx2]
            .into_iter()
            .find(|set| set.is_available())
            .unwrap_or(Self::Portable)
    }

    /// Returns whether this processor runs the set.
    pub fn is_available(self) -> bool {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Amx => crate::amx::is_available(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => is_x86_feature_detected!("avx512f"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Amx | Self::Avx512 | Self::Avx2 => false,
            Self::Portable => true,
        }
    }
}

/// A SIMD vector of `COUNT` f32.
///
/// # Safety
/// The processor must run the instruction set, and pointers must be valid for `COUNT` floats. This
/// applies to every method.
pub(crate) trait SimdVector: Copy {
    /// Number of f32 in a vector.
    const COUNT: usize;
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    unsafe fn splat(value: f32) -> Self;
    unsafe fn add(self, other: Self) -> Self;
    /// Computes `self · factor + sum`, rounded once.
    unsafe fn mul_add(self, factor: Self, sum: Self) -> Self;
    /// Computes max(0, self). NaN stays NaN, so that diverged training is visible.
    unsafe fn relu(self) -> Self;
    /// Selects self where `gate` > 0, else 0.
    unsafe fn where_positive(self, gate: Self) -> Self;
    /// Prefetches a cache line into the first-level cache; never faults.
    unsafe fn prefetch(line: *const f32);
    /// Prefetches a cache line into the second-level cache; never faults.
    unsafe fn prefetch_far(line: *const f32);
}

#[cfg(target_arch = "x86_64")]
macro_rules! x86_simd_vector {
    ($register:ty, $count:literal, $load:ident, $store:ident, $splat:ident, $add:ident, $fma:ident, $max:ident,
     $zero:ident, |$value:ident, $gate:ident| $gated:expr) => {
        // SAFETY (all blocks below): the trait's contract, passed on to the intrinsic.
        #[allow(
            clippy::undocumented_unsafe_blocks,
            reason = "one contract for all, stated above"
        )]
        impl SimdVector for $register {
            const COUNT: usize = $count;
            #[inline(always)]
            unsafe fn load(from: *const f32) -> Self {
                unsafe { $load(from) }
            }
            #[inline(always)]
            unsafe fn store(self, to: *mut f32) {
                unsafe { $store(to, self) }
            }
            #[inline(always)]
            unsafe fn splat(value: f32) -> Self {
                unsafe { $splat(value) }
            }
            #[inline(always)]
            unsafe fn add(self, other: Self) -> Self {
                unsafe { $add(self, other) }
            }
            #[inline(always)]
            unsafe fn mul_add(self, factor: Self, sum: Self) -> Self {
                unsafe { $fma(self, factor, sum) }
            }
            #[inline(always)]
            unsafe fn relu(self) -> Self {
                // maxps returns its second operand when either is NaN.
                unsafe { $max($zero(), self) }
            }
            #[inline(always)]
            unsafe fn where_positive(self, $gate: Self) -> Self {
                let $value = self;
                unsafe { $gated }
            }
            #[inline(always)]
            unsafe fn prefetch(line: *const f32) {
                unsafe { _mm_prefetch::<_MM_HINT_T0>(line.cast()) }
            }
            #[inline(always)]
            unsafe fn prefetch_far(line: *const f32) {
                unsafe { _mm_prefetch::<_MM_HINT_T1>(line.cast()) }
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
x86_simd_vector!(
    __m512,
    16,
    _mm512_loadu_ps,
    _mm512_storeu_ps,
    _mm512_set1_ps,
    _mm512_add_ps,
    _mm512_fmadd_ps,
    _mm512_max_ps,
    _mm512_setzero_ps,
    |value, gate| _mm512_maskz_mov_ps(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(gate, _mm512_setzero_ps()), value)
);

#[cfg(target_arch = "x86_64")]
x86_simd_vector!(
    __m256,
    8,
    _mm256_loadu_ps,
    _mm256_storeu_ps,
    _mm256_set1_ps,
    _mm256_add_ps,
    _mm256_fmadd_ps,
    _mm256_max_ps,
    _mm256_setzero_ps,
    |value, gate| _mm256_and_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(gate, _mm256_setzero_ps()), value)
);

/// A vector of four f32 in plain Rust.
#[derive(Clone, Copy)]
pub(crate) struct F32x4([f32; 4]);

impl SimdVector for F32x4 {
    const COUNT: usize = 4;
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the trait's contract makes four floats valid; `[f32; 4]` is aligned as `f32` is.
        Self(unsafe { from.cast::<[f32; 4]>().read() })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: as for `load`.
        unsafe { to.cast::<[f32; 4]>().write(self.0) }
    }
    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self([value; 4])
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, sum: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].mul_add(factor.0[i], sum.0[i])))
    }
    #[inline(always)]
    unsafe fn relu(self) -> Self {
        // The comparison is false for NaN, which `f32::max` would turn into zero.
        Self(self.0.map(|value| if 0.0 > value { 0.0 } else { value }))
    }
    #[inline(always)]
    unsafe fn where_positive(self, gate: Self) -> Self {
        Self(std::array::from_fn(
            |i| if gate.0[i] > 0.0 { self.0[i] } else { 0.0 },
        ))
    }
    #[inline(always)]
    unsafe fn prefetch(_line: *const f32) {}
    #[inline(always)]
    unsafe fn prefetch_far(_line: *const f32) {}
}
