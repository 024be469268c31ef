//! Field kernel with matrix units: sizes, and generation of its WGSL.

use super::{FieldShape, source};
use crate::{GpuError, context::MatrixUnits};
use unic_core::Model;
use wgpu::Limits;

/// Number of blocks of outputs that one subgroup sums.
const ROWS: usize = 2;
/// Largest number of blocks of vertices in a tile. More sums would not fit the registers of a
/// subgroup.
const MAX_COLUMNS: usize = 4;
/// Padding after the activations of each output, in f16. From 16 vertices on, eight rows of a
/// matrix then lie in different memory banks.
const PADDING: usize = 8;

/// Tile of vertices that a workgroup evaluates through all layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tiles {
    units: MatrixUnits,
    /// Width of the hidden layers.
    width: usize,
    /// Number of blocks of vertices.
    columns: usize,
}

impl Tiles {
    /// Chooses the largest tile that fits the device.
    ///
    /// # Errors
    /// Fails when the field is too wide for the device.
    pub(super) fn new(units: MatrixUnits, width: usize, limits: &Limits) -> Result<Self, GpuError> {
        let step = ROWS * units.side;
        let tiles = |blocks: usize, columns| Self {
            units,
            width: blocks * step,
            columns,
        };
        let blocks = width.div_ceil(step);
        let mut sizes = [MAX_COLUMNS, MAX_COLUMNS / 2, 1]
            .map(|columns| tiles(blocks, columns))
            .into_iter();
        sizes.find(|tiles| tiles.fit(limits)).ok_or_else(|| {
            let smaller = (1..blocks).take_while(|&blocks| tiles(blocks, 1).fit(limits));
            GpuError::TooLarge {
                what: "the width of the field on matrix units",
                limit: smaller.count() * step,
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

    /// Number of vertices in the tile.
    pub(super) fn lanes(&self) -> usize {
        self.columns * self.units.side
    }

    /// Number of jobs: parts of the width, one for each subgroup.
    fn jobs(&self) -> usize {
        self.width / (ROWS * self.units.side)
    }

    /// Number of invocations, enough for all jobs if all subgroups have the largest size. With
    /// smaller ones there are more subgroups than jobs.
    fn invocations(&self) -> usize {
        self.jobs() * self.units.largest_subgroup
    }

    /// Stride from one output's activations to the next one's, in numbers.
    fn pitch(&self) -> usize {
        self.lanes() + PADDING
    }

    /// Length of the staging memory: one matrix of each job, and one for subgroups without a job.
    fn staged(&self) -> usize {
        (self.jobs() + 1) * self.units.side * self.units.side
    }

    fn bytes(&self) -> usize {
        2 * self.width * self.pitch() + 4 * self.staged()
    }

    /// Generates `field_matrix.wgsl` for these sizes.
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

    /// Generates the products of one block of inputs with all outputs and vertices of a subgroup.
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

/// Generates code that stages a matrix of each job and turns it into activations.
///
/// After the first barrier no subgroup reads the previous layer any more. After the last one the
/// next layer may read.
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
