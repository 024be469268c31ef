//! Strain projection on the device: offsets that bring the garment's edges into their limits.

mod levels;
mod order;
mod packed;
mod plan;
mod sweep;

pub(crate) use levels::SAMPLE_START_BYTES;
pub(crate) use order::{FOUND_BYTES, buckets};
pub(crate) use sweep::BEND_BYTES;

use crate::{
    GpuContext, GpuError,
    animator::Buffers,
    kernel::{Dispatch, GROUP, Kernel, Source},
};
use levels::Levels;
use order::{Order, Pushes};
use packed::Constraints;
use sweep::{Positions, Sweep};
use unic_core::{
    Model,
    projection::{RELAX_ROUNDS, RELAX_SWEEPS, START_ROUNDS, StrainProjection, between_pushes},
};
use wgpu::Buffer;

/// Strain projection of one garment on the device. Asset.
#[derive(Debug)]
pub(crate) struct Projection {
    vertices: usize,
    sweeps: usize,
    /// Number of these that are followed by one over the bending stencils.
    hinge_sweeps: usize,
    /// First vertex at the place of each vertex.
    firsts: Buffer,
    /// Sweep over the edges and the bending stencils.
    bending: Sweep,
    /// Sweep over the edges alone.
    edges: Sweep,
    levels: Option<Levels>,
    /// Orders of the cloth: along its smoothed shape, then of its layers, as far as it has them.
    orders: Vec<Order>,
    kernels: Kernels,
}

