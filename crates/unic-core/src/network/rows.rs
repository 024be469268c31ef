//! Weights of the encoder, stored in 32, 16 or 8 bits.
//!
//! A matrix times one vector reads every weight once, so that memory bandwidth decides its time.
//! Shorter weights make it two or four times as fast.

use super::{
    Linear, Precision,
    dot::{dot, dots},
};
use crate::simd::Instructions;
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

/// Weights of one linear map in the format of a precision.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum StoredRows {
    /// The weights of the [`Linear`] map itself.
    F32,
    /// 16-bit integers.
    Int16(QuantisedRows<i16>),
    /// 8-bit integers.
    Int8(QuantisedRows<i8>),
}

/// Rows of integers with a scale each.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct QuantisedRows<T> {
    /// Integers, row-major.
    weights: Vec<T>,
    /// Factors that turn the integers of each row into weights.
    scales: Vec<f32>,
}

/// Number format of a stored weight.
///
/// # Safety
/// Pointers of `load_16` and `load_8` are valid for 16 and 8 weights, and the machine has AVX-512
/// and AVX2 respectively.
pub(super) trait Weight: Copy {
    /// Converts the weight to f32.
    fn number(self) -> f32;
    /// Loads 16 weights and converts them to f32.
    #[cfg(target_arch = "x86_64")]
    unsafe fn load_16(from: *const Self) -> __m512;
    /// Loads 8 weights and converts them to f32.
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

impl StoredRows {
    /// Stores the weights of `layer` in the format that the encoder has in `precision`.
    pub(super) fn new(layer: &Linear, precision: Precision) -> Self {
        match precision {
            Precision::F32 => Self::F32,
            Precision::Int16 => Self::Int16(QuantisedRows::new(layer, f32::from(i16::MAX), |w| w as i16)),
            // 8 bits scaled by row place the latent vector as exactly as a bf16 field needs it, at
            // half of bf16's bytes.
            Precision::Bf16 | Precision::Int8 => {
                Self::Int8(QuantisedRows::new(layer, f32::from(i8::MAX), |w| w as i8))
            }
        }
    }

    /// Computes W x + b for the rows from `first_row` on, as many as `output` has.
    pub(super) fn apply(&self, layer: &Linear, input: &[f32], first_row: usize, output: &mut [f32]) {
        match self {
            Self::F32 => apply_rows(&layer.weight, |_| 1.0, layer, input, first_row, output),
            Self::Int16(rows) => rows.apply(layer, input, first_row, output),
            Self::Int8(rows) => rows.apply(layer, input, first_row, output),
        }
    }
}

impl<T: Weight> QuantisedRows<T> {
    /// Scales the largest weight of each row to `range` and rounds by `to_integer`.
    fn new(layer: &Linear, range: f32, to_integer: impl Fn(f32) -> T + Copy) -> Self {
        let rows = || layer.weight.chunks_exact(layer.inputs.max(1));
        let scale = |row: &[f32]| {
            let largest = row.iter().fold(0f32, |m, w| w.abs().max(m));
            // A row of zeros has any scale but zero, by which it is divided.
            if largest > 0.0 { largest / range } else { 1.0 }
        };
        let scales: Vec<f32> = rows().map(scale).collect();
        let weights = rows()
            .zip(&scales)
            .flat_map(|(row, &scale)| row.iter().map(move |w| to_integer((w / scale).round_ties_even())));
        Self {
            weights: weights.collect(),
            scales,
        }
    }

    fn apply(&self, layer: &Linear, input: &[f32], first_row: usize, output: &mut [f32]) {
        let scale = |row: usize| self.scales[row];
        apply_rows(&self.weights, scale, layer, input, first_row, output);
    }
}

/// Rows whose products are computed side by side: enough for memory to deliver them at full rate.
const ROWS_AT_A_TIME: usize = 4;

/// Computes the rows from `first_row` on of y = scale · (`weights` x) + b.
fn apply_rows<T: Weight>(
    weights: &[T],
    scale: impl Fn(usize) -> f32,
    layer: &Linear,
    input: &[f32],
    first_row: usize,
    output: &mut [f32],
) {
    let instructions = Instructions::best();
    let row = |r: usize| &weights[r * layer.inputs..][..layer.inputs];
    let (blocks, rest) = output.as_chunks_mut::<ROWS_AT_A_TIME>();
    let first_of_rest = first_row + blocks.len() * ROWS_AT_A_TIME;
    for (block, r) in blocks.iter_mut().zip((first_row..).step_by(ROWS_AT_A_TIME)) {
        let sums = dots(
            instructions,
            std::array::from_fn::<_, ROWS_AT_A_TIME, _>(|k| row(r + k)),
            input,
        );
        *block = std::array::from_fn(|k| layer.bias[r + k] + scale(r + k) * sums[k]);
    }
    for (out, r) in rest.iter_mut().zip(first_of_rest..) {
        *out = layer.bias[r] + scale(r) * dot(instructions, row(r), input);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of a sine.
    fn wave(count: usize, phase: f32) -> Vec<f32> {
        (0..count).map(|i| (i as f32 * 0.37 + phase).sin()).collect()
    }

    #[test]
    fn every_instruction_set_gives_the_same_dot_product() {
        for count in [0, 1, 7, 64, 65, 590] {
            let (a, b) = (wave(count, 0.1), wave(count, 2.0));
            let exact: f64 = a.iter().zip(&b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
            for set in Instructions::available() {
                assert!(
                    (f64::from(dot(set, &a, &b)) - exact).abs() < 1e-4,
                    "{set:?} {count}"
                );
            }
        }
    }

    #[test]
    fn every_instruction_set_converts_stored_weights_to_the_same_numbers() {
        let x = wave(200, 0.5);
        let of_16_bits: Vec<i16> = wave(200, 1.0).iter().map(|w| (w * 30_000.0) as i16).collect();
        let of_8_bits: Vec<i8> = wave(200, 1.0).iter().map(|w| (w * 127.0) as i8).collect();
        for set in Instructions::available() {
            let compare = |found: f32, exact: f64| {
                assert!(
                    (f64::from(found) - exact).abs() < 1e-5 * exact.abs().max(1.0) + 1e-2,
                    "{set:?}"
                );
            };
            compare(dot(set, &of_16_bits, &x), exact(&of_16_bits, &x));
            compare(dot(set, &of_8_bits, &x), exact(&of_8_bits, &x));
        }
    }

    /// Dot product in f64.
    fn exact<T: Weight>(weights: &[T], x: &[f32]) -> f64 {
        weights
            .iter()
            .zip(x)
            .map(|(w, x)| f64::from(w.number()) * f64::from(*x))
            .sum()
    }

    #[test]
    fn errors_are_within_the_rounding_of_each_format() {
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
            let rows = StoredRows::new(&layer, precision);
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
