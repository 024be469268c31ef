//! What this machine's processor can do, found out at run time.

use super::Precision;

/// Instruction set that kernels run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instructions {
    /// Matrix units for bf16 and int8 (x86-64, AMX), with AVX-512 for the rest.
    #[cfg(target_arch = "x86_64")]
    Amx,
    /// 16 lanes (x86-64, AVX-512F), with the extension that a precision needs: BF16 or VNNI.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// 8 lanes, x86-64 with AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Dot products of 16-bit floats (FEAT_BF16) or of bytes (FEAT_DotProd) in 4 lanes (64-bit ARM).
    #[cfg(target_arch = "aarch64")]
    NeonDot,
    /// 4 lanes, every 64-bit ARM.
    #[cfg(target_arch = "aarch64")]
    Neon,
    /// 4 lanes, WebAssembly that is compiled with `-C target-feature=+simd128`.
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    Simd128,
    /// Whatever the compiler makes of plain loops.
    Portable,
}

impl Instructions {
    /// The fastest that this machine has for a precision.
    pub fn best(precision: Precision) -> Self {
        Self::available(precision).next().unwrap_or(Self::Portable)
    }

    /// All that this machine has for a precision, fastest first.
    pub fn available(precision: Precision) -> impl Iterator<Item = Self> {
        let all = Self::ALL.iter().copied();
        all.filter(move |set| set.is_available(precision))
    }

    /// Does the work with the compiler's own choice of these instructions: loops over lanes become vectors
    /// where all of it is inlined, closures too. The bits of the result are the same for all sets.
    pub(crate) fn run<R>(self, work: impl FnOnce() -> R) -> R {
        match self {
            // SAFETY: a set is only ever named on a machine that has it.
            #[cfg(target_arch = "x86_64")]
            Self::Amx | Self::Avx512 => unsafe { with_avx512(work) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { with_avx2(work) },
            // What the target always has, the compiler takes anyway.
            #[cfg(target_arch = "aarch64")]
            Self::NeonDot | Self::Neon => work(),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128 => work(),
            Self::Portable => work(),
        }
    }

    const ALL: &[Self] = &[
        #[cfg(target_arch = "x86_64")]
        Self::Amx,
        #[cfg(target_arch = "x86_64")]
        Self::Avx512,
        #[cfg(target_arch = "x86_64")]
        Self::Avx2,
        #[cfg(target_arch = "aarch64")]
        Self::NeonDot,
        #[cfg(target_arch = "aarch64")]
        Self::Neon,
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        Self::Simd128,
        Self::Portable,
    ];

    #[cfg_attr(
        target_arch = "wasm32",
        allow(unused_variables, reason = "instructions are chosen when it is compiled")
    )]
    fn is_available(self, precision: Precision) -> bool {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Amx => {
                let multiplies = matches!(precision, Precision::Bf16 | Precision::Int8);
                multiplies && has_avx512(precision) && super::matrix_units::is_available()
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => has_avx512(precision),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "aarch64")]
            Self::NeonDot => match precision {
                Precision::Bf16 => std::arch::is_aarch64_feature_detected!("bf16"),
                Precision::Int8 => std::arch::is_aarch64_feature_detected!("dotprod"),
                Precision::F32 | Precision::Int16 => false,
            },
            #[cfg(target_arch = "aarch64")]
            Self::Neon => true,
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128 => true,
            Self::Portable => true,
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn with_avx512<R>(work: impl FnOnce() -> R) -> R {
    work()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<R>(work: impl FnOnce() -> R) -> R {
    work()
}

#[cfg(target_arch = "x86_64")]
fn has_avx512(precision: Precision) -> bool {
    let extension = match precision {
        Precision::F32 => true,
        Precision::Bf16 => is_x86_feature_detected!("avx512bf16"),
        Precision::Int16 | Precision::Int8 => is_x86_feature_detected!("avx512vnni"),
    };
    extension && is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw")
}
