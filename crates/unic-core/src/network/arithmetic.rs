//! What the words of each precision hold, and what their sums are worth.

use super::float::Float;
use bytemuck::Pod;

/// How weights and activations become words, and sums of products numbers again.
pub(super) trait Arithmetic {
    /// Channels of one vertex in a word.
    const CHANNELS: usize;
    /// Sum of products.
    type Sum: Pod;
    /// When activations are scaled by vertex: the largest that a word holds.
    const RANGE: Option<f32>;

    /// What a unit of a row's weights is worth, such that no sum over them overflows.
    fn unit(row: &[f32]) -> f32;
    /// Weights of one row for one word, divided by the row's unit.
    fn weights(scaled: &[f32]) -> u32;
    /// Words of activations, which are not negative; `factor` scales those of each vertex to the range. Words
    /// without a range are made register by register ([`Float::store_bf16`]), or are the activations themselves.
    fn pack<const W: usize>(_values: &[[f32; W]], _factor: &[f32; W], _words: &mut [[u32; W]]) {
        unreachable!("words without a range are not scaled")
    }
    /// Sums as numbers, in units of weights and activations.
    ///
    /// # Safety
    /// As [`Float::load`].
    unsafe fn load<F: Float>(sums: *const Self::Sum) -> F;
}

/// One number a word.
pub(super) struct F32;
/// Two numbers a word.
pub(super) struct Bf16;
/// Two numbers a word; activations up to 2^13 − 1, so that weights have bits left.
pub(super) struct Int16;
/// Four numbers a word; activations without a sign.
pub(super) struct Int8;

impl Arithmetic for F32 {
    const CHANNELS: usize = 1;
    type Sum = f32;
    const RANGE: Option<f32> = None;
    fn unit(_: &[f32]) -> f32 {
        1.0
    }
    fn weights(scaled: &[f32]) -> u32 {
        scaled[0].to_bits()
    }
    #[inline(always)]
    unsafe fn load<F: Float>(sums: *const f32) -> F {
        // SAFETY: passed on.
        unsafe { F::load(sums) }
    }
}

impl Arithmetic for Bf16 {
    const CHANNELS: usize = 2;
    type Sum = f32;
    const RANGE: Option<f32> = None;
    fn unit(_: &[f32]) -> f32 {
        1.0
    }
    fn weights(scaled: &[f32]) -> u32 {
        u32::from(to_bf16(scaled[0])) | u32::from(to_bf16(scaled[1])) << 16
    }
    #[inline(always)]
    unsafe fn load<F: Float>(sums: *const f32) -> F {
        // SAFETY: passed on.
        unsafe { F::load(sums) }
    }
}

impl Arithmetic for Int16 {
    const CHANNELS: usize = 2;
    type Sum = i32;
    const RANGE: Option<f32> = Some(8191.0);
    /// Σ |w| · 2^13 stays below 2^31, each weight's rounding included.
    fn unit(row: &[f32]) -> f32 {
        let total: f32 = row.iter().map(|w| w.abs()).sum();
        let room = (1 << 18) as f32 - row.len() as f32;
        positive((total / room.max(1.0)).max(largest(row) / 32_767.0))
    }
    fn weights(scaled: &[f32]) -> u32 {
        let whole = |w: f32| u32::from(w.round_ties_even() as i16 as u16);
        whole(scaled[0]) | whole(scaled[1]) << 16
    }
    #[inline(always)]
    fn pack<const W: usize>(values: &[[f32; W]], factor: &[f32; W], words: &mut [[u32; W]]) {
        for (words, [a, b]) in words.iter_mut().zip(values.as_chunks().0) {
            for v in 0..W {
                let whole = |x: &[f32; W]| whole_bits(x[v] * factor[v]);
                words[v] = whole(a) & 0xFFFF | whole(b) << 16;
            }
        }
    }
    #[inline(always)]
    unsafe fn load<F: Float>(sums: *const i32) -> F {
        // SAFETY: passed on.
        unsafe { F::load_whole(sums) }
    }
}

impl Arithmetic for Int8 {
    const CHANNELS: usize = 4;
    type Sum = i32;
    const RANGE: Option<f32> = Some(255.0);
    fn unit(row: &[f32]) -> f32 {
        positive(largest(row) / 127.0)
    }
    fn weights(scaled: &[f32]) -> u32 {
        let whole = |w: &f32| w.round_ties_even() as i8 as u8;
        u32::from_le_bytes(std::array::from_fn(|i| whole(&scaled[i])))
    }
    #[inline(always)]
    fn pack<const W: usize>(values: &[[f32; W]], factor: &[f32; W], words: &mut [[u32; W]]) {
        for (words, [a, b, c, d]) in words.iter_mut().zip(values.as_chunks().0) {
            for v in 0..W {
                let byte = |x: &[f32; W]| whole_bits(x[v] * factor[v]) & 0xFF;
                words[v] = byte(a) | byte(b) << 8 | byte(c) << 16 | byte(d) << 24;
            }
        }
    }
    #[inline(always)]
    unsafe fn load<F: Float>(sums: *const i32) -> F {
        // SAFETY: passed on.
        unsafe { F::load_whole(sums) }
    }
}

/// The nearest bf16.
fn to_bf16(x: f32) -> u16 {
    let bits = x.to_bits();
    (bits.wrapping_add(0x7FFF + (bits >> 16 & 1)) >> 16) as u16
}

/// The lowest bits of the sum with 2^23 hold the nearest whole number of 0 ≤ x < 2^23: two
/// instructions on every machine, and the same on all.
#[inline(always)]
fn whole_bits(x: f32) -> u32 {
    (x + 8_388_608.0).to_bits()
}

fn largest(row: &[f32]) -> f32 {
    row.iter().fold(0.0, |m, w| w.abs().max(m))
}

/// Rows of zeros have any unit.
fn positive(unit: f32) -> f32 {
    if unit > 0.0 { unit } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first word of one vertex, scaled by two.
    fn packed<A: Arithmetic>(values: &[[f32; 1]]) -> u32 {
        let mut words = [[0]];
        A::pack(values, &[2.0], &mut words);
        words[0][0]
    }

    #[test]
    fn whole_numbers_round_to_even_and_pack_in_order() {
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
    fn no_row_of_whole_numbers_can_overflow() {
        for row in [vec![1.0; 387], vec![-0.3; 4096], vec![5.0, 0.001], vec![0.0; 8]] {
            let unit = Int16::unit(&row);
            let total: f64 = row
                .iter()
                .map(|w| f64::from((w / unit).abs().round_ties_even()))
                .sum();
            assert!(total * 8191.0 < f64::from(i32::MAX), "{total}");
            assert!(row.iter().all(|w| (w / unit).abs() <= 32_767.0));
        }
    }
}
