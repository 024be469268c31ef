//! Strain projection on the device: offsets that bring the garment's edges into their limits.

use crate::{
    GpuContext, GpuError,
    animator::Buffers,
    kernel::{Dispatch, GROUP, Kernel, Source},
    levels::Levels,
};
use bytemuck::{Pod, Zeroable};
use unic_core::{
    Model,
    projection::{self, Freedom, LEAST_LENGTH, RELAX_SWEEPS, START_ROUNDS, StrainProjection},
};
use wgpu::Buffer;

/// Strain projection of one garment on the device. Asset.
#[derive(Debug)]
pub(crate) struct Projection {
    vertices: usize,
    sweeps: usize,
    bending_sweeps: usize,
    /// First vertex at the place of each vertex.
    firsts: Buffer,
    edges: Vec<Colour>,
    stencils: Vec<Colour>,
    levels: Option<Levels>,
    kernels: Kernels,
}

/// Constraints of one colour, which share no vertex.
#[derive(Debug)]
struct Colour {
    // A buffer of its own, so that the kernel finds their number in the buffer's length.
    constraints: Buffer,
    count: usize,
}

/// Compiled kernels of `projection.wgsl`, by their entry points.
#[derive(Debug)]
struct Kernels {
    clear_offsets: Kernel,
    carry: Kernel,
    project_edges: Kernel,
    smooth_offsets: Kernel,
    keep_offsets: Kernel,
    add_offsets: Kernel,
    load_shown: Kernel,
    stay_above: Kernel,
    store_shown: Kernel,
}

/// Edge in the memory layout of `projection.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PackedEdge {
    ends: [u32; 2],
    limits: [f32; 2],
    shares: [f32; 2],
}

/// Bending stencil in the memory layout of `projection.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Stencil {
    vertices: [u32; 4],
    coefficients: [f32; 4],
    moves: [f32; 4],
}

/// Kind of a tick of the projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ProjectionTick {
    /// Start without a tick before, from offsets of zero.
    Start,
    /// Tick after another one.
    Next,
}

/// Buffers of an animator's intersection handling that limit the relaxation of shown positions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactBuffers<'a> {
    /// Seeds with the marks of `robust.wgsl`.
    pub(crate) seeds: &'a Buffer,
    /// Planes that vertices stay above.
    pub(crate) planes: &'a Buffer,
}

impl Projection {
    /// Uploads the constraints; `share` is the place in an animator's vectors of the share of a given
    /// garment that is left.
    pub(crate) fn new(
        context: &GpuContext,
        model: &Model,
        projection: &StrainProjection,
        share: usize,
    ) -> Self {
        let (config, freedom) = (projection.config(), projection.freedom());
        Self {
            vertices: model.vertex_count(),
            sweeps: config.sweeps,
            bending_sweeps: config.bending_sweeps,
            firsts: context.upload("firsts", projection.first_at_place()),
            edges: (projection.edge_colours())
                .map(|edges| Colour::new(context, "edges", edges, |edge| packed_edge(edge, freedom)))
                .collect(),
            stencils: (projection.stencil_colours())
                .map(|stencils| {
                    Colour::new(context, "stencils", stencils, |stencil| {
                        packed_stencil(stencil, freedom)
                    })
                })
                .collect(),
            levels: (projection.levels()).and_then(|levels| Levels::new(context, levels, freedom)),
            kernels: Kernels::new(context, model, projection, share),
        }
    }

    /// Sets the offsets to zero.
    pub(crate) fn clear_offsets(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        self.for_vertices(&self.kernels.clear_offsets, &[(16, &buffers.offsets)])
    }

    /// Advances the offsets to the predicted positions, which are the shown ones.
    pub(crate) fn advance(&self, buffers: &Buffers, tick: ProjectionTick) -> Result<Vec<Dispatch>, GpuError> {
        let kernels = &self.kernels;
        let (points, offsets) = ((5, &buffers.points), (16, &buffers.offsets));
        let (predicted, projected) = ((17, &buffers.predicted), (18, &buffers.projected));
        let shown = (9, &buffers.shown);
        let carry = [(0, &buffers.tick), points, shown, offsets, predicted, projected];
        let keep = [points, offsets, predicted, projected, (19, &self.firsts)];
        let mut dispatches = vec![self.for_vertices(&kernels.carry, &carry)?];
        dispatches.extend(self.sweeps(buffers, tick)?);
        dispatches.push(self.for_vertices(&kernels.keep_offsets, &keep)?);
        Ok(dispatches)
    }

    /// Adds the offsets to the shown positions, which are the predicted ones.
    pub(crate) fn add_offsets(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        let bindings = [
            (4, &buffers.vectors),
            (5, &buffers.points),
            (9, &buffers.shown),
            (16, &buffers.offsets),
        ];
        self.for_vertices(&self.kernels.add_offsets, &bindings)
    }

    /// Brings the edges of shown positions back towards their limits after intersection handling,
    /// while each vertex stays above its plane.
    pub(crate) fn relax(
        &self,
        buffers: &Buffers,
        contacts: ContactBuffers,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let kernels = &self.kernels;
        let (shown, projected) = ((9, &buffers.shown), (18, &buffers.projected));
        let planes = [projected, (22, contacts.planes)];
        let store = [shown, (13, contacts.seeds), projected, (19, &self.firsts)];
        let mut sweep = self.edge_sweep(buffers)?;
        sweep.push(self.for_vertices(&kernels.stay_above, &planes)?);
        let mut dispatches = vec![self.for_vertices(&kernels.load_shown, &[shown, projected])?];
        dispatches.extend(std::iter::repeat_n(sweep, RELAX_SWEEPS).flatten());
        dispatches.push(self.for_vertices(&kernels.store_shown, &store)?);
        Ok(dispatches)
    }

