//! Rows of weights at half or a quarter of their size: a product with one vector reads every weight
//! once, so that it takes as long as memory does.

use super::{
    Instructions, Linear, Precision,
    vector::{dot, dots},
};
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

/// Weights of one linear map in the form that a precision stores them in. f32 stays in the map itself.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Rows {
    F32,
    /// Whole numbers, and what a unit of each row is worth.
    Int16(Vec<i16>, Vec<f32>),
    Int8(Vec<i8>, Vec<f32>),
}

/// A stored weight.
///
/// # Safety
/// Pointers of `load_*` are valid for so many weights, and the machine has AVX-512 (16) or AVX2 (8).
pub(super) trait Weight: Copy {
    fn number(self) -> f32;
    #[cfg(target_arch = "x86_64")]
    unsafe fn load_16(from: *const Self) -> __m512;
    #[cfg(target_arch = "x86_64")]
    unsafe fn load_8(from: *const Self) -> __m256;
}

macro_rules! weight {
    ($type:ty, |$value:ident| $number:expr, |$from:ident| $sixteen:expr, $eight:expr) => {
        // SAFETY (all blocks below): the trait's contract, passed on to the intrinsic.
        #[allow(
            clippy::undocumented_unsafe_blocks,
            reason = "one contract for all, stated above"
        )]
        impl Weight for $type {
            #[inline(always)]
            fn number(self) -> f32 {
                let $value = self;
                $number
            }
            #[cfg(target_arch = "x86_64")]
            #[inline(always)]
            unsafe fn load_16($from: *const Self) -> __m512 {
                unsafe { $sixteen }
            }
            #[cfg(target_arch = "x86_64")]
            #[inline(always)]
            unsafe fn load_8($from: *const Self) -> __m256 {
                unsafe { $eight }
            }
        }
    };
}

weight!(f32, |w| w, |from| _mm512_loadu_ps(from), _mm256_loadu_ps(from));
weight!(
    i16,
    |w| f32::from(w),
    |from| _mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(_mm256_loadu_si256(from.cast()))),
    _mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(_mm_loadu_si128(from.cast())))
);
weight!(
    i8,
    |w| f32::from(w),
    |from| _mm512_cvtepi32_ps(_mm512_cvtepi8_epi32(_mm_loadu_si128(from.cast()))),
    _mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(_mm_loadl_epi64(from.cast())))
);

impl Rows {
    pub(super) fn new(layer: &Linear, precision: Precision) -> Self {
        match precision {
            Precision::F32 => Self::F32,
            Precision::Int16 => {
                let (weights, units) = whole(layer, f32::from(i16::MAX), |w| w as i16);
                Self::Int16(weights, units)
            }
            // As near the exact latent as bf16's field is, at half of bf16's bytes.
            Precision::Bf16 | Precision::Int8 => {
                let (weights, units) = whole(layer, f32::from(i8::MAX), |w| w as i8);
                Self::Int8(weights, units)
            }
        }
    }

    /// W x + b of the rows from `first` on, as many as `output` has.
    pub(super) fn apply(&self, layer: &Linear, input: &[f32], first: usize, output: &mut [f32]) {
        let ones = |_: usize| 1.0;
        match self {
            Self::F32 => rows((&layer.weight, ones), layer, input, (first, output)),
            Self::Int16(weights, units) => rows((weights, |r| units[r]), layer, input, (first, output)),
            Self::Int8(weights, units) => rows((weights, |r| units[r]), layer, input, (first, output)),
        }
    }
}

/// Whole numbers up to `range`, and the units of the rows.
fn whole<T>(layer: &Linear, range: f32, to: impl Fn(f32) -> T + Copy) -> (Vec<T>, Vec<f32>) {
    let rows = || layer.weight.chunks_exact(layer.inputs.max(1));
    let unit = |row: &[f32]| {
        let largest = row.iter().fold(0f32, |m, w| w.abs().max(m));
        if largest > 0.0 { largest / range } else { 1.0 }
    };
    let units: Vec<f32> = rows().map(unit).collect();
    let weights = rows()
        .zip(&units)
        .flat_map(|(row, &unit)| row.iter().map(move |w| to((w / unit).round_ties_even())));
    (weights.collect(), units)
}