/// Compiled kernels of `projection.wgsl`, by their entry points.
#[derive(Debug)]
struct Kernels {
    clear_offsets: Kernel,
    carry: Kernel,
    keep_offsets: Kernel,
    add_offsets: Kernel,
    load_shown: Kernel,
    stay_above: Kernel,
    store_shown: Kernel,
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
        let config = projection.config();
        let rest = &model.garment().rest.vertices;
        let sweep = |stencils| {
            let constraints = Constraints {
                edges: projection.edge_colours().collect(),
                stencils,
                freedom: projection.freedom(),
                rest,
            };
            Sweep::new(context, &constraints)
        };
        let levels = projection.levels();
        let levels = levels.and_then(|levels| Levels::new(context, levels, projection.freedom(), rest));
        Self {
            vertices: model.vertex_count(),
            sweeps: config.sweeps,
            hinge_sweeps: config.hinge_sweeps(),
            firsts: context.upload("firsts", projection.first_at_place()),
            bending: sweep(projection.stencil_colours().collect()),
            edges: sweep(Vec::new()),
            orders: orders(context, projection, levels.as_ref(), share),
            levels,
            kernels: Kernels::new(context, model, projection, share),
        }
    }

    /// Number of sums in an animator's buffer of bends.
    pub(crate) fn bends(&self) -> usize {
        let of_levels = self.levels.as_ref().map_or(0, Levels::bends);
        self.bending.bends().max(of_levels)
    }

    /// Sets the offsets to zero.
    pub(crate) fn clear_offsets(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        self.for_vertices(&self.kernels.clear_offsets, &[(16, &buffers.offsets)])
    }

    /// Advances the offsets to the predicted positions, which are the shown ones.
    pub(crate) fn advance(&self, buffers: &Buffers, tick: ProjectionTick) -> Result<Vec<Dispatch>, GpuError> {
        let kernels = &self.kernels;
        let (points, offsets) = ((5, &buffers.points), (16, &buffers.offsets));
        let (predicted, shown) = ((17, &buffers.predicted), (9, &buffers.shown));
        let mut positions = Positions::new(&buffers.projected);
        let carry = [
            (0, &buffers.tick),
            points,
            shown,
            offsets,
            predicted,
            (18, positions.now),
        ];
        let mut dispatches = vec![self.for_vertices(&kernels.carry, &carry)?];
        dispatches.extend(self.sweeps(buffers, &mut positions, tick)?);
        let projected = (18, positions.now);
        let keep = [points, offsets, predicted, projected, (19, &self.firsts)];
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

    /// Measures the bends of the shown positions before intersection handling, from which
    /// [`Projection::relax`] smooths.
    pub(crate) fn measure_uncorrected(&self, buffers: &Buffers) -> Result<Vec<Dispatch>, GpuError> {
        if self.hinge_sweeps == 0 {
            return Ok(Vec::new());
        }
        let positions = &buffers.projected[0];
        let load = [(9, &buffers.shown), (18, positions)];
        let mut dispatches = vec![self.for_vertices(&self.kernels.load_shown, &load)?];
        dispatches.extend(self.bending.measure_bends(positions, &buffers.bends)?);
        Ok(dispatches)
    }

    /// Brings the edges of shown positions back towards their limits after intersection handling,
    /// while each vertex stays above its plane. `Buffers::bends` must hold the sums at the positions
    /// before the handling, see [`Projection::measure_uncorrected`].
    pub(crate) fn relax(
        &self,
        buffers: &Buffers,
        contacts: ContactBuffers,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let kernels = &self.kernels;
        let shown = (9, &buffers.shown);
        let mut positions = Positions::new(&buffers.projected);
        let load = [shown, (18, positions.now)];
        let mut dispatches = vec![self.for_vertices(&kernels.load_shown, &load)?];
        dispatches.extend(self.find_orders(buffers, positions.now)?);
        for _ in 0..RELAX_ROUNDS {
            for order in &self.orders {
                dispatches.push(order.push(buffers, &mut positions, Pushes::Fading)?);
            }
            let hinge_sweeps = self.hinge_sweeps.min(1);
            dispatches.extend(self.sweep(buffers, &mut positions, RELAX_SWEEPS, hinge_sweeps)?);
            let planes = [(18, positions.now), (22, contacts.planes)];
            dispatches.push(self.for_vertices(&kernels.stay_above, &planes)?);
        }
        let projected = (18, positions.now);
        let store = [shown, (13, contacts.seeds), projected, (19, &self.firsts)];
        dispatches.push(self.for_vertices(&kernels.store_shown, &store)?);
        Ok(dispatches)
    }

    /// Makes the dispatches of all sweeps of a tick.
    fn sweeps(
        &self,
        buffers: &Buffers,
        positions: &mut Positions,
        tick: ProjectionTick,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let rounds = match tick {
            ProjectionTick::Start => START_ROUNDS,
            ProjectionTick::Next => 1,
        };
        let mut dispatches = match &self.levels {
            Some(levels) => levels.solve(buffers, positions, rounds)?,
            None => Vec::new(),
        };
        dispatches.extend(self.bending.measure_bends(&buffers.predicted, &buffers.bends)?);
        let (sweeps, hinge_sweeps) = (rounds * self.sweeps, rounds * self.hinge_sweeps);
        if self.orders.is_empty() {
            dispatches.extend(self.sweep(buffers, positions, sweeps, hinge_sweeps)?);
            return Ok(dispatches);
        }
        dispatches.extend(self.sweep(buffers, positions, hinge_sweeps, hinge_sweeps)?);
        dispatches.extend(self.find_orders(buffers, positions.now)?);
        for sweeps in between_pushes(sweeps - hinge_sweeps) {
            for order in &self.orders {
                dispatches.push(order.push(buffers, positions, Pushes::Whole)?);
            }
            dispatches.extend(self.sweep(buffers, positions, sweeps, 0)?);
        }
        Ok(dispatches)
    }

    /// Makes the dispatches that find which vertices may have to be pushed into their order; none without
    /// one.
    fn find_orders(&self, buffers: &Buffers, positions: &Buffer) -> Result<Vec<Dispatch>, GpuError> {
        let mut dispatches = Vec::new();
        for order in &self.orders {
            dispatches.extend(order.find(buffers, self.levels.as_ref(), positions)?);
        }
        Ok(dispatches)
    }

    /// Makes the dispatches of sweeps over the edges, the first `hinge_sweeps` of which are each
    /// followed by one over the hinges.
    fn sweep(
        &self,
        buffers: &Buffers,
        positions: &mut Positions,
        sweeps: usize,
        hinge_sweeps: usize,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let bends = &buffers.bends;
        // A sweep of `self.bending` is one over the edges, then one over the stencils.
        let mut dispatches = self.bending.run(positions, bends, hinge_sweeps)?;
        dispatches.extend(self.edges.run(positions, bends, sweeps - hinge_sweeps)?);
        Ok(dispatches)
    }

    fn for_vertices(&self, kernel: &Kernel, bindings: &[(u32, &Buffer)]) -> Result<Dispatch, GpuError> {
        kernel.dispatch(bindings, self.vertices.div_ceil(GROUP))
    }
}

/// Uploads the orders of a garment, see [`Projection::new`]. That along the smoothed shape needs levels.
fn orders(
    context: &GpuContext,
    projection: &StrainProjection,
    levels: Option<&Levels>,
    share: usize,
) -> Vec<Order> {
    let freedom = projection.freedom();
    let sheet = projection.order().filter(|_| levels.is_some());
    let sheet = sheet.map(|order| Order::of_sheet(context, order, freedom, share));
    let layers = projection.layers();
    let layers = layers.map(|order| Order::of_layers(context, order, freedom, share));
    sheet.into_iter().chain(layers).collect()
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
            keep_offsets: kernel("keep_offsets", &[vertices, radius]),
            add_offsets: kernel("add_offsets", &[vertices, ("SHARE", share as f64)]),
            load_shown: kernel("load_shown", &[vertices]),
            stay_above: kernel("stay_above", &[vertices]),
            store_shown: kernel("store_shown", &[vertices]),
        }
    }
}
