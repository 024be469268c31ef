//! Microkernels: the inner loops of [`crate::product`], generic over the SIMD vector.
//!
//! All functions are inlined into entry points that are compiled for one instruction set. They
//! trust these entry points to have checked every slice.

use std::ops::Range;

use crate::panels::PANEL;
use crate::product::{AffineProduct, Epilogue, InitialSum, OuterProduct, Tile};
use crate::simd::SimdVector;

/// Number of f32 in a cache line.
const LINE: usize = 16;

/// Steps of the inner index per loop iteration. The instructions of the loop itself compete with
/// the multiply-adds for execution ports.
const UNROLL: usize = 4;

/// Computes an affine product strip by strip. A strip is COLUMNS vectors wide; its packed weights
/// stay in the first-level cache for all rows.
#[inline(always)]
pub(crate) unsafe fn affine_strips<V: SimdVector, const ROWS: usize, const COLUMNS: usize>(
    job: &AffineProduct,
    output: *mut f32,
) {
    for (panel, &width) in job.output_widths.iter().enumerate() {
        let mut column = 0;
        while column < width {
            // SAFETY: guaranteed by the caller; `column` lies inside the panel.
            unsafe {
                if width - column <= V::COUNT {
                    affine_strip::<V, ROWS, 1>(job, output, panel, column);
                    column += V::COUNT;
                } else {
                    affine_strip::<V, ROWS, COLUMNS>(job, output, panel, column);
                    column += COLUMNS * V::COUNT;
                }
            }
        }
    }
}

/// Computes one strip: blocks of ROWS rows, then of 4 rows, then single rows.
#[inline(always)]
unsafe fn affine_strip<V: SimdVector, const ROWS: usize, const COLUMNS: usize>(
    job: &AffineProduct,
    output: *mut f32,
    panel: usize,
    column: usize,
) {
    let Range { start: mut row, end } = job.rows;
    // SAFETY: guaranteed by the caller; each block ends at or before `end`.
    unsafe {
        while row + ROWS <= end {
            affine_block::<V, ROWS, COLUMNS>(job, output, panel, row * PANEL + column);
            prefetch_share::<V>(job, panel * job.rows.len() + row - job.rows.start, ROWS);
            row += ROWS;
        }
        while row + 4 <= end {
            affine_block::<V, 4, COLUMNS>(job, output, panel, row * PANEL + column);
            row += 4;
        }
        while row < end {
            affine_block::<V, 1, COLUMNS>(job, output, panel, row * PANEL + column);
            row += 1;
        }
    }
}

/// Prefetches a part of the next product's data, in proportion to `rows` of all rows of all panels.
#[inline(always)]
unsafe fn prefetch_share<V: SimdVector>(job: &AffineProduct, first: usize, rows: usize) {
    let total = job.output_widths.len() * job.rows.len();
    for next in &job.prefetch {
        let length = (next.end.addr() - next.start.addr()) / size_of::<f32>();
        for line in (length * first / total..length * (first + rows) / total).step_by(LINE) {
            // SAFETY: the caller guarantees that the processor runs V; prefetches never fault.
            unsafe { V::prefetch_far(next.start.wrapping_add(line)) }
        }
    }
}