/// Rows that memory is asked for at a time.
const TOGETHER: usize = 4;

fn rows<T: Weight>(
    (weights, unit): (&[T], impl Fn(usize) -> f32),
    layer: &Linear,
    input: &[f32],
    (first, output): (usize, &mut [f32]),
) {
    let instructions = Instructions::best(Precision::F32);
    let row = |r: usize| &weights[r * layer.inputs..][..layer.inputs];
    let (blocks, rest) = output.as_chunks_mut::<TOGETHER>();
    let after = first + blocks.len() * TOGETHER;
    for (block, r) in blocks.iter_mut().zip((first..).step_by(TOGETHER)) {
        let sums = dots(
            instructions,
            std::array::from_fn::<_, TOGETHER, _>(|k| row(r + k)),
            input,
        );
        *block = std::array::from_fn(|k| layer.bias[r + k] + unit(r + k) * sums[k]);
    }
    for (out, r) in rest.iter_mut().zip(after..) {
        *out = layer.bias[r] + unit(r) * dot(instructions, row(r), input);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(count: usize, phase: f32) -> Vec<f32> {
        (0..count).map(|i| (i as f32 * 0.37 + phase).sin()).collect()
    }

    #[test]
    fn every_instruction_set_gives_the_same_dot_product() {
        for count in [0, 1, 7, 64, 65, 590] {
            let (a, b) = (wave(count, 0.1), wave(count, 2.0));
            let exact: f64 = a.iter().zip(&b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
            for set in Instructions::available(Precision::F32) {
                assert!(
                    (f64::from(dot(set, &a, &b)) - exact).abs() < 1e-4,
                    "{set:?} {count}"
                );
            }
        }
    }

    #[test]
    fn stored_weights_are_widened_alike_by_every_instruction_set() {
        let x = wave(200, 0.5);
        let words = wave(200, 1.0).map_to(|w| (w * 30_000.0) as i16);
        let bytes = wave(200, 1.0).map_to(|w| (w * 127.0) as i8);
        for set in Instructions::available(Precision::F32) {
            let against = |found: f32, exact: f64| {
                assert!(
                    (f64::from(found) - exact).abs() < 1e-5 * exact.abs().max(1.0) + 1e-2,
                    "{set:?}"
                );
            };
            against(dot(set, &words, &x), exact(&words, &x));
            against(dot(set, &bytes, &x), exact(&bytes, &x));
        }
    }

    trait MapTo {
        fn map_to<T>(self, f: impl Fn(f32) -> T) -> Vec<T>;
    }

    impl MapTo for Vec<f32> {
        fn map_to<T>(self, f: impl Fn(f32) -> T) -> Vec<T> {
            self.into_iter().map(f).collect()
        }
    }

    fn exact<T: Weight>(weights: &[T], x: &[f32]) -> f64 {
        weights
            .iter()
            .zip(x)
            .map(|(w, x)| f64::from(w.number()) * f64::from(*x))
            .sum()
    }

    #[test]
    fn every_precision_is_as_exact_as_its_bits() {
        let (inputs, outputs) = (301, 11);
        let layer = Linear {
            inputs,
            outputs,
            weight: wave(inputs * outputs, 0.3),
            bias: wave(outputs, 0.9),
        };
        let x = wave(inputs, 0.2);
        for (precision, tolerance) in [
            (Precision::F32, 1e-5),
            (Precision::Bf16, 2e-2),
            (Precision::Int16, 1e-4),
            (Precision::Int8, 2e-2),
        ] {
            let rows = Rows::new(&layer, precision);
            let mut found = vec![0.0; outputs];
            rows.apply(&layer, &x, 0, &mut found[..5]);
            rows.apply(&layer, &x, 5, &mut found[5..]);
            for (r, found) in found.iter().enumerate() {
                let row = &layer.weight[r * inputs..][..inputs];
                let (sum, size) =
                    row.iter()
                        .zip(&x)
                        .fold((f64::from(layer.bias[r]), 0.0), |(s, a), (w, x)| {
                            let product = f64::from(*w) * f64::from(*x);
                            (s + product, a + product * product)
                        });
                let error = (f64::from(*found) - sum).abs() / size.sqrt();
                assert!(error < tolerance, "{precision:?}: {error}");
            }
        }
    }
}
