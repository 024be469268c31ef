//! Order of the cloth along its smoothed shape on the device.

use super::{levels::Levels, sweep::Positions};
use crate::{
    GpuContext, GpuError,
    animator::Buffers,
    kernel::{Dispatch, GROUP, Kernel, Source},
};
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use unic_core::projection::{
    SMOOTHING_ROUNDS, StrainProjection,
    order::{APART_GAPS, CELL, KEPT_GAPS, MOST_MISSING_GAPS, NEAR_GAPS, OrderPlace, SheetOrder},
};
use wgpu::Buffer;

/// Factors of the three indices of a cell in its bucket: large primes (Teschner et al. 2003).
const BUCKET_FACTORS: [i32; 3] = [73_856_093, 19_349_663, 83_492_791];

/// Bytes of a `Found` of `order.wgsl`.
pub(crate) const FOUND_BYTES: usize = 48;

/// Order of one garment on the device. Asset.
#[derive(Debug)]
pub(crate) struct Order {
    buckets: usize,
    places: Buffer,
    /// End of the neighbours of each sample, and the neighbours.
    ends: Buffer,
    neighbours: Buffer,
    samples: usize,
    vertices: usize,
    kernels: Kernels,
}

/// Place in the memory layout of `order.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Place {
    position: Vec4,
    smoothed: Vec4,
}

/// Compiled kernels of `order.wgsl`, by their entry points.
#[derive(Debug)]
struct Kernels {
    gather_smoothed: Kernel,
    average: Kernel,
    keep_found: Kernel,
    fill_buckets: Kernel,
    push: Kernel,
    /// The same, scaled for a given garment.
    fading_push: Kernel,
}

/// Number of buckets of the vertices of an order: a power of two.
pub(crate) fn buckets(order: &SheetOrder) -> usize {
    order.places().len().next_power_of_two()
}

/// Size of pushes for a garment that was given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pushes {
    /// The whole size. Pushes within the projection become part of the offsets, which fade in.
    Whole,
    /// They fade in. Pushes after intersection handling would move the given garment.
    Fading,
}

impl Order {
    /// Uploads the order of a garment; `share` is the place in an animator's vectors of the share of a
    /// given garment that is left.
    pub(super) fn new(
        context: &GpuContext,
        projection: &StrainProjection,
        order: &SheetOrder,
        share: usize,
    ) -> Self {
        let place = |(vertex, place): (u32, &OrderPlace)| Place {
            position: Vec3::from(place.position).extend(f32::from(u8::from(place.is_first))),
            smoothed: Vec3::from(place.smoothed).extend(projection.freedom().of(vertex)),
        };
        let places: Vec<Place> = (0..).zip(order.places()).map(place).collect();
        let shape = order.shape();
        Self {
            buckets: buckets(order),
            places: context.upload("places in order", &places),
            ends: context.upload("ends of neighbours", shape.ends()),
            neighbours: context.upload("neighbours of samples", shape.neighbours()),
            samples: shape.ends().len(),
            vertices: places.len(),
            kernels: Kernels::new(context, order, share),
        }
    }

    /// Makes the dispatches that find the smoothed shape of the positions, and sort these into buckets.
    pub(super) fn find(
        &self,
        buffers: &Buffers,
        levels: &Levels,
        positions: &Buffer,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let kernels = &self.kernels;
        let groups = |count: usize| count.div_ceil(GROUP);
        let [mut samples, mut averaged] = buffers.samples.each_ref();
        let gather = [(6, positions), (8, samples), (10, levels.sample_vertices())];
        let mut dispatches = vec![kernels.gather_smoothed.dispatch(&gather, groups(self.samples))?];
        for _ in 0..SMOOTHING_ROUNDS {
            let bindings = [
                (8, samples),
                (9, averaged),
                (11, &self.ends),
                (12, &self.neighbours),
            ];
            dispatches.push(kernels.average.dispatch(&bindings, groups(self.samples))?);
            (samples, averaged) = (averaged, samples);
        }
        let (found, heads) = ((2, &buffers.found), (3, &buffers.heads));
        let keep = [
            found,
            heads,
            (6, positions),
            (9, samples),
            (13, levels.vertex_rows()),
        ];
        let all = groups(self.buckets.max(self.vertices));
        dispatches.push(kernels.keep_found.dispatch(&keep, all)?);
        let fill = [(1, &self.places), found, heads, (5, &buffers.before)];
        dispatches.push(kernels.fill_buckets.dispatch(&fill, groups(self.vertices))?);
        Ok(dispatches)
    }

    /// Makes the dispatch that pushes the found pairs into their order.
    pub(super) fn push(
        &self,
        buffers: &Buffers,
        positions: &mut Positions,
        pushes: Pushes,
    ) -> Result<Dispatch, GpuError> {
        let kernel = match pushes {
            Pushes::Whole => &self.kernels.push,
            Pushes::Fading => &self.kernels.fading_push,
        };
        let bindings = [
            (0, &buffers.vectors),
            (1, &self.places),
            (2, &buffers.found),
            (4, &buffers.heads),
            (5, &buffers.before),
            (6, positions.now),
            (7, positions.other),
        ];
        let dispatch = kernel.dispatch(&bindings, self.vertices.div_ceil(GROUP))?;
        positions.swap();
        Ok(dispatch)
    }
}

impl Kernels {
    fn new(context: &GpuContext, order: &SheetOrder, share: usize) -> Self {
        let number = |value: f32| f64::from(value);
        let [x, y, z] = BUCKET_FACTORS.map(f64::from);
        let cell = ("CELL_M", number(CELL * NEAR_GAPS * order.gap_m()));
        let push = |fades: f64| {
            [
                ("GAP", number(order.gap_m())),
                ("NEAR", number(NEAR_GAPS)),
                ("APART", number(APART_GAPS)),
                ("KEPT", number(KEPT_GAPS)),
                ("MOST_MISSING", number(MOST_MISSING_GAPS)),
                ("FACTOR_X", x),
                ("FACTOR_Y", y),
                ("FACTOR_Z", z),
                ("SHARE", share as f64),
                ("FADES", fades),
            ]
        };
        let kernel = |entry: &str, constants: &[(&str, f64)]| {
            let source = Source {
                text: include_str!("../kernels/order.wgsl"),
                entry,
                constants,
            };
            Kernel::new(context, &source)
        };
        let factors = [("FACTOR_X", x), ("FACTOR_Y", y), ("FACTOR_Z", z)];
        Self {
            gather_smoothed: kernel("gather_smoothed", &[]),
            average: kernel("average", &[]),
            keep_found: kernel("keep_found", &[cell]),
            fill_buckets: kernel("fill_buckets", &factors),
            push: kernel("push", &push(0.0)),
            fading_push: kernel("push", &push(1.0)),
        }
    }
}
