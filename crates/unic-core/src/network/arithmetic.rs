//! Number formats of the field's products: how numbers are packed in 32-bit words.

use crate::simd::Float;
use bytemuck::Pod;

/// Format of weights and activations in words, and of the sums of their products.
pub(super) trait Arithmetic {
    /// Channels of one vertex in a word.
    const CHANNELS: usize;
    /// Sum of products.
    type Sum: Pod;
    /// Largest activation that a word holds, for integer formats, which scale activations by
    /// vertex.
    const RANGE: Option<f32>;

    /// Scale of a row of weights: the value of one unit, such that no sum over the row overflows.
    fn row_scale(row: &[f32]) -> f32;
    /// Packs the weights of one row for one word; they are divided by the row's scale already.
    fn weights(scaled: &[f32]) -> u32;
    /// Packs activations, which are not negative; `factor` scales those of each vertex to the
    /// range.
    ///
    /// Formats without a range are packed register by register ([`Float::store_bf16`]), or are the
    /// activations themselves.
    fn pack<const W: usize>(_values: &[[f32; W]], _factor: &[f32; W], _words: &mut [[u32; W]]) {
        unreachable!("words without a range are not scaled")
    }
    /// Loads sums as f32, in units of the scales of weights and activations.
    ///
    /// # Safety
    /// The contract of [`Float::load`].
    unsafe fn load<F: Float>(sums: *const Self::Sum) -> F;
}

/// Arithmetic with one f32 a word.
pub(super) struct F32;
/// Arithmetic with two bf16 a word and sums in f32.
pub(super) struct Bf16;
/// Arithmetic with two 16-bit integers a word. Activations reach at most 2^13 − 1, so that weights
/// have bits left.
pub(super) struct Int16;
/// Four bytes a word; weights with a sign, activations without.
pub(super) struct Int8;

impl Arithmetic for F32 {
    const CHANNELS: usize = 1;
    type Sum = f32;
    const RANGE: Option<f32> = None;
    fn row_scale(_: &[f32]) -> f32 {
        1.0
    }
    fn weights(scaled: &[f32]) -> u32 {
        scaled[0].to_bits()
    }
    #[inline(always)]
    unsafe fn load<F: Float>(sums: *const f32) -> F {
        // SAFETY: the same contract.
        unsafe { F::load(sums) }
    }
}

impl Arithmetic for Bf16 {
    const CHANNELS: usize = 2;
    type Sum = f32;
    const RANGE: Option<f32> = None;
    fn row_scale(_: &[f32]) -> f32 {
        1.0
    }
    fn weights(scaled: &[f32]) -> u32 {
        u32::from(to_bf16(scaled[0])) | u32::from(to_bf16(scaled[1])) << 16
    }
    #[inline(always)]
    unsafe fn load<F: Float>(sums: *const f32) -> F {
        // SAFETY: the same contract.
        unsafe { F::load(sums) }
    }
}

impl Arithmetic for Int16 {
    const CHANNELS: usize = 2;
    type Sum = i32;
    const RANGE: Option<f32> = Some(8191.0);
    fn row_scale(row: &[f32]) -> f32 {
        // Activations stay below 2^13. The integers of a row therefore sum to at most 2^18, the
        // rounding of each included, so that no sum of products reaches 2^31.
        let total: f32 = row.iter().map(|w| w.abs()).sum();
        let room = (1 << 18) as f32 - row.len() as f32;
        nonzero_scale((total / room.max(1.0)).max(largest(row) / 32_767.0))
    }
    fn weights(scaled: &[f32]) -> u32 {
        let integer = |w: f32| u32::from(w.round_ties_even() as i16 as u16);
        integer(scaled[0]) | integer(scaled[1]) << 16
    }
    #[inline(always)]
    fn pack<const W: usize>(values: &[[f32; W]], factor: &[f32; W], words: &mut [[u32; W]]) {
        for (words, [a, b]) in words.iter_mut().zip(values.as_chunks().0) {
            for v in 0..W {
                let integer = |x: &[f32; W]| rounded_bits(x[v] * factor[v]);
                words[v] = integer(a) & 0xFFFF | integer(b) << 16;
            }
        }
    }
    #[inline(always)]
    unsafe fn load<F: Float>(sums: *const i32) -> F {
        // SAFETY: the same contract.
        unsafe { F::load_integers(sums) }
    }
}

