//! Sweeps over constraints on the device, in a few dispatches.

use super::{
    packed::{Constraints, Group, Packed},
    plan::{Pass, PlanSizes, passes},
};
use crate::{
    GpuContext, GpuError,
    kernel::{Dispatch, Kernel, Source},
};
use unic_core::projection::LEAST_LENGTH;
use wgpu::{Buffer, Limits};

/// Largest number of vertices of one workgroup, at most 2^16: places are stored in 16 bits. A larger
/// garment is faster with several workgroups.
const CAPACITY: usize = 2048;

/// Largest number of vertices in a patch, if a garment has several.
const PATCH: usize = 512;

/// Largest number of stages of a pass.
const STAGES: usize = 63;

/// Bytes of a vertex in the memory of a workgroup.
const VERTEX_BYTES: usize = 12;

/// Bytes of the ends of the stages in the memory of a workgroup.
const STAGE_BYTES: usize = 8 * (STAGES + 1);

/// Bytes of a sum in the buffer of bends.
pub(crate) const BEND_BYTES: usize = 16;

/// Sweep on the device. Asset.
#[derive(Debug)]
pub(crate) struct Sweep {
    context: GpuContext,
    passes: Vec<PassGroups>,
    vertices: Buffer,
    ends: Buffer,
    edges: Buffer,
    stencils: Buffer,
    bends: usize,
    kernels: Kernels,
}

/// Workgroups of one pass.
#[derive(Debug)]
struct PassGroups {
    groups: Vec<Group>,
    buffer: Buffer,
}

/// Compiled kernels of `sweep.wgsl`, by their entry points.
#[derive(Debug)]
struct Kernels {
    sweep: Kernel,
    /// None without stencils.
    measure_bends: Option<Kernel>,
}

/// Two buffers of positions. A pass reads one and writes the other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Positions<'a> {
    /// Buffer with the current positions.
    pub(crate) now: &'a Buffer,
    pub(super) other: &'a Buffer,
}

impl<'a> Positions<'a> {
    /// Starts in the first of two buffers.
    pub(crate) fn new([now, other]: &'a [Buffer; 2]) -> Self {
        Self { now, other }
    }

    /// Makes the other buffer the one with the current positions.
    pub(super) fn swap(&mut self) {
        std::mem::swap(&mut self.now, &mut self.other);
    }
}

impl Sweep {
    /// Plans and uploads a sweep.
    pub(crate) fn new(context: &GpuContext, constraints: &Constraints) -> Self {
        let limits = context.device().limits();
        let memory = (limits.max_compute_workgroup_storage_size as usize).saturating_sub(STAGE_BYTES);
        let capacity = (memory / VERTEX_BYTES).min(CAPACITY);
        let sizes = PlanSizes {
            // WebGPU counts each array of four bytes a vertex in steps of 16 bytes.
            capacity: capacity / 4 * 4,
            patch: PATCH,
            stages: STAGES,
        };
        let passes = passes(&constraints.corners(), constraints.rest, sizes);
        let mut packed = Packed::default();
        let mut upload = |pass: &Pass| {
            let groups = pass
                .groups
                .iter()
                .map(|group| packed.add(pass, group, constraints));
            let groups: Vec<Group> = groups.collect();
            PassGroups {
                buffer: context.upload("groups of a sweep", &groups),
                groups,
            }
        };
        Self {
            context: context.clone(),
            passes: passes.iter().map(&mut upload).collect(),
            vertices: context.upload("vertices of a sweep", &packed.vertices),
            ends: context.upload("ends of stages", &packed.ends),
            edges: context.upload("edges", &packed.edges),
            stencils: context.upload("stencils", &packed.stencils),
            bends: packed.stencils.len(),
            kernels: Kernels::new(context, &passes, &limits, packed.stencils.is_empty()),
        }
    }

    /// Number of sums in the buffer of bends.
    pub(crate) fn bends(&self) -> usize {
        self.bends
    }

