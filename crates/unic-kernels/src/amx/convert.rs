//! Factors of matrix units: f32 in panels to bf16 in the order that tile registers have.

use std::arch::x86_64::*;

use super::{LANES, PAIR, REGISTER};
use crate::panels::PANEL;
use crate::product::{Affine, Tile};

/// Left factor of [`super::affine`]: for each 32 rows, for each panel, 32 rows of 32 bf16. Columns out of use are zero, so
/// are rows beyond the last.
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
pub(super) unsafe fn convert_rows(tile: &Tile, first: usize, rows: usize, words: &mut [f32]) {
    let panels = tile.widths.len();
    for (panel, &width) in tile.widths.iter().enumerate() {
        let used = used_columns(width);
        for row in 0..rows.next_multiple_of(PANEL) {
            let place = (row / PANEL * panels + panel) * PAIR + row % PANEL * LANES;
            // SAFETY: `place` lies in `words` by its length; the row lies in the tile by `check_tile`.
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

fn used_columns(width: usize) -> u32 {
    ((1u64 << width) - 1) as u32
}

/// Right factor of [`super::affine`]: for each output panel, for each input panel, 32 rows of weights as [`pairs_of_rows`].
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
pub(super) unsafe fn convert_weights(job: &Affine, words: &mut [f32]) {
    let depth: usize = job.input.widths.iter().sum();
    let mut place = words.as_mut_ptr();
    for panel in 0..job.output_widths.len() {
        let mut row = panel * depth;
        for &width in job.input.widths {
            // SAFETY: `affine` has checked the weights' length, the caller that of `words`.
            unsafe {
                pairs_of_rows(job.weights.as_ptr().add(row * PANEL), width, place);
                place = place.add(PAIR);
            }
            row += width;
        }
    }
}

/// Right factor of [`super::outer`]: for each panel, for each 32 rows, these as [`pairs_of_rows`].
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

/// Left factor of [`super::outer`]: for each panel, for each 32 rows, the panel's 32 columns as rows of 32 bf16.
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
pub(super) unsafe fn convert_columns(tile: &Tile, rows: usize, words: &mut [f32]) {
    // SAFETY: as in `convert_weights`; a register is turned where it lies.
    unsafe {
        convert_pairs(tile, rows, words);
        for register in words.chunks_exact_mut(REGISTER) {
            transpose(register.as_mut_ptr());
        }
    }
}

/// `count` rows of 32 floats, at most 32, as two registers of 16 pairs of rows: a word holds a column's numbers of
/// two consecutive rows. Rows beyond the last are zero.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
unsafe fn pairs_of_rows(rows: *const f32, count: usize, words: *mut f32) {
    for pair in 0..LANES {
        for half in 0..2 {
            // SAFETY: the caller's contract; rows beyond `count` are not read.
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

/// Sixteen rows of sixteen words, transposed in place.
#[inline]
#[target_feature(enable = "avx512f")]
unsafe fn transpose(words: *mut f32) {
    // SAFETY: the caller's contract: a register at `words`.
    let r: [__m512i; LANES] =
        std::array::from_fn(|i| unsafe { _mm512_loadu_si512(words.add(i * LANES).cast()) });
    // Columns 4 L + j of rows 4 b to 4 b + 3 in part L of [b][j].
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
