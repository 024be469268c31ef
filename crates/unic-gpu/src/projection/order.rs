//! Order of the cloth with itself on the device.

use super::{levels::Levels, sweep::Positions};
use crate::{
    GpuContext, GpuError,
    animator::{Buffers, OrderBuffers},
    kernel::{Dispatch, GROUP, Kernel, Source},
};
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use unic_core::projection::{
    Freedom, SMOOTHING_ROUNDS,
    order::{APART_GAPS, CELL, LEAST_COSINE, LayerOrder, MOST_MISSING_GAPS, OrderDistances, SheetOrder},
};
use wgpu::Buffer;

/// Factors of the three indices of a cell in its bucket: large primes (Teschner et al. 2003).
const BUCKET_FACTORS: [i32; 3] = [73_856_093, 19_349_663, 83_492_791];

/// Bytes of a `Found` of `order.wgsl`.
pub(crate) const FOUND_BYTES: usize = 48;

/// Order of one garment on the device. Asset.
#[derive(Debug)]
pub(crate) struct Order {
    kind: Kind,
    places: Buffer,
    vertices: usize,
    kernels: Kernels,
}

/// Direction of the order, with the lists that it is computed from.
#[derive(Debug)]
enum Kind {
    /// Along the smoothed shape.
    Sheet(Smoothing),
    /// Along the normals of layers. End of the faces around each vertex, and their other corners.
    Layers { ends: Buffer, corners: Buffer },
}

/// End of the neighbours of each sample of the smoothed shape, and the neighbours.
#[derive(Debug)]
struct Smoothing {
    ends: Buffer,
    neighbours: Buffer,
    samples: usize,
}

/// Place in the memory layout of `order.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Place {
    position: Vec4,
    compared: Vec4,
    /// Height, then nothing.
    height: [f32; 4],
}

/// Lengths of an order that its kernels are compiled with, metres.
#[derive(Clone, Copy)]
struct Lengths {
    gap: f32,
    distances: OrderDistances,
    /// Least difference of heights, and distance at rest; 0 along the smoothed shape.
    least_rise: f32,
    reach: f32,
}

/// Compiled kernels of `order.wgsl`, by their entry points.
#[derive(Debug)]
struct Kernels {
    gather_smoothed: Kernel,
    average: Kernel,
    keep_smoothed: Kernel,
    keep_layers: Kernel,
    fill_buckets: Kernel,
    push: Kernel,
    /// The same, scaled for a given garment.
    fading_push: Kernel,
}