/// Computes a block of ROWS × COLUMNS vectors of the output, at `offset` floats in panel `panel`.
#[inline(always)]
unsafe fn affine_block<V: SimdVector, const ROWS: usize, const COLUMNS: usize>(
    job: &AffineProduct,
    output: *mut f32,
    panel: usize,
    offset: usize,
) {
    let column = offset % PANEL;
    let first_row = offset - column;
    let target = panel * job.input.stride + offset;
    let depth: usize = job.input.widths.iter().sum();
    // SAFETY: `affine` has checked that all panels, rows and columns named here lie inside their
    // slices.
    unsafe {
        let output = output.add(target);
        // The sums stay in registers for all of the inner index. Each is a single chain of
        // multiply-adds in the order of that index, so that every block size gives the same bits.
        let mut sums = match job.initial {
            InitialSum::Bias(bias) => {
                [load_row::<V, COLUMNS>(bias.as_ptr().add(panel * PANEL + column)); ROWS]
            }
            InitialSum::Output => std::array::from_fn(|row| load_row(output.add(row * PANEL))),
        };
        let mut weights = job.weights.as_ptr().add(panel * depth * PANEL + column);
        for (index, &width) in job.input.widths.iter().enumerate() {
            let mut input = job.input.data.as_ptr().add(index * job.input.stride + first_row);
            for _ in 0..width / UNROLL {
                for step in 0..UNROLL {
                    let factors: [V; COLUMNS] = load_row(weights.add(step * PANEL));
                    accumulate(&mut sums, input.add(step), PANEL, &factors);
                }
                weights = weights.add(UNROLL * PANEL);
                input = input.add(UNROLL);
            }
            for _ in 0..width % UNROLL {
                let factors: [V; COLUMNS] = load_row(weights);
                accumulate(&mut sums, input, PANEL, &factors);
                weights = weights.add(PANEL);
                input = input.add(1);
            }
        }
        apply_epilogue(&job.epilogue, &mut sums, target);
        for (row, sums) in sums.iter().enumerate() {
            store_row(sums, output.add(row * PANEL));
        }
    }
}

#[inline(always)]
unsafe fn apply_epilogue<V: SimdVector, const ROWS: usize, const COLUMNS: usize>(
    epilogue: &Epilogue,
    sums: &mut [[V; COLUMNS]; ROWS],
    target: usize,
) {
    // SAFETY: the activations are as long as the output.
    unsafe {
        match epilogue {
            Epilogue::Identity => {}
            Epilogue::Relu => {
                for row in sums {
                    *row = row.map(|sum| sum.relu());
                }
            }
            Epilogue::ReluGradient(activations) => {
                for (row, sums) in sums.iter_mut().enumerate() {
                    let row: [V; COLUMNS] = load_row(activations.as_ptr().add(target + row * PANEL));
                    *sums = std::array::from_fn(|column| sums[column].where_positive(row[column]));
                }
            }
        }
    }
}

/// Computes an outer product strip by strip. A strip of the input is COLUMNS vectors wide and stays
/// in the first-level cache for all outputs.
#[inline(always)]
pub(crate) unsafe fn outer_strips<V: SimdVector, const ROWS: usize, const COLUMNS: usize>(
    job: &OuterProduct,
    sums: *mut f32,
) {
    for (panel, &width) in job.input.widths.iter().enumerate() {
        let mut column = 0;
        while column < width {
            // SAFETY: guaranteed by the caller; `column` lies inside the panel.
            unsafe {
                let input = job.input.data.as_ptr().add(panel * job.input.stride + column);
                let sums = sums.add(panel * job.outputs * PANEL + column);
                if width - column <= V::COUNT {
                    outer_strip::<V, ROWS, 1>(job, input, sums);
                    column += V::COUNT;
                } else {
                    outer_strip::<V, ROWS, COLUMNS>(job, input, sums);
                    column += COLUMNS * V::COUNT;
                }
            }
        }
    }
}

/// Computes one strip: blocks of ROWS outputs, then of 3 outputs, then single outputs.
#[inline(always)]
unsafe fn outer_strip<V: SimdVector, const ROWS: usize, const COLUMNS: usize>(
    job: &OuterProduct,
    input: *const f32,
    mut sums: *mut f32,
) {
    for (panel, &width) in job.gradient.widths.iter().enumerate() {
        let mut column = 0;
        while column < width {
            // SAFETY: guaranteed by the caller; each block ends at or before `width`.
            unsafe {
                let gradient = job
                    .gradient
                    .data
                    .as_ptr()
                    .add(panel * job.gradient.stride + column);
                let step = match width - column {
                    left if left >= ROWS => outer_block::<V, ROWS, COLUMNS>(job.rows, gradient, input, sums),
                    left if left >= 3 => outer_block::<V, 3, COLUMNS>(job.rows, gradient, input, sums),
                    _ => outer_block::<V, 1, COLUMNS>(job.rows, gradient, input, sums),
                };
                column += step;
                sums = sums.add(step * PANEL);
            }
        }
    }
}