    /// Makes the dispatches that compute the sums of all stencils at the positions from which they
    /// smooth.
    pub(crate) fn measure_bends(
        &self,
        reference: &Buffer,
        bends: &Buffer,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let Some(kernel) = &self.kernels.measure_bends else {
            return Ok(Vec::new());
        };
        let dispatch = |pass: &PassGroups| {
            let bindings = [
                (0, reference),
                (2, &pass.buffer),
                (3, &self.vertices),
                (4, &self.ends),
                (6, &self.stencils),
                (7, bends),
            ];
            kernel.dispatch(&bindings, pass.groups.len())
        };
        self.passes.iter().map(dispatch).collect()
    }

    /// Makes the dispatches of `times` sweeps. `bends` has the sums that `measure_bends` has left.
    pub(crate) fn run(
        &self,
        positions: &mut Positions,
        bends: &Buffer,
        times: usize,
    ) -> Result<Vec<Dispatch>, GpuError> {
        if times == 0 {
            return Ok(Vec::new());
        }
        // A workgroup that owns all vertices needs no dispatch to see the moves of others.
        if let [pass] = &self.passes[..]
            && let [group] = pass.groups[..]
        {
            let groups = self.context.upload("groups of a sweep", &[group.repeated(times)]);
            return Ok(vec![self.dispatch(&groups, 1, positions, bends)?]);
        }
        let sweeps = std::iter::repeat_n(&self.passes, times).flatten();
        let dispatch = |pass: &PassGroups| self.dispatch(&pass.buffer, pass.groups.len(), positions, bends);
        sweeps.map(dispatch).collect()
    }

    fn dispatch(
        &self,
        groups: &Buffer,
        count: usize,
        positions: &mut Positions,
        bends: &Buffer,
    ) -> Result<Dispatch, GpuError> {
        let bindings = [
            (0, positions.now),
            (1, positions.other),
            (2, groups),
            (3, &self.vertices),
            (4, &self.ends),
            (5, &self.edges),
            (6, &self.stencils),
            (7, bends),
        ];
        let dispatch = self.kernels.sweep.dispatch(&bindings, count)?;
        positions.swap();
        Ok(dispatch)
    }
}

/// Number of invocations of a workgroup: one for each constraint of a stage, if the device has so
/// many.
fn lanes(passes: &[Pass], limits: &Limits) -> usize {
    let groups = passes.iter().flat_map(|pass| &pass.groups);
    let constraints = groups.flat_map(|group| &group.constraints).map(Vec::len);
    let most = (limits.max_compute_invocations_per_workgroup).min(limits.max_compute_workgroup_size_x);
    let wanted = constraints.max().unwrap_or(1).next_power_of_two();
    wanted.max(32).min(most as usize)
}

impl Kernels {
    fn new(context: &GpuContext, passes: &[Pass], limits: &Limits, without_stencils: bool) -> Self {
        let groups = passes.iter().flat_map(|pass| &pass.groups);
        let capacity = groups.map(|group| group.vertices.len()).max();
        let text = format!(
            "const CAPACITY = {}u;\nconst LANES = {}u;\nconst STAGE_ENDS = {}u;\n{}",
            // An array has at least one element.
            capacity.unwrap_or(0).max(1),
            lanes(passes, limits),
            STAGES + 1,
            include_str!("../kernels/sweep.wgsl")
        );
        let kernel = |entry: &str, constants: &[(&str, f64)]| {
            let source = Source {
                text: &text,
                entry,
                constants,
            };
            // SAFETY: places are below the number of vertices of their workgroup, which is at most
            // CAPACITY. A workgroup has at most STAGES stages of each kind, and one end more.
            // Vertices, ends and constraints are those of one `Packed`. An animator's buffers have
            // a position for each of `Constraints::rest` and `Sweep::bends` sums. Loops have bounds.
            unsafe { Kernel::unchecked(context, &source) }
        };
        Self {
            sweep: kernel("sweep", &[("LEAST_LENGTH", f64::from(LEAST_LENGTH))]),
            measure_bends: (!without_stencils).then(|| kernel("measure_bends", &[])),
        }
    }
}
