//! Matrix product of one layer for a tile of vertices, one block of outputs at a time.

use super::{
    arithmetic::{Arithmetic, F32},
    words::WordProducts,
};
use crate::simd::Float;

/// Products of a block of outputs with all inputs of a layer.
///
/// Activations are stored as words, group after group. Word (g, v) holds the channels of group g of
/// vertex v, and a tile is `W` vertices wide. Weights are stored block after block;
/// [`Kernel::place`] orders the words within a block.
///
/// # Safety
/// Callers run on a machine that has the kernel's instructions, between [`Kernel::begin`] and
/// [`Kernel::end`].
pub(super) trait Kernel {
    /// Number format of the words.
    type Arithmetic: Arithmetic;
    /// Kernel of the last layer, on the same instructions.
    type Head: Kernel<Arithmetic = F32>;
    /// Register of f32 for the work between layers.
    type Float: Float;
    /// Outputs of a block.
    const ROWS: usize;
    /// Layers are padded to a multiple of this and of a block, so that the next layer reads whole
    /// words.
    const PADDED: usize;

    /// True if [`Kernel::block`] reads `active`.
    const SKIPS_ZEROS: bool;

    /// Index of a weight's word in its block of `groups` words a row.
    fn place(row: usize, group: usize, groups: usize) -> usize;

    /// Prepares the thread, before the first block.
    unsafe fn begin() {}
    /// Releases what [`begin`](Self::begin) has taken, after the last block.
    unsafe fn end() {}

    /// Computes sums[row][vertex] = Σ weights · activations over all groups.
    ///
    /// Groups that `active` does not list are zero at every vertex of the tile.
    ///
    /// # Safety
    /// The contract of the trait; `active` lists groups that the layer has.
    unsafe fn block<const W: usize>(
        weights: &[u32],
        words: &[u32],
        active: &[u32],
        sums: &mut [<Self::Arithmetic as Arithmetic>::Sum],
    );
}

/// Kernel with vertices in the lanes of vector registers.
///
/// It sums `R` outputs for `N` registers of vertices at a time, so that a loaded weight serves `N`
/// products and a loaded activation `R`. It leaves out groups of zero activations.
pub(super) struct Registers<D, H, const R: usize, const N: usize>(D, H);

/// Outputs of a block.
///
/// 8 divides the usual widths, so that no products are wasted on padding. The 8 × 2 sums of AVX-512
/// are twice as many as hide the latency of two multiply-adds a cycle.
const ROWS: usize = 8;

/// Prefetch distance in words, 2 KiB.
///
/// Weights come from the second-level cache. With the processor's own prefetcher alone, a tenth of
/// the arithmetic rate is lost.
const PREFETCH_WORDS: usize = 512;

impl<D, H, const R: usize, const N: usize> Kernel for Registers<D, H, R, N>
where
    D: WordProducts,
    H: WordProducts<Arithmetic = F32>,
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
                // SAFETY: rows `row..row + R` and lanes `lane..lane + N · LANES` lie within the
                // block and the tile, whose sizes they divide; sums are 32 bits wide.
                unsafe {
                    let weights = weights.as_ptr().add(row);
                    let words = words.as_ptr().add(lane);
                    // Following the list costs 4 %, so that a tile without zero groups does not.
                    let active_groups = active.iter().map(|&g| g as usize);
                    let block = match active.len() < groups {
                        true => block_of_registers::<D, R, N, W>(weights, words, active_groups),
                        false => block_of_registers::<D, R, N, W>(weights, words, 0..groups),
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

/// Sums `R` outputs for `N` registers of vertices over `groups`.
///
/// # Safety
/// The machine has the instructions of `D`. For every group, `weights` is valid for `R` words at
/// offset group · [`ROWS`], and `words` for `N · LANES` words at offset group · `W`.
#[inline(always)]
unsafe fn block_of_registers<D: WordProducts, const R: usize, const N: usize, const W: usize>(
    weights: *const u32,
    words: *const u32,
    groups: impl Iterator<Item = usize>,
) -> [[D::Sum; N]; R] {
    // SAFETY: see above.
    unsafe {
        let mut sums = [[D::zero(); N]; R];
        for group in groups {
            let words = words.add(group * W);
            D::prefetch(weights.wrapping_add(group * ROWS + PREFETCH_WORDS));
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
