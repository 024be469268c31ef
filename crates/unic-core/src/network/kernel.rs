//! How a block of a layer's outputs is multiplied for a tile of vertices.

use super::{
    arithmetic::{Arithmetic, F32},
    float::Float,
    words::Dot,
};

/// Products of one block of outputs with all inputs of a layer.
///
/// Activations are words by group and vertex: word (g, v) holds the channels of group g of vertex v,
/// and a tile is `W` vertices wide. Weights are words by block; within one, [`Kernel::place`] says where.
///
/// # Safety
/// Callers run on a machine that has the kernel's instructions, between [`Kernel::begin`] and
/// [`Kernel::end`].
pub(super) trait Kernel {
    /// What words hold.
    type Arithmetic: Arithmetic;
    /// Kernel of the last layer, on the same instructions.
    type Head: Kernel<Arithmetic = F32>;
    /// Registers for what happens between layers.
    type Float: Float;
    /// Outputs of a block.
    const ROWS: usize;
    /// Layers are padded to a multiple of this and of a block, so that the next one reads whole words.
    const PADDED: usize;

    /// Does [`Kernel::block`] look at `active`?
    const SKIPS_ZEROS: bool;

    /// Place of a weight in its block of `groups` words a row.
    fn place(row: usize, group: usize, groups: usize) -> usize;

    unsafe fn begin() {}
    unsafe fn end() {}

    /// sums[row][vertex] = Σ over groups of weights · activations. Groups that are not among `active` hold nothing but
    /// zeros.
    ///
    /// # Safety
    /// As the trait; groups of `active` are below the number of words in a row of weights.
    unsafe fn block<const W: usize>(
        weights: &[u32],
        words: &[u32],
        active: &[u32],
        sums: &mut [<Self::Arithmetic as Arithmetic>::Sum],
    );
}

/// Vertices in the lanes of registers: `R` outputs by `N` registers of vertices are summed at a time, so
/// that a load of a weight serves `N` products and one of an activation `R`. Groups without activations are
/// left out.
pub(super) struct Registers<D, H, const R: usize, const N: usize>(D, H);

/// Outputs of a block: a divisor of usual widths, so that nothing is multiplied in vain, and 8 × 2 sums of
/// AVX-512 hide the latency of two multiply-adds a cycle twice over.
const ROWS: usize = 8;

/// Words from a weight that is used to one that is asked for: 2 KiB. Weights come from the second-level
/// cache, whose own prefetching alone leaves a tenth of the arithmetic undone.
const AHEAD: usize = 512;

impl<D, H, const R: usize, const N: usize> Kernel for Registers<D, H, R, N>
where
    D: Dot,
    H: Dot<Arithmetic = F32>,
{
    type Arithmetic = D::Arithmetic;
    type Head = Registers<H, H, R, N>;
    type Float = H::Float;
    const ROWS: usize = ROWS;
    const PADDED: usize = ROWS;
    const SKIPS_ZEROS: bool = true;

    fn place(row: usize, group: usize, _: usize) -> usize {
        group * ROWS + row
    }

    #[inline(always)]
    unsafe fn block<const W: usize>(
        weights: &[u32],
        words: &[u32],
        active: &[u32],
        sums: &mut [<Self::Arithmetic as Arithmetic>::Sum],
    ) {
        const { assert!(W.is_multiple_of(N * D::LANES) && ROWS.is_multiple_of(R)) };
        let groups = weights.len() / ROWS;
        assert!(words.len() >= groups * W && sums.len() >= ROWS * W);
        debug_assert!(active.iter().all(|&group| (group as usize) < groups));
        let sums: *mut u32 = sums.as_mut_ptr().cast();
        for row in (0..ROWS).step_by(R) {
            for lane in (0..W).step_by(N * D::LANES) {
                // SAFETY: rows `row..row + R` and lanes `lane..lane + N · LANES` lie within the block and
                // the tile, of which they are divisors; sums are 32 bits wide.
                unsafe {
                    let weights = weights.as_ptr().add(row);
                    let words = words.as_ptr().add(lane);
                    let block = match active.len() < groups {
                        true => registers::<D, R, N, W>(weights, words, active.iter().map(|&g| g as usize)),
                        false => registers::<D, R, N, W>(weights, words, 0..groups),
                    };
                    for (r, block) in block.into_iter().enumerate() {
                        for (n, sum) in block.into_iter().enumerate() {
                            D::store(sum, sums.add((row + r) * W + lane + n * D::LANES));
                        }
                    }
                }
            }
        }
    }
}

/// # Safety
/// The machine has the instructions of `D`; `weights` are valid for every group's block of [`ROWS`] from the
/// first of `R` rows on, `words` for its row of `W` from the first of `N · LANES` lanes on.
#[inline(always)]
unsafe fn registers<D: Dot, const R: usize, const N: usize, const W: usize>(
    weights: *const u32,
    words: *const u32,
    groups: impl Iterator<Item = usize>,
) -> [[D::Sum; N]; R] {
    // SAFETY: see above.
    unsafe {
        let mut sums = [[D::zero(); N]; R];
        for group in groups {
            let words = words.add(group * W);
            D::prefetch(weights.wrapping_add(group * ROWS + AHEAD));
            let x: [D::Words; N] = std::array::from_fn(|n| D::load(words.add(n * D::LANES)));
            for (r, sums) in sums.iter_mut().enumerate() {
                let w = D::splat(*weights.add(group * ROWS + r));
                for (sum, x) in sums.iter_mut().zip(x) {
                    *sum = D::add(*sum, w, x);
                }
            }
        }
        sums
    }
}
