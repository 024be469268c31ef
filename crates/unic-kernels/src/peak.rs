//! Peak multiply-add throughput of the processor, to compare measured throughput with.

use std::hint::black_box;
use std::time::Instant;

use crate::InstructionSet;
#[cfg(target_arch = "x86_64")]
use crate::simd::SimdVector;

/// Multiply-adds per register and lane in one measurement, which takes about ten milliseconds.
const STEPS: usize = 2_000_000;

/// Measures the peak f32 multiply-add throughput of one core, in FLOP/s. A multiply-add counts as
/// two operations. Returns 0 without AVX2.
///
/// Clock rates vary over time, so that the peak should be measured close to what it is compared
/// with.
pub fn fma_peak() -> f64 {
    match InstructionSet::detect() {
        // As many independent chains as registers allow: a multiply-add takes about four cycles,
        // and two can start in each.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => rate(24 * 16, || {
            // SAFETY: detected.
            unsafe { chains_avx512(black_box(0.5), STEPS) }
        }),
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => rate(12 * 8, || {
            // SAFETY: detected.
            unsafe { chains_avx2(black_box(0.5), STEPS) }
        }),
        _ => 0.0,
    }
}

#[cfg(target_arch = "x86_64")]
fn rate(lanes: usize, run: impl Fn() -> f32) -> f64 {
    let start = Instant::now();
    black_box(run());
    2.0 * (lanes * STEPS) as f64 / start.elapsed().as_secs_f64()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn chains_avx512(factor: f32, steps: usize) -> f32 {
    // SAFETY: the caller has detected the feature.
    unsafe { chains::<std::arch::x86_64::__m512, 24>(factor, steps) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn chains_avx2(factor: f32, steps: usize) -> f32 {
    // SAFETY: the caller has detected the features.
    unsafe { chains::<std::arch::x86_64::__m256, 12>(factor, steps) }
}

/// Computes `steps` multiply-adds on each of `N` independent registers, without memory accesses.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
unsafe fn chains<V: SimdVector, const N: usize>(factor: f32, steps: usize) -> f32 {
    // SAFETY: the caller guarantees that the processor runs V.
    unsafe {
        let factor = V::splat(factor);
        let mut sums = [factor; N];
        for _ in 0..steps {
            for sum in &mut sums {
                *sum = sum.mul_add(factor, factor);
            }
        }
        let total = sums.into_iter().fold(V::splat(0.0), |total, sum| total.add(sum));
        let mut lanes = [0.0; 16];
        total.store(lanes.as_mut_ptr());
        lanes.iter().sum()
    }
}