    /// Makes the dispatches of all sweeps of a tick, one for each colour in each sweep.
    fn sweeps(&self, buffers: &Buffers, tick: ProjectionTick) -> Result<Vec<Dispatch>, GpuError> {
        let rounds = match tick {
            ProjectionTick::Start => START_ROUNDS,
            ProjectionTick::Next => 1,
        };
        let edges = self.edge_sweep(buffers)?;
        let stencils = self.stencil_sweep(buffers)?;
        let sweep = |round| {
            let bends = round < rounds * self.bending_sweeps;
            let stencils = if bends { &stencils[..] } else { &[] };
            edges.iter().chain(stencils).cloned()
        };
        let mut dispatches = match &self.levels {
            Some(levels) => levels.solve(buffers, rounds)?,
            None => Vec::new(),
        };
        dispatches.extend((0..rounds * self.sweeps).flat_map(sweep));
        Ok(dispatches)
    }

    /// Makes the dispatches of a sweep over the edges.
    fn edge_sweep(&self, buffers: &Buffers) -> Result<Vec<Dispatch>, GpuError> {
        let dispatch = |colour: &Colour| {
            let bindings = [(18, &buffers.projected), (20, &colour.constraints)];
            self.kernels.project_edges.dispatch(&bindings, colour.groups())
        };
        self.edges.iter().map(dispatch).collect()
    }

    /// Makes the dispatches of a sweep over the bending stencils.
    fn stencil_sweep(&self, buffers: &Buffers) -> Result<Vec<Dispatch>, GpuError> {
        let dispatch = |colour: &Colour| {
            let bindings = [
                (17, &buffers.predicted),
                (18, &buffers.projected),
                (21, &colour.constraints),
            ];
            self.kernels.smooth_offsets.dispatch(&bindings, colour.groups())
        };
        self.stencils.iter().map(dispatch).collect()
    }

    fn for_vertices(&self, kernel: &Kernel, bindings: &[(u32, &Buffer)]) -> Result<Dispatch, GpuError> {
        kernel.dispatch(bindings, self.vertices.div_ceil(GROUP))
    }
}

impl Colour {
    fn new<C, P: Pod>(
        context: &GpuContext,
        label: &str,
        constraints: &[C],
        packed: impl Fn(&C) -> P,
    ) -> Self {
        let constraints: Vec<P> = constraints.iter().map(packed).collect();
        Self {
            constraints: context.upload(label, &constraints),
            count: constraints.len(),
        }
    }

    /// Number of workgroups for one invocation a constraint.
    fn groups(&self) -> usize {
        self.count.div_ceil(GROUP)
    }
}

pub(crate) fn packed_edge(edge: &projection::Edge, freedom: &Freedom) -> PackedEdge {
    PackedEdge {
        ends: edge.ends,
        limits: [edge.limit.shortest, edge.limit.longest],
        shares: projection::Edge::shares(edge.ends.map(|end| freedom.of(end))),
    }
}

fn packed_stencil(stencil: &projection::Stencil, freedom: &Freedom) -> Stencil {
    Stencil {
        vertices: stencil.vertices,
        coefficients: stencil.coefficients(),
        moves: stencil.moves(stencil.vertices.map(|v| freedom.of(v))),
    }
}

impl Kernels {
    fn new(context: &GpuContext, model: &Model, projection: &StrainProjection, share: usize) -> Self {
        let text = [
            include_str!("kernels/vertex_state.wgsl"),
            include_str!("kernels/projection.wgsl"),
        ]
        .concat();
        let config = projection.config();
        let dt = 1.0 / model.config().fps;
        // In f32, so that the factors are those of the CPU.
        let left_after_tick = |time_constant: f32| f64::from((-dt / time_constant).exp());
        let vertices = ("VERTICES", model.vertex_count() as f64);
        let radius = ("RADIUS", f64::from(config.radius_m));
        let carry = ("CARRY", left_after_tick(config.carry_s));
        let pull = ("PULL", left_after_tick(config.pull_s));
        let least = ("LEAST_LENGTH", f64::from(LEAST_LENGTH));
        let kernel = |entry: &str, constants: &[(&str, f64)]| {
            let source = Source {
                text: &text,
                entry,
                constants,
            };
            Kernel::new(context, &source)
        };
        Self {
            clear_offsets: kernel("clear_offsets", &[vertices]),
            carry: kernel("carry", &[vertices, carry, pull, radius]),
            project_edges: kernel("project_edges", &[least]),
            smooth_offsets: kernel("smooth_offsets", &[]),
            keep_offsets: kernel("keep_offsets", &[vertices, radius]),
            add_offsets: kernel("add_offsets", &[vertices, ("SHARE", share as f64)]),
            load_shown: kernel("load_shown", &[vertices]),
            stay_above: kernel("stay_above", &[vertices]),
            store_shown: kernel("store_shown", &[vertices]),
        }
    }
}
