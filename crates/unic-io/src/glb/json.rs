//! The written part of glTF's JSON document, with the names of the specification.

use serde::Serialize;
use serde_json::Value;

/// Index into another list of the document.
pub(super) type Index = usize;

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Root {
    pub(super) asset: Value,
    pub(super) scene: Index,
    pub(super) scenes: Vec<Scene>,
    pub(super) nodes: Vec<Node>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) materials: Vec<Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) skins: Vec<Skin>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) animations: Vec<Animation>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    pub(super) buffers: Vec<Buffer>,
}

#[derive(Debug, Serialize)]
pub(super) struct Scene {
    pub(super) name: String,
    pub(super) nodes: Vec<Index>,
}

#[derive(Debug, Default, Serialize)]
pub(super) struct Node {
    pub(super) name: String,
    // The specification forbids empty arrays.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) children: Vec<Index>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) mesh: Option<Index>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) skin: Option<Index>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) translation: Option<[f32; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) rotation: Option<[f32; 4]>,
}

#[derive(Debug, Serialize)]
pub(super) struct Mesh {
    pub(super) name: String,
    // One primitive: body and garment have one material each.
    pub(super) primitives: [Primitive; 1],
    /// Names of the morph targets under `targetNames`, a convention that importers follow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) extras: Option<Value>,
}

#[derive(Debug, Serialize)]
pub(super) struct Primitive {
    pub(super) attributes: Attributes,
    pub(super) indices: Index,
    pub(super) material: Index,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) targets: Vec<MorphTarget>,
}

/// Accessors of vertex attributes by name: `POSITION`, `NORMAL`, `TEXCOORD_n`, `JOINTS_n`,
/// `WEIGHTS_n`.
pub(super) type Attributes = std::collections::BTreeMap<String, Index>;

/// Accessors of a morph target's displacements.
#[derive(Debug, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) struct MorphTarget {
    pub(super) position: Index,
    pub(super) normal: Index,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub(super) name: String,
    pub(super) inverse_bind_matrices: Index,
    pub(super) skeleton: Index,
    pub(super) joints: Vec<Index>,
}

#[derive(Debug, Serialize)]
pub(super) struct Animation {
    pub(super) name: String,
    pub(super) channels: Vec<AnimationChannel>,
    pub(super) samplers: Vec<Sampler>,
    pub(super) extras: Value,
}

#[derive(Debug, Serialize)]
pub(super) struct AnimationChannel {
    pub(super) sampler: Index,
    pub(super) target: ChannelTarget,
}

#[derive(Debug, Serialize)]
pub(super) struct ChannelTarget {
    pub(super) node: Index,
    pub(super) path: Property,
}

#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) enum Property {
    Translation,
    Rotation,
    Weights,
}

#[derive(Debug, Serialize)]
pub(super) struct Sampler {
    pub(super) input: Index,
    pub(super) output: Index,
    pub(super) interpolation: &'static str,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Index,
    // Zero is the specification's default.
    #[serde(skip_serializing_if = "is_zero")]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) shape: &'static str,
    /// Smallest value of each component. f64, because JSON readers parse to f64: printed from f32,
    /// a bound would not be bit-equal to one of the values.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) min: Vec<f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) max: Vec<f64>,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: Index,
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) byte_stride: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) target: Option<u32>,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) byte_length: u64,
}

fn is_zero(offset: &u64) -> bool {
    *offset == 0
}
