//! The machine's own ceiling, measured beside every rate.

use std::hint::black_box;
use std::time::Instant;

use crate::InstructionSet;
#[cfg(target_arch = "x86_64")]
use crate::lanes::Lanes;

/// Multiply-adds of one call per register and lane: about ten milliseconds.
const STEPS: usize = 2_000_000;

/// Measures the f32 multiply-add rate of one core, in FLOP/s, a multiply-add counted as two: independent chains in
/// registers, no memory. 0 without AVX2. Clock rates move, so measure it next to what it is compared with.
pub fn fma_peak() -> f64 {
    match InstructionSet::detect() {
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

/// `steps` multiply-adds on each of `N` independent registers.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
unsafe fn chains<V: Lanes, const N: usize>(factor: f32, steps: usize) -> f32 {
    // SAFETY: the caller's contract: the processor runs V.
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
