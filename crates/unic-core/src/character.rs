//! The two assets that a model is made for: a character and one garment.

use crate::{mesh::TriMesh, skeleton::Skeleton, skinning::SkinningWeights};

/// A skinned body.
#[derive(Clone, Debug, PartialEq)]
pub struct Character {
    /// The body in its bind pose.
    pub body: TriMesh,
    /// The joint tree.
    pub skeleton: Skeleton,
    /// One row a body vertex.
    pub weights: SkinningWeights,
}

/// A garment in its rest shape, in the character's bind-pose space.
#[derive(Clone, Debug, PartialEq)]
pub struct Garment {
    /// The rest shape: defines rest lengths, may cut into the body.
    pub rest: TriMesh,
    /// One row a garment vertex, over the character's joints.
    pub weights: SkinningWeights,
}
