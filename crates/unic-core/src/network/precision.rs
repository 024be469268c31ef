//! Number formats of the networks' products, and the instruction sets that have kernels for them.

use crate::simd::Instructions;
#[cfg(target_arch = "x86_64")]
use crate::simd::matrix_units;

/// Number format of the networks' products.
///
/// A model that is read from its file has the fastest one that costs at most 1 % of accuracy
/// ([`Model::fastest_precision`](crate::Model::fastest_precision));
/// [`Model::with_precision`](crate::Model::with_precision) chooses another.
///
/// Sums, biases, the inputs of a vertex and the last layer of the field are f32 in all of them.
/// The integer formats scale weights by output and activations by vertex, so that the largest of
/// them takes the whole range. They need no calibration data, and a vertex does not depend on its
/// neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Precision {
    /// Single precision.
    #[default]
    F32,
    /// bfloat16, 8 significant bits; on matrix units where the processor has them. The encoder's
    /// weights, which every frame reads from memory, are 8-bit integers scaled by row.
    Bf16,
    /// 16-bit integers: activations of 13 bits, weights as fine as sums of 32 bits allow. The
    /// encoder's weights are 16-bit integers too.
    Int16,
    /// 8-bit integers for activations, weights and the encoder's weights.
    Int8,
}

/// Fields with fewer channels are fastest in f32.
const NARROW: usize = 64;

/// Fastest products of low precision that a processor has.
#[derive(Clone, Copy, Debug)]
enum Products {
    /// Matrix units (AMX).
    #[cfg_attr(
        not(target_arch = "x86_64"),
        allow(dead_code, reason = "x86-64 alone has them")
    )]
    Matrix,
    /// Dot products of integers (AVX-512 VNNI).
    #[cfg_attr(
        not(target_arch = "x86_64"),
        allow(dead_code, reason = "x86-64 alone has them")
    )]
    Dot,
    /// None that beats f32.
    Plain,
}

impl Products {
    fn here() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if Precision::Bf16.best_instructions() == Instructions::Amx {
                return Self::Matrix;
            }
            if Precision::Int8.best_instructions() == Instructions::Avx512 {
                return Self::Dot;
            }
        }
        Self::Plain
    }

    fn order(self, width: usize) -> [Precision; 4] {
        use Precision::{Bf16, F32, Int8, Int16};
        match self {
            Self::Matrix if width >= NARROW => [Bf16, Int8, Int16, F32],
            Self::Dot if width >= NARROW => [Int8, Int16, F32, Bf16],
            _ => [F32, Int16, Bf16, Int8],
        }
    }
}

impl Precision {
    /// All precisions, from exact to coarse.
    pub const ALL: [Self; 4] = [Self::F32, Self::Bf16, Self::Int16, Self::Int8];

    /// Name in commands and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Bf16 => "bf16",
            Self::Int16 => "int16",
            Self::Int8 => "int8",
        }
    }

    /// Lists all precisions from the fastest to the slowest on this machine, for a field of so many
    /// channels.
    ///
    /// The order follows from the features of the processor: bf16 with matrix units, 8-bit integers
    /// with dot products of AVX-512, f32 on all others. Narrow fields are fastest in f32, which skips
    /// activations that are zero. It was measured (docs/lab/kernels.md, docs/results/performance.md);
    /// 64-bit ARM has not been measured.
    pub fn fastest_first(width: usize) -> [Self; 4] {
        Products::here().order(width)
    }

    /// Whether f32, which is exact, is faster on this machine ([`Precision::fastest_first`]).
    pub fn is_slower_than_f32(self, width: usize) -> bool {
        let order = Self::fastest_first(width);
        let place = |precision: Self| order.iter().position(|p| *p == precision);
        place(self) > place(Self::F32)
    }

    /// Returns the fastest instruction set of this machine for the precision.
    pub fn best_instructions(self) -> Instructions {
        self.instructions().next().unwrap_or(Instructions::Portable)
    }

    /// Whether this machine has instructions for products of this precision. Other machines compute
    /// them with vectors of f32 or wider integers.
    pub fn has_own_products(self) -> bool {
        match self.best_instructions() {
            #[cfg(target_arch = "x86_64")]
            Instructions::Amx | Instructions::Avx512 => true,
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2 => self == Self::F32,
            #[cfg(target_arch = "aarch64")]
            Instructions::NeonDot => true,
            #[cfg(target_arch = "aarch64")]
            Instructions::Neon => self == Self::F32,
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Instructions::Simd128 => self == Self::F32,
            Instructions::Portable => self == Self::F32,
        }
    }

    /// Lists the instruction sets of this machine for the precision, fastest first.
    pub fn instructions(self) -> impl Iterator<Item = Instructions> {
        let sets = Instructions::ALL.iter().copied();
        sets.filter(move |&set| self.is_available_on(set))
    }

    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64")),
        allow(unused_variables, reason = "instructions are chosen at compile time")
    )]
    fn is_available_on(self, set: Instructions) -> bool {
        let computes_f32 = || Instructions::available().any(|available| available == set);
        match set {
            #[cfg(target_arch = "x86_64")]
            Instructions::Amx => {
                let multiplies = matches!(self, Self::Bf16 | Self::Int8);
                multiplies && self.is_available_on(Instructions::Avx512) && matrix_units::is_available()
            }
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512 => {
                computes_f32()
                    && match self {
                        Self::F32 => true,
                        Self::Bf16 => is_x86_feature_detected!("avx512bf16"),
                        Self::Int16 | Self::Int8 => is_x86_feature_detected!("avx512vnni"),
                    }
            }
            #[cfg(target_arch = "aarch64")]
            Instructions::NeonDot => match self {
                Self::Bf16 => std::arch::is_aarch64_feature_detected!("bf16"),
                Self::Int8 => std::arch::is_aarch64_feature_detected!("dotprod"),
                Self::F32 | Self::Int16 => false,
            },
            // The other sets compute products of every precision with f32 or integer vectors.
            _ => computes_f32(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Precision::*, *};

    #[test]
    fn wide_fields_use_what_the_processor_has_and_narrow_ones_f32() {
        assert_eq!(Products::Matrix.order(256), [Bf16, Int8, Int16, F32]);
        assert_eq!(Products::Dot.order(256), [Int8, Int16, F32, Bf16]);
        for products in [Products::Matrix, Products::Dot, Products::Plain] {
            assert_eq!(products.order(32)[0], F32);
            for precision in Precision::ALL {
                assert!(products.order(256).contains(&precision));
            }
        }
        assert_eq!(Products::Plain.order(256)[0], F32);
    }

    /// Otherwise f32 would be the faster one.
    #[test]
    fn a_precision_before_f32_has_products_of_its_own() {
        assert!(F32.has_own_products());
        let [fastest, ..] = Precision::fastest_first(256);
        assert!(fastest.has_own_products(), "{fastest:?}");
        assert_eq!(
            Int8.has_own_products(),
            matches!(Int8.best_instructions().name(), "amx" | "avx512" | "neondot")
        );
    }

    #[test]
    fn precisions_after_f32_are_slower() {
        for width in [32, 256] {
            let order = Precision::fastest_first(width);
            let f32_at = order.iter().position(|p| *p == F32).unwrap();
            for (place, precision) in order.into_iter().enumerate() {
                assert_eq!(precision.is_slower_than_f32(width), place > f32_at);
            }
        }
    }
}
