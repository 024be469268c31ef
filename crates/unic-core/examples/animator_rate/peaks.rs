//! Peak rates of the machine: independent chains of multiply-adds in registers, without memory.

use std::hint::black_box;
use unic_core::{Precision, simd::Instructions};

/// Measures the peak rate of one thread in FLOP a second of its CPU time, two FLOP a multiply-add.
///
/// `set` is available on this machine. Returns `None` for sets without a loop here.
pub(crate) fn peak(precision: Precision, set: Instructions) -> Option<f64> {
    match set {
        // SAFETY (of every loop): the caller's machine has the instructions.
        #[cfg(target_arch = "x86_64")]
        Instructions::Amx => match precision {
            // SAFETY: see above.
            Precision::Bf16 => Some(rate(x86::tile_flop(32), || unsafe { x86::amx_bf16() })),
            // SAFETY: see above.
            Precision::Int8 => Some(rate(x86::tile_flop(64), || unsafe { x86::amx_int8() })),
            Precision::F32 | Precision::Int16 => None,
        },
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => Some(match precision {
            // SAFETY: see above.
            Precision::F32 => rate(x86::flop(16), || unsafe { x86::f32(black_box(0.5)) }),
            // SAFETY: see above.
            Precision::Bf16 => rate(x86::flop(32), || unsafe { x86::bf16(black_box(0.5)) }),
            // SAFETY: see above.
            Precision::Int16 => rate(x86::flop(32), || unsafe { x86::int16(black_box(5)) }),
            // SAFETY: see above.
            Precision::Int8 => rate(x86::flop(64), || unsafe { x86::int8(black_box(5)) }),
        }),
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => match precision {
            // SAFETY: see above.
            Precision::F32 => Some(rate(x86::FLOP_AVX2, || unsafe { x86::f32_avx2(black_box(0.5)) })),
            // A product takes several instructions, whose peak is no useful limit.
            Precision::Bf16 | Precision::Int16 | Precision::Int8 => None,
        },
        #[cfg(target_arch = "aarch64")]
        Instructions::NeonDot | Instructions::Neon => None,
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        Instructions::Simd128 => None,
        Instructions::Portable => None,
    }
}

/// Runs a loop of `flop` FLOP and returns its rate in FLOP a second.
#[cfg(target_arch = "x86_64")]
fn rate(flop: usize, run: impl FnOnce()) -> f64 {
    let start = cpu_seconds();
    run();
    flop as f64 / (cpu_seconds() - start)
}

/// CPU time of this thread in seconds, which other programs hardly change.
pub(crate) fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::{asm, x86_64::*};

    /// Iterations of a loop over vector registers, some milliseconds.
    const STEPS: usize = 500_000;
    /// Iterations of a loop over tile registers, some milliseconds.
    const TILES: usize = 100_000;
    /// Independent sums in AVX-512: enough to hide the latency, few enough to stay in registers.
    const CHAINS: usize = 24;
    /// Independent sums in AVX2, which has half as many registers.
    const CHAINS_AVX2: usize = 12;

    /// FLOP of a loop over AVX-512 registers, with this many multiply-adds an instruction.
    pub(super) const fn flop(multiply_adds: usize) -> usize {
        2 * CHAINS * multiply_adds * STEPS
    }

    /// FLOP of a loop over AVX2 registers of f32.
    pub(super) const FLOP_AVX2: usize = 2 * CHAINS_AVX2 * 8 * STEPS;

    /// FLOP of a loop over tile registers, with this many multiply-adds for each of 16 × 16 sums.
    pub(super) const fn tile_flop(multiply_adds: usize) -> usize {
        2 * 4 * 16 * 16 * multiply_adds * TILES
    }

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
            // SAFETY: vectors of the same size, valid for any bits.
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
    /// Multiplies tile registers into four sums of 16 × 16 numbers.
    ///
    /// # Safety
    /// The machine has AMX, and the system lets this process use it.
    pub(super) unsafe fn $name() {
        #[repr(align(64))]
        struct Configuration([u8; 64]);
        let mut configuration = Configuration([0; 64]);
        configuration.0[0] = 1;
        for register in 0..8 {
            configuration.0[16 + 2 * register] = 64;
            configuration.0[48 + register] = 16;
        }
        // SAFETY: the caller's machine has the registers. The configuration is 64 bytes long and
        // describes eight registers of 16 rows of 64 bytes; nothing else is read.
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
