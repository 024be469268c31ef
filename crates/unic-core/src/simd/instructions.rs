//! The instruction sets that this crate has code for, detected at run time.

/// Instruction set that kernels run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instructions {
    /// Matrix units for bf16 and int8 (x86-64, AMX), with AVX-512 for everything else.
    #[cfg(target_arch = "x86_64")]
    Amx,
    /// 16 lanes of f32 (x86-64, AVX-512F and AVX-512BW).
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// 8 lanes of f32 (x86-64, AVX2 and FMA).
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// 4 lanes of f32, with dot products of bf16 (FEAT_BF16) or bytes (FEAT_DotProd); 64-bit ARM.
    #[cfg(target_arch = "aarch64")]
    NeonDot,
    /// 4 lanes of f32; every 64-bit ARM.
    #[cfg(target_arch = "aarch64")]
    Neon,
    /// 4 lanes of f32; WebAssembly compiled with `-C target-feature=+simd128`.
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    Simd128,
    /// Plain loops, vectorised by the compiler for the target that it compiles for.
    Portable,
}

impl Instructions {
    /// Returns the fastest set of this machine for arithmetic in f32.
    pub fn best() -> Self {
        Self::available().next().unwrap_or(Self::Portable)
    }

    /// Name in tables and in other languages, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Amx => "amx",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => "avx512",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => "avx2",
            #[cfg(target_arch = "aarch64")]
            Self::NeonDot => "neondot",
            #[cfg(target_arch = "aarch64")]
            Self::Neon => "neon",
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128 => "simd128",
            Self::Portable => "portable",
        }
    }

    /// Lists the sets of this machine for arithmetic in f32, fastest first.
    ///
    /// [`Precision::instructions`](crate::Precision::instructions) lists those for products of
    /// shorter numbers.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.iter().copied().filter(|set| set.computes_f32())
    }

    /// Runs `work`, compiled for this set: loops over arrays of lanes become vector code.
    ///
    /// Only what is inlined into `work` is compiled for the set, so closures that it calls are
    /// marked `#[inline(always)]`. Rust never fuses a product with a sum by itself, so results are
    /// the same bits for all sets.
    pub(crate) fn run<R>(self, work: impl FnOnce() -> R) -> R {
        match self {
            // SAFETY: values other than `Portable` come from detection on this machine.
            #[cfg(target_arch = "x86_64")]
            Self::Amx | Self::Avx512 => unsafe { with_avx512(work) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { with_avx2(work) },
            // The compiler may use NEON and simd128 everywhere on these targets.
            #[cfg(target_arch = "aarch64")]
            Self::NeonDot | Self::Neon => work(),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128 => work(),
            Self::Portable => work(),
        }
    }

    /// Every set that the target can have, fastest first.
    pub(crate) const ALL: &[Self] = &[
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

    /// Tells whether this machine has the set and whether the set has f32 arithmetic of its own.
    fn computes_f32(self) -> bool {
        match self {
            // AVX-512 without matrix units does the same on f32.
            #[cfg(target_arch = "x86_64")]
            Self::Amx => false,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            // NEON does the same on f32.
            #[cfg(target_arch = "aarch64")]
            Self::NeonDot => false,
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
