//! What the words of each precision hold, and what their sums are worth.

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
    /// Activations of one vertex for one word; they are not negative, and scaled to the range.
    fn activations(scaled: impl Fn(usize) -> f32) -> u32;
    /// The sum as a number, in units of weights and activations.
    fn number(sum: Self::Sum) -> f32;
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
    fn activations(scaled: impl Fn(usize) -> f32) -> u32 {
        scaled(0).to_bits()
    }
    #[inline(always)]
    fn number(sum: f32) -> f32 {
        sum
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
    /// Halves round up: a tie in 2^16 does not pay for rounding to even.
    #[inline(always)]
    fn activations(scaled: impl Fn(usize) -> f32) -> u32 {
        let rounded = |i| f32::to_bits(scaled(i)).wrapping_add(0x8000);
        rounded(0) >> 16 | rounded(1) & 0xFFFF_0000
    }
    #[inline(always)]
    fn number(sum: f32) -> f32 {
        sum
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
    fn activations(scaled: impl Fn(usize) -> f32) -> u32 {
        whole_bits(scaled(0)) & 0xFFFF | whole_bits(scaled(1)) << 16
    }
    #[inline(always)]
    fn number(sum: i32) -> f32 {
        sum as f32
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
    fn activations(scaled: impl Fn(usize) -> f32) -> u32 {
        let byte = |i| whole_bits(scaled(i)) & 0xFF;
        byte(0) | byte(1) << 8 | byte(2) << 16 | byte(3) << 24
    }
    #[inline(always)]
    fn number(sum: i32) -> f32 {
        sum as f32
    }
}

/// The nearest bf16.
pub(super) fn to_bf16(x: f32) -> u16 {
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

    #[test]
    fn whole_numbers_round_to_even_and_pack_in_order() {
        let values = [0.5, 1.5, 254.6, 3.0];
        assert_eq!(
            Int8::activations(|i| values[i]).to_le_bytes(),
            [0, 2, 255, 3]
        );
        assert_eq!(Int8::weights(&[-127.0, 0.4, -0.6, 5.0]).to_le_bytes(), [129, 0, 255, 5]);
        assert_eq!(Int16::activations(|i| [8191.0, 2.5][i]), 8191 | 2 << 16);
        assert_eq!(Int16::weights(&[-2.0, 7.0]), 0xFFFE | 7 << 16);
        assert_eq!(Bf16::activations(|i| [1.0, 2.0][i]), 0x3F80 | 0x4000 << 16);
        assert_eq!(to_bf16(-1.0), 0xBF80);
    }

    #[test]
    fn no_row_of_whole_numbers_can_overflow() {
        for row in [vec![1.0; 387], vec![-0.3; 4096], vec![5.0, 0.001], vec![0.0; 8]] {
            let unit = Int16::unit(&row);
            let total: f64 = row.iter().map(|w| f64::from((w / unit).abs().round_ties_even())).sum();
            assert!(total * 8191.0 < f64::from(i32::MAX), "{total}");
            assert!(row.iter().all(|w| (w / unit).abs() <= 32_767.0));
        }
    }
}
