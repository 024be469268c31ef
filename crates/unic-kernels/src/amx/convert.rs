//! Conversion of the factors for matrix units: from f32 in panels to bf16 in the layout of tile
//! registers.

use std::arch::x86_64::*;

use super::{LANES, PAIR, REGISTER};
use crate::panels::PANEL;
use crate::product::{AffineProduct, Tile};

/// Converts the left factor of [`super::affine`]: for each 32 rows, for each panel, 32 rows of 32
/// bf16 values. Unused columns and rows beyond the last are zero.
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
pub(super) unsafe fn convert_rows(tile: &Tile, first: usize, rows: usize, words: &mut [f32]) {
    let panels = tile.widths.len();
    for (panel, &width) in tile.widths.iter().enumerate() {
        // Unused columns of a panel hold arbitrary values, which must not reach the sums.
        let used = used_columns(width);
        for row in 0..rows.next_multiple_of(PANEL) {
            let place = (row / PANEL * panels + panel) * PAIR + row % PANEL * LANES;
            // SAFETY: `place` lies in `words`, whose length the caller guarantees; `check_tile` has
            // checked that the row lies in the tile.
            unsafe {
                let bf16 = match row < rows {
                    true => {
                        let from = tile
                            .data
                            .as_ptr()
                            .add(panel * tile.stride + (first + row) * PANEL);
                        let low = _mm512_maskz_loadu_ps(used as u16, from);
                        let high = _mm512_maskz_loadu_ps((used >> LANES) as u16, from.add(LANES));
                        std::mem::transmute::<__m512bh, __m512i>(_mm512_cvtne2ps_pbh(high, low))
                    }
                    false => _mm512_setzero_si512(),
                };
                _mm512_storeu_si512(words.as_mut_ptr().add(place).cast(), bf16);
            }
        }
    }
}

/// Returns a mask of the first `width` of 32 columns.
fn used_columns(width: usize) -> u32 {
    // In u64, because shifting a u32 by 32 overflows.
    ((1u64 << width) - 1) as u32
}

/// Converts the right factor of [`super::affine`]: for each output panel, for each input panel, 32
/// rows of weights in the layout of [`pairs_of_rows`].
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
pub(super) unsafe fn convert_weights(job: &AffineProduct, words: &mut [f32]) {
    let depth: usize = job.input.widths.iter().sum();
    let mut place = words.as_mut_ptr();
    for panel in 0..job.output_widths.len() {
        let mut row = panel * depth;
        for &width in job.input.widths {
            // SAFETY: `affine` has checked the length of the weights, and the caller that of
            // `words`.
            unsafe {
                pairs_of_rows(job.weights.as_ptr().add(row * PANEL), width, place);
                place = place.add(PAIR);
            }
            row += width;
        }
    }
}

/// Converts the right factor of [`super::outer`]: for each panel, for each 32 rows, these rows in
/// the layout of [`pairs_of_rows`].
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
pub(super) unsafe fn convert_pairs(tile: &Tile, rows: usize, words: &mut [f32]) {
    let mut place = words.as_mut_ptr();
    for panel in 0..tile.widths.len() {
        for first in (0..rows).step_by(PANEL) {
            // SAFETY: as in `convert_weights`.
            unsafe {
                let from = tile.data.as_ptr().add(panel * tile.stride + first * PANEL);
                pairs_of_rows(from, PANEL.min(rows - first), place);
                place = place.add(PAIR);
            }
        }
    }
}

/// Converts the left factor of [`super::outer`]: for each panel, for each 32 rows, the panel's 32
/// columns as rows of 32 bf16 values.
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
pub(super) unsafe fn convert_columns(tile: &Tile, rows: usize, words: &mut [f32]) {
    // SAFETY: as in `convert_weights`; a register is transposed in place.
    unsafe {
        convert_pairs(tile, rows, words);
        // A word holds the values of two rows in one column, which is also what two adjacent values
        // of a transposed row are: transposing words completes the conversion.
        for register in words.chunks_exact_mut(REGISTER) {
            transpose(register.as_mut_ptr());
        }
    }
}

/// Converts `count` rows of 32 floats, at most 32 rows, to two registers of 16 pairs of rows each.
/// A word holds the values of two consecutive rows in one column. Rows beyond `count` are zero.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
unsafe fn pairs_of_rows(rows: *const f32, count: usize, words: *mut f32) {
    for pair in 0..LANES {
        for half in 0..2 {
            // SAFETY: the caller guarantees `count` rows and room for two registers; rows beyond
            // `count` are not read.
            unsafe {
                let of_row = |row: usize| match row < count {
                    true => {
                        let numbers = _mm512_loadu_ps(rows.add(row * PANEL + half * LANES));
                        let bf16 = std::mem::transmute::<__m256bh, __m256i>(_mm512_cvtneps_pbh(numbers));
                        _mm512_cvtepu16_epi32(bf16)
                    }
                    false => _mm512_setzero_si512(),
                };
                let (even, odd) = (of_row(2 * pair), of_row(2 * pair + 1));
                let word = _mm512_or_si512(even, _mm512_slli_epi32::<16>(odd));
                _mm512_storeu_si512(words.add(half * REGISTER + pair * LANES).cast(), word);
            }
        }
    }
}

/// Transposes sixteen rows of sixteen words in place.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn transpose(words: *mut f32) {
    // SAFETY: the caller guarantees a register at `words`.
    let r: [__m512i; LANES] =
        std::array::from_fn(|i| unsafe { _mm512_loadu_si512(words.add(i * LANES).cast()) });
    // First within blocks of 4 × 4 words: the 128-bit part L of quads[b][j] holds column 4 L + j of
    // rows 4 b to 4 b + 3. Then the parts are exchanged between registers.
    let quads: [[__m512i; 4]; 4] = std::array::from_fn(|b| {
        let [r0, r1, r2, r3] = [r[4 * b], r[4 * b + 1], r[4 * b + 2], r[4 * b + 3]];
        let (low, high) = (_mm512_unpacklo_epi32(r0, r1), _mm512_unpackhi_epi32(r0, r1));
        let (low2, high2) = (_mm512_unpacklo_epi32(r2, r3), _mm512_unpackhi_epi32(r2, r3));
        [
            _mm512_unpacklo_epi64(low, low2),
            _mm512_unpackhi_epi64(low, low2),
            _mm512_unpacklo_epi64(high, high2),
            _mm512_unpackhi_epi64(high, high2),
        ]
    });
    const EVEN: i32 = 0x88;
    const ODD: i32 = 0xdd;
    let [first, second, third, fourth] = quads;
    for (j, (((a, b), c), d)) in first.into_iter().zip(second).zip(third).zip(fourth).enumerate() {
        let (even, even2) = (
            _mm512_shuffle_i32x4::<EVEN>(a, b),
            _mm512_shuffle_i32x4::<EVEN>(c, d),
        );
        let (odd, odd2) = (
            _mm512_shuffle_i32x4::<ODD>(a, b),
            _mm512_shuffle_i32x4::<ODD>(c, d),
        );
        let columns = [
            _mm512_shuffle_i32x4::<EVEN>(even, even2),
            _mm512_shuffle_i32x4::<EVEN>(odd, odd2),
            _mm512_shuffle_i32x4::<ODD>(even, even2),
            _mm512_shuffle_i32x4::<ODD>(odd, odd2),
        ];
        for (part, column) in columns.into_iter().enumerate() {
            // SAFETY: as above.
            unsafe { _mm512_storeu_si512(words.add((4 * part + j) * LANES).cast(), column) }
        }
    }
}
