//! The three products of training on tiles in panels ([`crate::panels`]), for every instruction set.
//!
//! Each output number is one chain of fused multiply-adds in the order of its inner index, whatever the lanes, so
//! every instruction set computes the same bytes.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m256, __m512};
use std::ops::Range;

use crate::lanes::{InstructionSet, Lanes, Quad};
use crate::panels::PANEL;

/// Where the sums of [`affine`] start.
#[derive(Clone, Copy)]
pub(crate) enum Start<'a> {
    /// At one value a column, panel after panel.
    Bias(&'a [f32]),
    /// At what the output holds.
    Output,
}

/// What happens to the sums of [`affine`] before they are stored.
#[derive(Clone, Copy)]
pub(crate) enum Finish<'a> {
    /// Nothing: the head, and gradients of inputs.
    Keep,
    /// max(0, ·): hidden layers.
    Relu,
    /// Zero where this tile, laid out as the output, is not positive: the gradient through a ReLU.
    Gate(&'a [f32]),
}

/// A tile seen by a product: panels whose rows lie `stride` floats a panel apart.
#[derive(Clone, Copy)]
pub(crate) struct Tile<'a> {
    pub(crate) data: &'a [f32],
    pub(crate) widths: &'a [usize],
    pub(crate) stride: usize,
}

/// `output = finish(start + input · weights)` for some rows of a tile.
pub(crate) struct Affine<'a> {
    pub(crate) input: Tile<'a>,
    /// For each output panel, for each input column, 32 floats.
    pub(crate) weights: &'a [f32],
    pub(crate) start: Start<'a>,
    pub(crate) finish: Finish<'a>,
    pub(crate) rows: Range<usize>,
    /// Columns in use in each output panel; strides are the input's.
    pub(crate) output_widths: &'a [usize],
}

/// Computes `job` into `output`.
pub(crate) fn affine(set: InstructionSet, job: &Affine, output: &mut [f32]) {
    let depth = job.input.widths.iter().sum::<usize>();
    let panels = job.output_widths.len();
    check_tile(&job.input, job.rows.end);
    assert!(job.weights.len() >= panels * depth * PANEL);
    assert!(output.len() >= tile_length(panels, job.input.stride, job.rows.end));
    assert!(job.output_widths.iter().all(|&width| width <= PANEL));
    match job.start {
        Start::Bias(bias) => assert!(bias.len() >= panels * PANEL),
        Start::Output => {}
    }
    match job.finish {
        Finish::Gate(gate) => assert!(gate.len() >= tile_length(panels, job.input.stride, job.rows.end)),
        Finish::Keep | Finish::Relu => {}
    }
    let output = output.as_mut_ptr();
    // SAFETY: every slice reaches as far as the loops read or write, and the set is one this processor runs: fields
    // refuse others.
    unsafe {
        match set {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => affine_avx512(job, output),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => affine_avx2(job, output),
            _ => affine_strips::<Quad, 4, 2>(job, output),
        }
    }
}

/// `sums += gradientᵀ · input` over the first `rows` rows: the gradient of a weight.
///
/// `sums` holds, for each input panel, for each column of `gradient`, 32 floats.
pub(crate) fn outer(set: InstructionSet, gradient: Tile, input: Tile, rows: usize, sums: &mut [f32]) {
    check_tile(&gradient, rows);
    check_tile(&input, rows);
    let outputs = gradient.widths.iter().sum::<usize>();
    assert!(sums.len() >= input.widths.len() * outputs * PANEL);
    assert!(gradient.widths.iter().rev().skip(1).all(|&width| width == PANEL), "one part");
    let job = Outer { gradient, input, rows, outputs };
    let sums = sums.as_mut_ptr();
    // SAFETY: as in `affine`.
    unsafe {
        match set {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => outer_avx512(&job, sums),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => outer_avx2(&job, sums),
            _ => outer_strips::<Quad, 4, 2>(&job, sums),
        }
    }
}

/// `sums += Σ over rows of tile`, one number a column, panel after panel: the gradient of a bias.
pub(crate) fn column_sums(set: InstructionSet, tile: Tile, rows: Range<usize>, sums: &mut [f32]) {
    check_tile(&tile, rows.end);
    assert!(sums.len() >= tile.widths.len() * PANEL);
    let sums = sums.as_mut_ptr();
    // SAFETY: as in `affine`.
    unsafe {
        match set {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => column_sums_avx512(&tile, rows, sums),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => column_sums_avx2(&tile, rows, sums),
            _ => column_sums_lanes::<Quad>(&tile, rows, sums),
        }
    }
}

