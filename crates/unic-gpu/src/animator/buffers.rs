//! State and scratch of an animator on the device.

use crate::{
    GpuModel,
    mesh::SHOWN_BYTES,
    projection::{BEND_BYTES, FOUND_BYTES, Projection, SAMPLE_START_BYTES, buckets},
};
use glam::{Vec3, Vec4};
use unic_core::projection::StrainProjection;
use wgpu::{Buffer, BufferUsages};

/// Size of a `Point` of `vertex_state.wgsl`, bytes.
const POINT_BYTES: usize = 48;
/// Size of a `VertexState` of `vertex_state.wgsl`, bytes.
pub(super) const STATE_BYTES: usize = 32;
/// Size of a position in scratch memory, bytes: four f32, of which kernels use three.
const POSITION_BYTES: usize = 16;

/// State and scratch of one animator on the device.
#[derive(Debug)]
pub(crate) struct Buffers {
    /// Pose and settings of the tick.
    pub(crate) tick: Buffer,
    /// Recurrence's state, and the vectors of one frame.
    pub(crate) vectors: Buffer,
    /// Skinned position, frame and prior of every vertex.
    pub(crate) points: Buffer,
    /// State of every vertex, with its mask in the fourth coordinate.
    pub(crate) states: Buffer,
    /// Offset of the strain projection of every vertex; empty without a projection.
    pub(crate) offsets: Buffer,
    /// Predicted positions of the strain projection, see `projection.wgsl`.
    pub(crate) predicted: Buffer,
    /// Projected positions. Sweeps go back and forth between the two.
    pub(crate) projected: [Buffer; 2],
    /// Sums of the bending stencils at the positions from which they smooth, see `sweep.wgsl`: those of
    /// the samples at the start of each level, the predicted ones, then the shown ones before
    /// intersection handling.
    pub(crate) bends: Buffer,
    /// Positions of the samples of the strain projection's coarse levels, as of all vertices.
    pub(crate) samples: [Buffer; 2],
    /// Where the samples started, see `levels.wgsl`.
    pub(crate) sample_starts: Buffer,
    /// Pushes into the order along the smoothed shape.
    pub(crate) sheet_order: OrderBuffers,
    /// Pushes into the order of the layers.
    pub(crate) layer_order: OrderBuffers,
    /// Inputs of the field for every vertex.
    pub(crate) inputs: Buffer,
    /// Shown positions and normals.
    pub(crate) shown: Buffer,
}

/// Buffers of the pushes into an order of the cloth, see `order.wgsl`; empty without one.
#[derive(Debug)]
pub(crate) struct OrderBuffers {
    /// Where the vertices were before the pushes.
    pub(crate) found: Buffer,
    /// Last vertex in each bucket of cells.
    pub(crate) heads: Buffer,
    /// For each vertex the one before it in its bucket.
    pub(crate) before: Buffer,
}

impl Buffers {
    pub(super) fn new(asset: &GpuModel) -> Self {
        let (context, model) = (&asset.context, &asset.model);
        let vertices = model.vertex_count();
        let joints = model.character().skeleton.len();
        let inputs = model.field().point_inputs() * asset.field.shape.stride(vertices);
        let zeroed = |label, bytes| context.zeroed(label, bytes, BufferUsages::empty());
        let pair = |label, bytes| [(); 2].map(|()| zeroed(label, bytes));
        let bends = asset.projection.as_ref().map_or(0, Projection::bends);
        let projected = model.projection().map_or(0, |_| vertices);
        let levels = model.projection().and_then(StrainProjection::levels);
        let samples = levels.map_or(0, |levels| levels.samples().len());
        let orders = |has_order: bool| {
            let (ordered, buckets) = if has_order {
                (vertices, buckets(vertices))
            } else {
                (0, 0)
            };
            OrderBuffers {
                found: zeroed("found", FOUND_BYTES * ordered),
                heads: zeroed("heads", 4 * buckets),
                before: zeroed("before", 4 * ordered),
            }
        };
        let (sheet, layers) = (
            model.projection().and_then(StrainProjection::order),
            model.projection().and_then(StrainProjection::layers),
        );
        let states = zeroed("states", STATE_BYTES * vertices);
        // Kernels keep the mask, so that it is uploaded once.
        let share = |vertex: usize| [Vec3::ZERO.extend(model.garment().share(vertex)); 2];
        let shares: Vec<[Vec4; 2]> = (0..vertices).map(share).collect();
        let queue = context.queue();
        queue.write_buffer(&states, 0, bytemuck::cast_slice(&shares));
        Self {
            // Three vectors of four before the joints, and two for each joint, see
            // `vertex_state.wgsl`.
            tick: zeroed("tick", 16 * (3 + 2 * joints)),
            vectors: asset.networks.vectors(context),
            points: zeroed("points", POINT_BYTES * vertices),
            states,
            offsets: zeroed("offsets", STATE_BYTES * projected),
            predicted: zeroed("predicted", POSITION_BYTES * projected),
            projected: pair("projected", POSITION_BYTES * projected),
            bends: zeroed("bends", BEND_BYTES * bends),
            samples: pair("samples", POSITION_BYTES * samples),
            sample_starts: zeroed("sample starts", SAMPLE_START_BYTES * samples),
            sheet_order: orders(sheet.is_some()),
            layer_order: orders(layers.is_some()),
            inputs: zeroed("inputs", 4 * inputs),
            shown: context.zeroed("garment", SHOWN_BYTES * vertices, BufferUsages::VERTEX),
        }
    }
}
