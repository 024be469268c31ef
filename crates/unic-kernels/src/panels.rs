//! Panels: the memory layout of a tile's activations.
//!
//! A tile has one row per point. Its columns are cut into panels of 32. A panel stores its rows one
//! after another, 32 floats each. All three products of training read this layout in order:
//!
//! - The forward pass and the input gradient broadcast along a row and load packed weights.
//! - The weight gradient broadcasts along a row of the output gradient and loads rows of the input.
//!
//! Only matrix units need a transposed copy.

/// Number of columns in a panel: two AVX-512 registers or four AVX2 registers.
pub(crate) const PANEL: usize = 32;

/// Columns of a tile, cut into panels.
#[derive(Debug, Clone)]
pub(crate) struct Panels {
    /// Number of used columns of each panel. The others are never read and hold arbitrary values.
    pub(crate) widths: Vec<usize>,
}

impl Panels {
    /// Makes panels for parts with these numbers of columns. Every part begins a new panel.
    pub(crate) fn of(parts: &[usize]) -> Self {
        let widths = parts
            .iter()
            .flat_map(|&part| (0..part).step_by(PANEL).map(move |start| PANEL.min(part - start)));
        Self {
            widths: widths.collect(),
        }
    }

    /// Returns the number of panels.
    pub(crate) fn count(&self) -> usize {
        self.widths.len()
    }

    /// Lists the first column of each panel, counted over all used columns, and the panel's width.
    pub(crate) fn starts(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.widths.iter().scan(0, |start, &width| {
            let panel = (*start, width);
            *start += width;
            Some(panel)
        })
    }
}

/// Copies row-major `rows` of `width` values into panels that are `stride` floats apart.
pub(crate) fn pack_rows(rows: &[f32], width: usize, panels: &mut [f32], stride: usize) {
    for (row, values) in rows.chunks_exact(width).enumerate() {
        for (panel, part) in values.chunks(PANEL).enumerate() {
            let start = panel * stride + row * PANEL;
            panels[start..start + part.len()].copy_from_slice(part);
        }
    }
}

/// Copies panels that are `stride` floats apart into row-major `rows` of `width` values.
pub(crate) fn unpack_rows(panels: &[f32], stride: usize, rows: &mut [f32], width: usize) {
    for (row, values) in rows.chunks_exact_mut(width).enumerate() {
        for (panel, part) in values.chunks_mut(PANEL).enumerate() {
            let start = panel * stride + row * PANEL;
            part.copy_from_slice(&panels[start..start + part.len()]);
        }
    }
}