/// Number of buckets of this number of vertices: a power of two.
pub(crate) fn buckets(vertices: usize) -> usize {
    vertices.next_power_of_two()
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
    /// Uploads the order of a garment along its smoothed shape; `share` is the place in an animator's
    /// vectors of the share of a given garment that is left.
    pub(super) fn of_sheet(
        context: &GpuContext,
        order: &SheetOrder,
        freedom: &Freedom,
        share: usize,
    ) -> Self {
        let places = (0..).zip(order.places()).map(|(vertex, place)| Place {
            position: Vec3::from(place.position).extend(f32::from(u8::from(place.is_first))),
            compared: Vec3::from(place.smoothed).extend(freedom.of(vertex)),
            height: [0.0; 4],
        });
        let shape = order.shape();
        let kind = Kind::Sheet(Smoothing {
            ends: context.upload("ends of neighbours", shape.ends()),
            neighbours: context.upload("neighbours of samples", shape.neighbours()),
            samples: shape.ends().len(),
        });
        let lengths = Lengths {
            gap: order.gap_m(),
            distances: order.distances(),
            least_rise: 0.0,
            reach: 0.0,
        };
        Self::new(context, kind, places.collect(), lengths, share)
    }

    /// Uploads the order of a garment's layers; `share` is the place in an animator's vectors of the share
    /// of a given garment that is left.
    pub(super) fn of_layers(
        context: &GpuContext,
        order: &LayerOrder,
        freedom: &Freedom,
        share: usize,
    ) -> Self {
        let places = (0..).zip(order.places()).map(|(vertex, place)| Place {
            position: Vec3::from(place.position).extend(place.side),
            compared: Vec3::from(place.outward).extend(freedom.of(vertex)),
            height: [place.height_m, 0.0, 0.0, 0.0],
        });
        let kind = Kind::Layers {
            ends: context.upload("ends of faces", order.ends()),
            corners: context.upload("corners of faces", order.corners()),
        };
        let lengths = Lengths {
            gap: order.gap_m(),
            distances: order.distances(),
            least_rise: order.least_rise_m(),
            reach: order.reach_m(),
        };
        Self::new(context, kind, places.collect(), lengths, share)
    }

    fn new(context: &GpuContext, kind: Kind, places: Vec<Place>, lengths: Lengths, share: usize) -> Self {
        Self {
            places: context.upload("places in order", &places),
            vertices: places.len(),
            kernels: Kernels::new(context, &kind, lengths, share),
            kind,
        }
    }

    /// The buffers of this order.
    fn buffers<'a>(&self, buffers: &'a Buffers) -> &'a OrderBuffers {
        match self.kind {
            Kind::Sheet { .. } => &buffers.sheet_order,
            Kind::Layers { .. } => &buffers.layer_order,
        }
    }

    /// Makes the dispatches that find the directions of the order at these positions, and sort the vertices
    /// into buckets. The smoothed shape is that of the coarse levels.
    pub(super) fn find(
        &self,
        buffers: &Buffers,
        levels: Option<&Levels>,
        positions: &Buffer,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let OrderBuffers { found, heads, before } = self.buffers(buffers);
        let (kernels, groups) = (&self.kernels, |count: usize| count.div_ceil(GROUP));
        let all = groups(buckets(self.vertices));
        let (places, found, heads, now) = ((1, &self.places), (2, found), (3, heads), (6, positions));
        let mut dispatches = Vec::new();
        match (&self.kind, levels) {
            (Kind::Layers { ends, corners }, _) => {
                let keep = [places, found, heads, now, (11, ends), (12, corners)];
                dispatches.push(kernels.keep_layers.dispatch(&keep, all)?);
            }
            (Kind::Sheet(smoothing), Some(levels)) => {
                let samples = smoothing.run(kernels, buffers, levels, positions, &mut dispatches)?;
                let keep = [found, heads, now, (9, samples), (13, levels.vertex_rows())];
                dispatches.push(kernels.keep_smoothed.dispatch(&keep, all)?);
            }
            // `orders` makes no such order.
            (Kind::Sheet(_), None) => return Ok(dispatches),
        }
        let fill = [places, found, heads, (5, before)];
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
        let OrderBuffers { found, heads, before } = self.buffers(buffers);
        let bindings = [
            (0, &buffers.vectors),
            (1, &self.places),
            (2, found),
            (4, heads),
            (5, before),
            (6, positions.now),
            (7, positions.other),
        ];
        let dispatch = kernel.dispatch(&bindings, self.vertices.div_ceil(GROUP))?;
        positions.swap();
        Ok(dispatch)
    }
}

impl Smoothing {
    /// Adds the dispatches that average the samples of the finest level, and returns where they are then.
    fn run<'a>(
        &self,
        kernels: &Kernels,
        buffers: &'a Buffers,
        levels: &Levels,
        positions: &Buffer,
        dispatches: &mut Vec<Dispatch>,
    ) -> Result<&'a Buffer, GpuError> {
        let [mut samples, mut averaged] = buffers.samples.each_ref();
        let groups = self.samples.div_ceil(GROUP);
        let gather = [(6, positions), (8, samples), (10, levels.sample_vertices())];
        dispatches.push(kernels.gather_smoothed.dispatch(&gather, groups)?);
        for _ in 0..SMOOTHING_ROUNDS {
            let (ends, neighbours) = ((11, &self.ends), (12, &self.neighbours));
            let bindings = [(8, samples), (9, averaged), ends, neighbours];
            dispatches.push(kernels.average.dispatch(&bindings, groups)?);
            (samples, averaged) = (averaged, samples);
        }
        Ok(samples)
    }
}

impl Kernels {
    fn new(context: &GpuContext, kind: &Kind, lengths: Lengths, share: usize) -> Self {
        let number = |value: f32| f64::from(value);
        let [x, y, z] = BUCKET_FACTORS.map(f64::from);
        let OrderDistances { near_m, kept_m } = lengths.distances;
        let cell = ("CELL_M", number(CELL * near_m));
        let of_layers = matches!(kind, Kind::Layers { .. });
        let push = |fades: f64| {
            [
                ("OF_LAYERS", f64::from(u8::from(of_layers))),
                ("GAP", number(lengths.gap)),
                ("MOST_MISSING", number(MOST_MISSING_GAPS)),
                ("NEAR", number(near_m)),
                ("KEPT", number(kept_m)),
                ("APART", number(APART_GAPS * lengths.gap)),
                ("LEAST_RISE", number(lengths.least_rise)),
                ("REACH", number(lengths.reach)),
                ("LEAST_COSINE", number(LEAST_COSINE)),
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
            keep_smoothed: kernel("keep_smoothed", &[cell]),
            keep_layers: kernel("keep_layers", &[cell]),
            fill_buckets: kernel("fill_buckets", &factors),
            push: kernel("push", &push(0.0)),
            fading_push: kernel("push", &push(1.0)),
        }
    }
}
