//! Dot products of rows of weights with a vector of f32.

use super::rows::Weight;
use crate::simd::Instructions;

/// Vector register of f32 that dot products are summed in.
///
/// # Safety
/// Callers run on a machine that has the instructions of the implementing type, and pointers are
/// valid for `LANES` numbers.
pub(super) trait Vector: Copy {
    const LANES: usize;
    unsafe fn load(from: *const f32) -> Self;
    /// Loads `LANES` weights and converts them to f32.
    unsafe fn load_weights<T: Weight>(from: *const T) -> Self;
    /// Prefetches a cache line; never faults, so that the address may lie beyond the buffer.
    unsafe fn prefetch<T>(_: *const T) {}
    unsafe fn splat(value: f32) -> Self;
    /// Returns self + a · b, fused where the instruction set has it.
    unsafe fn add_product(self, a: Self, b: Self) -> Self;
    /// Sums the lanes.
    unsafe fn sum(self) -> f32;
}

/// Returns Σ weights_i · x_i over the shorter length.
pub(super) fn dot<T: Weight>(instructions: Instructions, weights: &[T], x: &[f32]) -> f32 {
    dots(instructions, [weights], x)[0]
}

/// Returns [`dot`] of several rows with the same `x`.
///
/// Memory delivers several rows that are read side by side faster than one after another.
pub(super) fn dots<T: Weight, const R: usize>(
    instructions: Instructions,
    rows: [&[T]; R],
    x: &[f32],
) -> [f32; R] {
    match instructions {
        // SAFETY: `instructions` comes from detection on this machine.
        #[cfg(target_arch = "x86_64")]
        Instructions::Amx | Instructions::Avx512 => unsafe { dots_avx512(rows, x) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { dots_avx2(rows, x) },
        // The products wait for memory: plain arrays, which the compiler vectorises for these
        // targets, are fast enough.
        #[cfg(target_arch = "aarch64")]
        Instructions::NeonDot | Instructions::Neon => dots_portable(rows, x),
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        Instructions::Simd128 => dots_portable(rows, x),
        Instructions::Portable => dots_portable(rows, x),
    }
}

fn dots_portable<T: Weight, const R: usize>(rows: [&[T]; R], x: &[f32]) -> [f32; R] {
    // SAFETY: plain arrays need no instructions.
    unsafe { dots_in::<[f32; 8], T, R>(rows, x) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw")]
fn dots_avx512<T: Weight, const R: usize>(rows: [&[T]; R], x: &[f32]) -> [f32; R] {
    // SAFETY: the caller has AVX-512.
    unsafe { dots_in::<std::arch::x86_64::__m512, T, R>(rows, x) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn dots_avx2<T: Weight, const R: usize>(rows: [&[T]; R], x: &[f32]) -> [f32; R] {
    // SAFETY: the caller has AVX2 and FMA.
    unsafe { dots_in::<std::arch::x86_64::__m256, T, R>(rows, x) }
}

/// Prefetch distance in bytes, one page.
///
/// The processor's own prefetcher stops at page boundaries. Rows lie one after another in memory,
/// so that the end of a row prefetches the next one.
const PREFETCH_BYTES: usize = 4096;

/// Independent sums of a row. A single row needs four to hide the latency of the multiply-add.
const SUMS: usize = 4;

/// Returns [`dots`], computed in registers of type `V`.
///
/// # Safety
/// The machine has the instructions of `V`.
#[inline(always)]
unsafe fn dots_in<V: Vector, T: Weight, const R: usize>(rows: [&[T]; R], x: &[f32]) -> [f32; R] {
    let count = rows.iter().fold(x.len(), |count, row| count.min(row.len()));
    let whole = count - count % (SUMS * V::LANES);
    // SAFETY: loads end at `whole` at the latest, which no slice is shorter than.
    let mut totals = unsafe {
        let mut sums = [[V::splat(0.0); SUMS]; R];
        for i in (0..whole).step_by(SUMS * V::LANES) {
            for k in 0..SUMS {
                let at = i + k * V::LANES;
                let x = V::load(x.as_ptr().add(at));
                for (sums, row) in sums.iter_mut().zip(rows) {
                    V::prefetch(row.as_ptr().wrapping_add(at).wrapping_byte_add(PREFETCH_BYTES));
                    sums[k] = sums[k].add_product(V::load_weights(row.as_ptr().add(at)), x);
                }
            }
        }
        sums.map(|sums| sums.map(|s| s.sum()).iter().sum::<f32>())
    };
    // The remainder, fewer numbers than one pass of the loop above takes.
    for (total, row) in totals.iter_mut().zip(rows) {
        *total += (whole..count).map(|i| row[i].number() * x[i]).sum::<f32>();
    }
    totals
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Vector, Weight};
    use std::arch::x86_64::*;

    // SAFETY (all methods): the trait's contract gives the instructions and valid pointers; loads
    // and stores are the unaligned ones.
    impl Vector for __m512 {
        const LANES: usize = 16;
        #[inline(always)]
        unsafe fn load(from: *const f32) -> Self {
            // SAFETY: see above.
            unsafe { _mm512_loadu_ps(from) }
        }
        #[inline(always)]
        unsafe fn load_weights<T: Weight>(from: *const T) -> Self {
            // SAFETY: see above.
            unsafe { T::load_16(from) }
        }
        #[inline(always)]
        unsafe fn prefetch<T>(line: *const T) {
            // SAFETY: see above.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(line.cast()) }
        }
        #[inline(always)]
        unsafe fn splat(value: f32) -> Self {
            // SAFETY: see above.
            unsafe { _mm512_set1_ps(value) }
        }
        #[inline(always)]
        unsafe fn add_product(self, a: Self, b: Self) -> Self {
            // SAFETY: see above.
            unsafe { _mm512_fmadd_ps(a, b, self) }
        }
        #[inline(always)]
        unsafe fn sum(self) -> f32 {
            // SAFETY: see above.
            unsafe { _mm512_reduce_add_ps(self) }
        }
    }

    impl Vector for __m256 {
        const LANES: usize = 8;
        #[inline(always)]
        unsafe fn load(from: *const f32) -> Self {
            // SAFETY: see above.
            unsafe { _mm256_loadu_ps(from) }
        }
        #[inline(always)]
        unsafe fn load_weights<T: Weight>(from: *const T) -> Self {
            // SAFETY: see above.
            unsafe { T::load_8(from) }
        }
        #[inline(always)]
        unsafe fn prefetch<T>(line: *const T) {
            // SAFETY: see above.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(line.cast()) }
        }
        #[inline(always)]
        unsafe fn splat(value: f32) -> Self {
            // SAFETY: see above.
            unsafe { _mm256_set1_ps(value) }
        }
        #[inline(always)]
        unsafe fn add_product(self, a: Self, b: Self) -> Self {
            // SAFETY: see above.
            unsafe { _mm256_fmadd_ps(a, b, self) }
        }
        #[inline(always)]
        unsafe fn sum(self) -> f32 {
            let mut lanes = [0.0; 8];
            // SAFETY: see above; the array holds eight numbers.
            unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), self) };
            lanes.iter().sum()
        }
    }
}

impl Vector for [f32; 8] {
    const LANES: usize = 8;
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller's pointer is valid for eight numbers.
        unsafe { from.cast::<Self>().read_unaligned() }
    }
    #[inline(always)]
    unsafe fn load_weights<T: Weight>(from: *const T) -> Self {
        // SAFETY: the caller's pointer is valid for eight weights.
        unsafe { from.cast::<[T; 8]>().read() }.map(T::number)
    }
    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        [value; 8]
    }
    #[inline(always)]
    unsafe fn add_product(self, a: Self, b: Self) -> Self {
        std::array::from_fn(|i| self[i] + a[i] * b[i])
    }
    #[inline(always)]
    unsafe fn sum(self) -> f32 {
        self.iter().sum()
    }
}
