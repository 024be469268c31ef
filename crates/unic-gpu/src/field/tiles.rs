//! The field through matrix units: sizes, and the text of its kernel.

use super::{FieldShape, source};
use crate::{GpuError, context::MatrixUnits};
use unic_core::model::Model;
use wgpu::Limits;

/// Blocks of outputs that one subgroup sums up.
const ROWS: usize = 2;
/// Blocks of vertices in a tile, at most: more sums would not fit the registers of a subgroup.
const MOST_COLUMNS: usize = 4;
/// Halves between two outputs beyond a tile's vertices: from 16 vertices on, eight rows of a matrix then lie in
/// different banks.
const PADDING: usize = 8;

/// A tile of vertices that a workgroup takes through the layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tiles {
    units: MatrixUnits,
    /// Of the hidden layers.
    width: usize,
    /// Blocks of vertices.
    columns: usize,
}

impl Tiles {
    /// As large as fit the device.
    pub(super) fn new(units: MatrixUnits, width: usize, limits: &Limits) -> Result<Self, GpuError> {
        let step = ROWS * units.side;
        let tiles = |blocks: usize, columns| Self {
            units,
            width: blocks * step,
            columns,
        };
        let blocks = width.div_ceil(step);
        let mut sizes = [MOST_COLUMNS, MOST_COLUMNS / 2, 1]
            .map(|columns| tiles(blocks, columns))
            .into_iter();
        sizes.find(|tiles| tiles.fit(limits)).ok_or_else(|| {
            let smaller = (1..blocks).take_while(|&blocks| tiles(blocks, 1).fit(limits));
            GpuError::TooLarge {
                what: "the width of the field on matrix units",
                most: smaller.count() * step,
                found: blocks * step,
            }
        })
    }

    fn fit(&self, limits: &Limits) -> bool {
        let invocations = limits
            .max_compute_invocations_per_workgroup
            .min(limits.max_compute_workgroup_size_x);
        self.bytes() <= limits.max_compute_workgroup_storage_size as usize
            && self.invocations() <= invocations as usize
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Vertices.
    pub(super) fn lanes(&self) -> usize {
        self.columns * self.units.side
    }

    /// What the width is shared out into, one to a subgroup.
    fn jobs(&self) -> usize {
        self.width / (ROWS * self.units.side)
    }

    /// As many as the jobs need where all subgroups are of the largest size. Of smaller ones there are more than jobs.
    fn invocations(&self) -> usize {
        self.jobs() * self.units.largest_subgroup
    }

    /// Numbers from one output's activations to the next one's.
    fn pitch(&self) -> usize {
        self.lanes() + PADDING
    }

    /// Numbers of the matrices that are staged at a time: one of each job, and one of subgroups without.
    fn staged(&self) -> usize {
        (self.jobs() + 1) * self.units.side * self.units.side
    }

    fn bytes(&self) -> usize {
        2 * self.width * self.pitch() + 4 * self.staged()
    }

    /// `field_matrix.wgsl` for these sizes.
    pub(super) fn source(&self, shape: &FieldShape, model: &Model, biases: usize) -> String {
        let sizes = [
            ("SIDE", self.units.side),
            ("ROWS", ROWS),
            ("JOBS", self.jobs()),
            ("LANES", self.lanes()),
            ("PITCH", self.pitch()),
            ("THREADS", self.invocations()),
            ("HIDDEN", self.width * self.pitch()),
            ("STAGED", self.staged()),
            ("STRIDE", shape.stride(model.vertex_count())),
            ("BIASES", biases),
            ("HEAD", 2 * shape.inputs * self.width),
        ];
        let (update, state) = source::state_update(model);
        let side = self.units.side;
        let extensions = "enable f16;\nenable wgpu_cooperative_matrix;\nconst LARGEST = 65504.0f;\n";
        let matrices = format!(
            "alias Weights = coop_mat{side}x{side}<f16, A>;
             alias Activations = coop_mat{side}x{side}<f16, B>;
             alias Sums = coop_mat{side}x{side}<f32, C>;\n"
        );
        let constants = source::constants(shape, model, &sizes);
        source::filled(
            include_str!("../kernels/field_matrix.wgsl"),
            &[
                (
                    "//{constants}",
                    extensions.to_owned() + &matrices + &constants + &state,
                ),
                (
                    "//{zeros}",
                    self.for_matrices(|r, c| format!("var c{r}{c} = Sums();")),
                ),
                ("//{products}", self.products()),
                ("//{outputs}", self.for_matrices(output)),
                ("//{update}", update.to_owned()),
            ],
        )
    }

    /// One block of the inputs times all outputs and vertices of a subgroup.
    fn products(&self) -> String {
        let rows = (0..ROWS).map(|r| {
            format!(
                "let a{r} = coopLoad<Weights>(&hidden_weights[weights + k * WIDTH + {r}u * SIDE], WIDTH);"
            )
        });
        let columns = (0..self.columns)
            .map(|c| format!("let b{c} = coopLoadT<Activations>(&hidden[k * PITCH + {c}u * SIDE], PITCH);"));
        let loads: Vec<String> = rows.chain(columns).collect();
        let sums = self.for_matrices(|r, c| format!("c{r}{c} = coopMultiplyAdd(a{r}, b{c}, c{r}{c});"));
        loads.join("\n") + "\n" + &sums
    }

    fn for_matrices(&self, line: impl Fn(usize, usize) -> String) -> String {
        let columns = self.columns;
        let lines = (0..ROWS).flat_map(|r| (0..columns).map(move |c| (r, c)));
        let lines: Vec<String> = lines.map(|(r, c)| line(r, c)).collect();
        lines.join("\n")
    }
}

/// Stages a matrix of each job and turns it into activations. Behind the first barrier no subgroup reads the
/// layer before any more; behind the last one the next layer may.
fn output(r: usize, c: usize) -> String {
    format!(
        "coopStoreT(c{r}{c}, &staged[stage], SIDE);
        workgroupBarrier();
        activate_staged(layer, tile, {r}u * SIDE, {c}u * SIDE, t);
        workgroupBarrier();"
    )
}

#[cfg(test)]
mod tests;
