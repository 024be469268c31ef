//! The inner loops of [`crate::product`], generic over the register.
//!
//! Everything here is inlined into entry points compiled for one instruction set, and trusts them to have checked
//! every slice.

use std::ops::Range;

use crate::lanes::Lanes;
use crate::panels::PANEL;
use crate::product::{Affine, Finish, Outer, Start, Tile};

/// f32 in a cache line.
const LINE: usize = 16;

/// Steps of the inner index a loop turn: the loop's own instructions compete with the multiply-adds for ports.
const UNROLL: usize = 4;

/// All strips of all output panels; a strip's packed weights stay in the first-level cache for all its rows.
#[inline(always)]
pub(crate) unsafe fn affine_strips<V: Lanes, const ROWS: usize, const COLUMNS: usize>(
    job: &Affine,
    output: *mut f32,
) {
    for (panel, &width) in job.output_widths.iter().enumerate() {
        let mut column = 0;
        while column < width {
            // SAFETY: the caller's contract; `column` lies inside the panel.
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

#[inline(always)]
unsafe fn affine_strip<V: Lanes, const ROWS: usize, const COLUMNS: usize>(
    job: &Affine,
    output: *mut f32,
    panel: usize,
    column: usize,
) {
    let Range { start: mut row, end } = job.rows;
    // SAFETY: the caller's contract; each block ends at or before `end`.
    unsafe {
        while row + ROWS <= end {
            affine_block::<V, ROWS, COLUMNS>(job, output, panel, row * PANEL + column);
            fetch_ahead::<V>(job, panel * job.rows.len() + row - job.rows.start, ROWS);
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

/// Fetches the share of `rows` rows, of all rows of all panels, in what comes next.
#[inline(always)]
unsafe fn fetch_ahead<V: Lanes>(job: &Affine, first: usize, rows: usize) {
    let total = job.output_widths.len() * job.rows.len();
    for next in &job.ahead {
        let length = (next.end.addr() - next.start.addr()) / size_of::<f32>();
        for line in (length * first / total..length * (first + rows) / total).step_by(LINE) {
            // SAFETY: the caller's contract: the processor runs V; prefetches never fault.
            unsafe { V::prefetch_far(next.start.wrapping_add(line)) }
        }
    }
}

/// ROWS x COLUMNS registers of the output, `offset` floats into output panel `panel`.
#[inline(always)]
unsafe fn affine_block<V: Lanes, const ROWS: usize, const COLUMNS: usize>(
    job: &Affine,
    output: *mut f32,
    panel: usize,
    offset: usize,
) {
    let column = offset % PANEL;
    let first_row = offset - column;
    let target = panel * job.input.stride + offset;
    let depth: usize = job.input.widths.iter().sum();
    // SAFETY: `affine` has checked that all panels, rows and columns named here lie inside their slices.
    unsafe {
        let output = output.add(target);
        let mut sums = match job.start {
            Start::Bias(bias) => [load_row::<V, COLUMNS>(bias.as_ptr().add(panel * PANEL + column)); ROWS],
            Start::Output => std::array::from_fn(|row| load_row(output.add(row * PANEL))),
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
        finish_block(&job.finish, &mut sums, target);
        for (row, sums) in sums.iter().enumerate() {
            store_row(sums, output.add(row * PANEL));
        }
    }
}

#[inline(always)]
unsafe fn finish_block<V: Lanes, const ROWS: usize, const COLUMNS: usize>(
    finish: &Finish,
    sums: &mut [[V; COLUMNS]; ROWS],
    target: usize,
) {
    // SAFETY: the gate is as long as the output.
    unsafe {
        match finish {
            Finish::Keep => {}
            Finish::Relu => {
                for row in sums {
                    *row = row.map(|sum| sum.relu());
                }
            }
            Finish::Gate(gate) => {
                for (row, sums) in sums.iter_mut().enumerate() {
                    let gates: [V; COLUMNS] = load_row(gate.as_ptr().add(target + row * PANEL));
                    *sums = std::array::from_fn(|column| sums[column].where_positive(gates[column]));
                }
            }
        }
    }
}

/// All strips of all input panels; a strip of the input stays in the first-level cache for all outputs.
#[inline(always)]
pub(crate) unsafe fn outer_strips<V: Lanes, const ROWS: usize, const COLUMNS: usize>(
    job: &Outer,
    sums: *mut f32,
) {
    for (panel, &width) in job.input.widths.iter().enumerate() {
        let mut column = 0;
        while column < width {
            // SAFETY: the caller's contract; `column` lies inside the panel.
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

#[inline(always)]
unsafe fn outer_strip<V: Lanes, const ROWS: usize, const COLUMNS: usize>(
    job: &Outer,
    input: *const f32,
    mut sums: *mut f32,
) {
    for (panel, &width) in job.gradient.widths.iter().enumerate() {
        let mut column = 0;
        while column < width {
            // SAFETY: the caller's contract; each block ends at or before `width`.
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

/// ROWS x COLUMNS registers of a weight's gradient; returns ROWS.
#[inline(always)]
unsafe fn outer_block<V: Lanes, const ROWS: usize, const COLUMNS: usize>(
    rows: usize,
    mut gradient: *const f32,
    mut input: *const f32,
    target: *mut f32,
) -> usize {
    // SAFETY: `outer` has checked that all panels, rows and columns named here lie inside their slices.
    unsafe {
        for row in 0..ROWS {
            // The target of every block is far from the last one's: without this its first touch stalls the block.
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

#[inline(always)]
pub(crate) unsafe fn column_sums_lanes<V: Lanes>(tile: &Tile, rows: Range<usize>, sums: *mut f32) {
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

/// `sums[row][column] += from[row · step] · factors[column]`.
#[inline(always)]
unsafe fn accumulate<V: Lanes, const ROWS: usize, const COLUMNS: usize>(
    sums: &mut [[V; COLUMNS]; ROWS],
    from: *const f32,
    step: usize,
    factors: &[V; COLUMNS],
) {
    for (row, sums) in sums.iter_mut().enumerate() {
        // SAFETY: the caller's contract: ROWS numbers lie `step` apart at `from`.
        unsafe {
            let value = V::splat(*from.add(row * step));
            for (sum, factor) in sums.iter_mut().zip(factors) {
                *sum = value.mul_add(*factor, *sum);
            }
        }
    }
}

#[inline(always)]
unsafe fn load_row<V: Lanes, const COLUMNS: usize>(from: *const f32) -> [V; COLUMNS] {
    // SAFETY: the caller's contract: COLUMNS registers lie side by side at `from`.
    std::array::from_fn(|column| unsafe { V::load(from.add(column * V::COUNT)) })
}

#[inline(always)]
unsafe fn store_row<V: Lanes, const COLUMNS: usize>(row: &[V; COLUMNS], to: *mut f32) {
    for (column, value) in row.iter().enumerate() {
        // SAFETY: the caller's contract: COLUMNS registers fit side by side at `to`.
        unsafe { value.store(to.add(column * V::COUNT)) }
    }
}
