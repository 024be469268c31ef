//! The machine's own ceilings: independent chains of multiply-adds in registers, no memory.

#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "callers detect the instructions; nothing touches memory"
)]

use std::hint::black_box;
use unic_core::network::{Instructions, Precision};

/// Multiply-adds of one thread, two FLOP each, a second of its CPU time. None where there is no loop for
/// the instructions. Clock rates move, so measure it next to what it is compared with.
pub(crate) fn peak(precision: Precision, set: Instructions) -> Option<f64> {
    let rate = |flop: usize, run: &dyn Fn()| {
        let start = cpu_seconds();
        run();
        Some(flop as f64 / (cpu_seconds() - start))
    };
    match set {
        #[cfg(target_arch = "x86_64")]
        Instructions::Amx if precision == Precision::Bf16 => {
            rate(2 * 4 * 16 * 16 * 32 * x86::TILES, &|| unsafe { x86::amx_bf16() })
        }
        #[cfg(target_arch = "x86_64")]
        Instructions::Amx => rate(2 * 4 * 16 * 16 * 64 * x86::TILES, &|| unsafe { x86::amx_int8() }),
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => {
            let flop = |channels: usize| 2 * x86::CHAINS * 16 * channels * x86::STEPS;
            match precision {
                Precision::F32 => rate(flop(1), &|| unsafe { x86::f32(black_box(0.5)) }),
                Precision::Bf16 => rate(flop(2), &|| unsafe { x86::bf16(black_box(0.5)) }),
                Precision::Int16 => rate(flop(2), &|| unsafe { x86::int16(black_box(5)) }),
                Precision::Int8 => rate(flop(4), &|| unsafe { x86::int8(black_box(5)) }),
            }
        }
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 if precision == Precision::F32 => {
            let flop = 2 * x86::CHAINS_AVX2 * 8 * x86::STEPS;
            rate(flop, &|| unsafe { x86::f32_avx2(black_box(0.5)) })
        }
        _ => None,
    }
}

/// CPU time of this thread: what else the machine does has little part in it.
pub(crate) fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::{asm, x86_64::*};

    /// Some milliseconds.
    pub(super) const STEPS: usize = 500_000;
    pub(super) const TILES: usize = 100_000;
    /// Enough to hide the latency, few enough to stay in registers.
    pub(super) const CHAINS: usize = 24;
    pub(super) const CHAINS_AVX2: usize = 12;

    macro_rules! chains {
        ($name:ident, $features:literal, $count:ident, $scalar:ty, $splat:ident, |$sum:ident, $x:ident| $step:expr) => {
            #[target_feature(enable = $features)]
            pub(super) fn $name(x: $scalar) {
                let $x = $splat(x);
                let mut sums = [$x; $count];
                for _ in 0..STEPS {
                    for $sum in &mut sums {
                        *$sum = $step;
                    }
                }
                std::hint::black_box(&sums);
            }
        };
    }

    chains!(f32, "avx512f", CHAINS, f32, _mm512_set1_ps, |sum, x| {
        _mm512_fmadd_ps(*sum, x, x)
    });
    chains!(
        f32_avx2,
        "avx2,fma",
        CHAINS_AVX2,
        f32,
        _mm256_set1_ps,
        |sum, x| _mm256_fmadd_ps(*sum, x, x)
    );
    chains!(
        bf16,
        "avx512f,avx512bf16",
        CHAINS,
        f32,
        _mm512_set1_ps,
        |sum, x| {
            let pairs = unsafe { std::mem::transmute::<__m512, __m512bh>(x) };
            _mm512_dpbf16_ps(*sum, pairs, pairs)
        }
    );
    chains!(
        int16,
        "avx512f,avx512vnni",
        CHAINS,
        i32,
        _mm512_set1_epi32,
        |sum, x| _mm512_dpwssd_epi32(*sum, x, x)
    );
    chains!(
        int8,
        "avx512f,avx512vnni",
        CHAINS,
        i32,
        _mm512_set1_epi32,
        |sum, x| _mm512_dpbusd_epi32(*sum, x, x)
    );

    macro_rules! tiles {
        ($name:ident, $multiply:literal) => {
    /// Four sums of 16 × 16 in tile registers.
    pub(super) unsafe fn $name() {
        #[repr(align(64))]
        struct Configuration([u8; 64]);
        let mut configuration = Configuration([0; 64]);
        configuration.0[0] = 1;
        for register in 0..8 {
            configuration.0[16 + 2 * register] = 64;
            configuration.0[48 + register] = 16;
        }
        unsafe {
            asm!(
                "ldtilecfg [{configuration}]",
                "tilezero tmm0", "tilezero tmm1", "tilezero tmm2", "tilezero tmm3",
                "tilezero tmm4", "tilezero tmm5", "tilezero tmm6", "tilezero tmm7",
                "2:",
                concat!($multiply, " tmm0, tmm4, tmm6"),
                concat!($multiply, " tmm1, tmm4, tmm7"),
                concat!($multiply, " tmm2, tmm5, tmm6"),
                concat!($multiply, " tmm3, tmm5, tmm7"),
                "dec {steps}",
                "jnz 2b",
                "tilerelease",
                configuration = in(reg) configuration.0.as_ptr(),
                steps = inout(reg) TILES => _,
                out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
                out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
            );
        }
    }
        };
    }

    tiles!(amx_bf16, "tdpbf16ps");
    tiles!(amx_int8, "tdpbsud");
}
