//! The layout of a tile's activations.
//!
//! A tile holds some points (its rows) with some columns each. Its columns are cut into panels of 32; a panel stores
//! its rows one after another, 32 floats each. All three products of training walk this one layout in order: forward
//! and input gradient broadcast along a row and stream packed weights, the weight gradient broadcasts along a row of
//! the output gradient and streams rows of the input. Only matrix units need a transposed copy.

/// Columns in a panel: two AVX-512 registers, four AVX2 registers.
pub(crate) const PANEL: usize = 32;

/// Columns of a tile cut into panels.
#[derive(Debug, Clone)]
pub(crate) struct Panels {
    /// Columns in use in each panel; only these are ever read.
    pub(crate) widths: Vec<usize>,
}

impl Panels {
    /// Panels for the given parts in order; every part starts a panel of its own.
    pub(crate) fn of(parts: &[usize]) -> Self {
        let widths = parts
            .iter()
            .flat_map(|&part| (0..part).step_by(PANEL).map(move |start| PANEL.min(part - start)));
        Self {
            widths: widths.collect(),
        }
    }

    /// Number of panels.
    pub(crate) fn count(&self) -> usize {
        self.widths.len()
    }

    /// First column, among all columns, of each panel with its width.
    pub(crate) fn starts(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.widths.iter().scan(0, |start, &width| {
            let panel = (*start, width);
            *start += width;
            Some(panel)
        })
    }
}

/// Copies row-major `rows` of `width` numbers into panels whose rows lie `stride` floats a panel apart.
pub(crate) fn scatter(rows: &[f32], width: usize, panels: &mut [f32], stride: usize) {
    for (row, values) in rows.chunks_exact(width).enumerate() {
        for (panel, part) in values.chunks(PANEL).enumerate() {
            let start = panel * stride + row * PANEL;
            panels[start..start + part.len()].copy_from_slice(part);
        }
    }
}

/// The way back: copies panels into row-major `rows` of `width` numbers.
pub(crate) fn gather(panels: &[f32], stride: usize, rows: &mut [f32], width: usize) {
    for (row, values) in rows.chunks_exact_mut(width).enumerate() {
        for (panel, part) in values.chunks_mut(PANEL).enumerate() {
            let start = panel * stride + row * PANEL;
            part.copy_from_slice(&panels[start..start + part.len()]);
        }
    }
}