fn check_tile(tile: &Tile, rows: usize) {
    assert!(tile.widths.iter().all(|&width| width <= PANEL));
    assert!(tile.data.len() >= tile_length(tile.widths.len(), tile.stride, rows));
}

fn tile_length(panels: usize, stride: usize, rows: usize) -> usize {
    assert!(rows * PANEL <= stride);
    panels * stride
}

/// The gradient of a weight, checked.
struct Outer<'a> {
    gradient: Tile<'a>,
    input: Tile<'a>,
    rows: usize,
    outputs: usize,
}

// Rows and registers a block: 12 x 2 = 24 sums fill most of AVX-512's 32 registers and need 14 loads for 24
// multiply-adds; 6 x 2 does the same for AVX2's 16 registers.
#[cfg(target_arch = "x86_64")]
macro_rules! entry_points {
    ($feature:literal, $register:ty, $affine_rows:literal, $outer_rows:literal,
     $affine:ident, $outer:ident, $column_sums:ident) => {
        #[target_feature(enable = $feature)]
        fn $affine(job: &Affine, output: *mut f32) {
            // SAFETY: checked by `affine`, the only caller.
            unsafe { affine_strips::<$register, $affine_rows, 2>(job, output) }
        }

        #[target_feature(enable = $feature)]
        fn $outer(job: &Outer, sums: *mut f32) {
            // SAFETY: checked by `outer`, the only caller.
            unsafe { outer_strips::<$register, $outer_rows, 2>(job, sums) }
        }

        #[target_feature(enable = $feature)]
        fn $column_sums(tile: &Tile, rows: Range<usize>, sums: *mut f32) {
            // SAFETY: checked by `column_sums`, the only caller.
            unsafe { column_sums_lanes::<$register>(tile, rows, sums) }
        }
    };
}

#[cfg(target_arch = "x86_64")]
entry_points!("avx512f", __m512, 12, 8, affine_avx512, outer_avx512, column_sums_avx512);
#[cfg(target_arch = "x86_64")]
entry_points!("avx2,fma", __m256, 6, 4, affine_avx2, outer_avx2, column_sums_avx2);

/// All strips of all output panels; a strip's packed weights stay in the first-level cache for all its rows.
#[inline(always)]
unsafe fn affine_strips<V: Lanes, const ROWS: usize, const COLUMNS: usize>(job: &Affine, output: *mut f32) {
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
            for _ in 0..width {
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
unsafe fn outer_strips<V: Lanes, const ROWS: usize, const COLUMNS: usize>(job: &Outer, sums: *mut f32) {
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
                let gradient = job.gradient.data.as_ptr().add(panel * job.gradient.stride + column);
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
            V::prefetch(target.add(row * PANEL));
            V::prefetch(target.add(row * PANEL + PANEL / 2));
        }
        let mut sums = [[V::splat(0.0); COLUMNS]; ROWS];
        for _ in 0..rows {
            let factors: [V; COLUMNS] = load_row(input);
            accumulate(&mut sums, gradient, 1, &factors);
            gradient = gradient.add(PANEL);
            input = input.add(PANEL);
        }
        for (row, sums) in sums.iter().enumerate() {
            let target = target.add(row * PANEL);
            let before: [V; COLUMNS] = load_row(target);
            store_row(&std::array::from_fn::<V, COLUMNS, _>(|column| before[column].add(sums[column])), target);
        }
    }
    ROWS
}

#[inline(always)]
unsafe fn column_sums_lanes<V: Lanes>(tile: &Tile, rows: Range<usize>, sums: *mut f32) {
    for (panel, &width) in tile.widths.iter().enumerate() {
        for column in (0..width).step_by(V::COUNT) {
            // SAFETY: `column_sums` has checked that all panels and rows lie inside their slices.
            unsafe {
                let target = sums.add(panel * PANEL + column);
                let mut sum = V::load(target);
                for row in rows.clone() {
                    sum = sum.add(V::load(tile.data.as_ptr().add(panel * tile.stride + row * PANEL + column)));
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