impl Arithmetic for Int8 {
    const CHANNELS: usize = 4;
    type Sum = i32;
    const RANGE: Option<f32> = Some(255.0);
    // Sums of 2^16 products of 255 · 127, the widest layer that is read, stay below 2^31.
    fn row_scale(row: &[f32]) -> f32 {
        nonzero_scale(largest(row) / 127.0)
    }
    fn weights(scaled: &[f32]) -> u32 {
        let integer = |w: &f32| w.round_ties_even() as i8 as u8;
        u32::from_le_bytes(std::array::from_fn(|i| integer(&scaled[i])))
    }
    #[inline(always)]
    fn pack<const W: usize>(values: &[[f32; W]], factor: &[f32; W], words: &mut [[u32; W]]) {
        for (words, [a, b, c, d]) in words.iter_mut().zip(values.as_chunks().0) {
            for v in 0..W {
                let byte = |x: &[f32; W]| rounded_bits(x[v] * factor[v]) & 0xFF;
                words[v] = byte(a) | byte(b) << 8 | byte(c) << 16 | byte(d) << 24;
            }
        }
    }
    #[inline(always)]
    unsafe fn load<F: Float>(sums: *const i32) -> F {
        // SAFETY: the same contract.
        unsafe { F::load_integers(sums) }
    }
}

/// Returns the bits of the nearest bf16, ties to even.
fn to_bf16(x: f32) -> u16 {
    let bits = x.to_bits();
    (bits.wrapping_add(0x7FFF + (bits >> 16 & 1)) >> 16) as u16
}

/// Returns a word whose lowest bits are `x` rounded to the nearest integer, for 0 ≤ x < 2^23.
#[inline(always)]
fn rounded_bits(x: f32) -> u32 {
    // At 2^23 the spacing of f32 is 1, so that the sum itself rounds to even. This is two
    // instructions on every machine, with the same result; conversions differ between them.
    (x + 8_388_608.0).to_bits()
}

fn largest(row: &[f32]) -> f32 {
    row.iter().fold(0.0, |m, w| w.abs().max(m))
}

/// Replaces the scale of a row of zeros, by which it would be divided, with 1.
fn nonzero_scale(scale: f32) -> f32 {
    if scale > 0.0 { scale } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Packs one vertex, scaled by two, and returns its first word.
    fn packed<A: Arithmetic>(values: &[[f32; 1]]) -> u32 {
        let mut words = [[0]];
        A::pack(values, &[2.0], &mut words);
        words[0][0]
    }

    #[test]
    fn integers_round_to_even_and_pack_in_order() {
        let values = [[0.25], [0.75], [127.3], [1.5]];
        assert_eq!(packed::<Int8>(&values).to_le_bytes(), [0, 2, 255, 3]);
        assert_eq!(
            Int8::weights(&[-127.0, 0.4, -0.6, 5.0]).to_le_bytes(),
            [129, 0, 255, 5]
        );
        assert_eq!(packed::<Int16>(&[[4095.5], [1.25]]), 8191 | 2 << 16);
        assert_eq!(Int16::weights(&[-2.0, 7.0]), 0xFFFE | 7 << 16);
        assert_eq!(to_bf16(-1.0), 0xBF80);
    }

    #[test]
    fn no_row_of_integers_can_overflow() {
        for row in [vec![1.0; 387], vec![-0.3; 4096], vec![5.0, 0.001], vec![0.0; 8]] {
            let scale = Int16::row_scale(&row);
            let total: f64 = row
                .iter()
                .map(|w| f64::from((w / scale).abs().round_ties_even()))
                .sum();
            assert!(total * 8191.0 < f64::from(i32::MAX), "{total}");
            assert!(row.iter().all(|w| (w / scale).abs() <= 32_767.0));
        }
    }
}
