//! State and scratch of an animator on the device.

use crate::{GpuModel, mesh::SHOWN_BYTES};
use wgpu::{Buffer, BufferUsages};

/// Of a vertex's `Point` and `VertexState`, see `places.wgsl`.
const POINT_BYTES: usize = 64;
pub(super) const STATE_BYTES: usize = 32;

/// State and scratch on the device.
#[derive(Debug)]
pub(crate) struct Buffers {
    /// Pose and settings of the tick.
    pub(crate) tick: Buffer,
    /// The recurrence's memory, which is state, and the vectors of one frame.
    pub(crate) vectors: Buffer,
    /// Where the skeleton and the prior put every vertex.
    pub(crate) points: Buffer,
    /// State of every vertex.
    pub(crate) states: Buffer,
    /// What the field reads of every vertex.
    pub(crate) inputs: Buffer,
    /// Positions and normals.
    pub(crate) shown: Buffer,
}

impl Buffers {
    pub(super) fn new(asset: &GpuModel) -> Self {
        let (context, model) = (&asset.context, &asset.model);
        let vertices = model.vertex_count();
        let joints = model.character().skeleton.len();
        let inputs = model.field().point_inputs() * asset.field.shape.stride(vertices);
        let zeroed = |label, bytes| context.zeroed(label, bytes, BufferUsages::empty());
        Self {
            tick: zeroed("tick", 16 * (3 + 2 * joints)),
            vectors: asset.networks.vectors(context),
            points: zeroed("points", POINT_BYTES * vertices),
            states: zeroed("states", STATE_BYTES * vertices),
            inputs: zeroed("inputs", 4 * inputs),
            shown: context.zeroed("garment", SHOWN_BYTES * vertices, BufferUsages::VERTEX),
        }
    }
}