/// Computes a block of ROWS × COLUMNS vectors of a weight's gradient. Returns ROWS.
#[inline(always)]
unsafe fn outer_block<V: SimdVector, const ROWS: usize, const COLUMNS: usize>(
    rows: usize,
    mut gradient: *const f32,
    mut input: *const f32,
    target: *mut f32,
) -> usize {
    // SAFETY: `outer` has checked that all panels, rows and columns named here lie inside their
    // slices.
    unsafe {
        for row in 0..ROWS {
            // The target of every block is far from that of the last one. Without a prefetch its
            // first access would stall the block.
            V::prefetch(target.wrapping_add(row * PANEL));
            V::prefetch(target.wrapping_add(row * PANEL + LINE));
        }
        let mut sums = [[V::splat(0.0); COLUMNS]; ROWS];
        for _ in 0..rows / UNROLL {
            for step in 0..UNROLL {
                let factors: [V; COLUMNS] = load_row(input.add(step * PANEL));
                accumulate(&mut sums, gradient.add(step * PANEL), 1, &factors);
            }
            gradient = gradient.add(UNROLL * PANEL);
            input = input.add(UNROLL * PANEL);
        }
        for _ in 0..rows % UNROLL {
            let factors: [V; COLUMNS] = load_row(input);
            accumulate(&mut sums, gradient, 1, &factors);
            gradient = gradient.add(PANEL);
            input = input.add(PANEL);
        }
        // The sum of the block's rows is added to the target as a whole: tiles are summed in f32,
        // and one rounding per tile loses less than one per row.
        for (row, sums) in sums.iter().enumerate() {
            let target = target.add(row * PANEL);
            let before: [V; COLUMNS] = load_row(target);
            store_row(
                &std::array::from_fn::<V, COLUMNS, _>(|column| before[column].add(sums[column])),
                target,
            );
        }
    }
    ROWS
}

/// Adds the sum over some rows of a tile to `sums`, column by column.
#[inline(always)]
pub(crate) unsafe fn column_sums_kernel<V: SimdVector>(tile: &Tile, rows: Range<usize>, sums: *mut f32) {
    for (panel, &width) in tile.widths.iter().enumerate() {
        for column in (0..width).step_by(V::COUNT) {
            // SAFETY: `column_sums` has checked that all panels and rows lie inside their slices.
            unsafe {
                let target = sums.add(panel * PANEL + column);
                let mut sum = V::load(target);
                for row in rows.clone() {
                    sum = sum.add(V::load(
                        tile.data.as_ptr().add(panel * tile.stride + row * PANEL + column),
                    ));
                }
                sum.store(target);
            }
        }
    }
}

/// Computes `sums[row][column] += from[row · step] · factors[column]`.
#[inline(always)]
unsafe fn accumulate<V: SimdVector, const ROWS: usize, const COLUMNS: usize>(
    sums: &mut [[V; COLUMNS]; ROWS],
    from: *const f32,
    step: usize,
    factors: &[V; COLUMNS],
) {
    for (row, sums) in sums.iter_mut().enumerate() {
        // SAFETY: the caller guarantees ROWS values at `from`, `step` apart.
        unsafe {
            let value = V::splat(*from.add(row * step));
            for (sum, factor) in sums.iter_mut().zip(factors) {
                *sum = value.mul_add(*factor, *sum);
            }
        }
    }
}

#[inline(always)]
unsafe fn load_row<V: SimdVector, const COLUMNS: usize>(from: *const f32) -> [V; COLUMNS] {
    // SAFETY: the caller guarantees COLUMNS consecutive vectors at `from`.
    std::array::from_fn(|column| unsafe { V::load(from.add(column * V::COUNT)) })
}

#[inline(always)]
unsafe fn store_row<V: SimdVector, const COLUMNS: usize>(row: &[V; COLUMNS], to: *mut f32) {
    for (column, value) in row.iter().enumerate() {
        // SAFETY: the caller guarantees room for COLUMNS consecutive vectors at `to`.
        unsafe { value.store(to.add(column * V::COUNT)) }
    }
}
