//! Vectors of f32, and products of a row of weights with a vector.

use super::{Instructions, rows::Weight};

/// A vector register's worth of f32.
///
/// # Safety
/// Callers run on a machine that has the instructions of the implementing type, and pointers are
/// valid for `LANES` numbers.
pub(super) trait Vector: Copy {
    const LANES: usize;
    unsafe fn load(from: *const f32) -> Self;
    /// As many weights, widened.
    unsafe fn load_weights<T: Weight>(from: *const T) -> Self;
    /// Asks for a line of memory; never faults.
    unsafe fn prefetch<T>(_: *const T) {}
    unsafe fn splat(value: f32) -> Self;
    /// self + a · b
    unsafe fn add_product(self, a: Self, b: Self) -> Self;
    /// Sum over the lanes.
    unsafe fn sum(self) -> f32;
}

/// Σ weights_i · x_i over the shorter length.
pub(super) fn dot<T: Weight>(instructions: Instructions, weights: &[T], x: &[f32]) -> f32 {
    dots(instructions, [weights], x)[0]
}

/// The same for several rows at once, which memory serves faster than one after another.
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
        // What a row waits for is memory: plain arrays are fast enough where the target always has vectors.
        #[cfg(target_arch = "aarch64")]
        Instructions::NeonDot | Instructions::Neon => dots_portable(rows, x),
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        Instructions::Simd128 => dots_portable(rows, x),
        Instructions::Portable => dots_portable(rows, x),
    }
}

fn dots_portable<T: Weight, const R: usize>(rows: [&[T]; R], x: &[f32]) -> [f32; R] {
    // SAFETY: plain arrays need no instructions.
    unsafe { dots_of::<[f32; 8], T, R>(rows, x) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw")]
fn dots_avx512<T: Weight, const R: usize>(rows: [&[T]; R], x: &[f32]) -> [f32; R] {
    // SAFETY: the caller has AVX-512.
    unsafe { dots_of::<std::arch::x86_64::__m512, T, R>(rows, x) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn dots_avx2<T: Weight, const R: usize>(rows: [&[T]; R], x: &[f32]) -> [f32; R] {
    // SAFETY: the caller has AVX2 and FMA.
    unsafe { dots_of::<std::arch::x86_64::__m256, T, R>(rows, x) }
}

/// Bytes from a weight that is used to one that is asked for. The processor's own prefetching ends at
/// every page; rows lie one after another, so that the end of one asks for the next.
const AHEAD: usize = 4096;

/// Running sums of a row: with one row they alone hide the latency of the multiply-add.
const SUMS: usize = 4;

/// # Safety
/// The machine has the instructions of `V`.
#[inline(always)]
unsafe fn dots_of<V: Vector, T: Weight, const R: usize>(rows: [&[T]; R], x: &[f32]) -> [f32; R] {
    let count = rows.iter().fold(x.len(), |count, row| count.min(row.len()));
    let whole = count - count % (SUMS * V::LANES);
    // SAFETY: every pointer stays `SUMS · LANES` numbers before `whole` ≤ all lengths.
    let mut totals = unsafe {
        let mut sums = [[V::splat(0.0); SUMS]; R];
        for i in (0..whole).step_by(SUMS * V::LANES) {
            for k in 0..SUMS {
                let at = i + k * V::LANES;
                let x = V::load(x.as_ptr().add(at));
                for (sums, row) in sums.iter_mut().zip(rows) {
                    V::prefetch(row.as_ptr().wrapping_add(at).wrapping_byte_add(AHEAD));
                    sums[k] = sums[k].add_product(V::load_weights(row.as_ptr().add(at)), x);
                }
            }
        }
        sums.map(|sums| sums.map(|s| s.sum()).iter().sum::<f32>())
    };
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
