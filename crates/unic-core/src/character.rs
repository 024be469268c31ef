//! Character and garment: the two assets that a model is made for.
//!
//! For tools that import and make characters; a model holds both.

use crate::{mesh::TriMesh, skeleton::Skeleton, skinning::SkinningWeights};

/// Skinned body.
#[derive(Clone, Debug, PartialEq)]
pub struct Character {
    /// Body in its bind pose.
    pub body: TriMesh,
    /// Tree of joints.
    pub skeleton: Skeleton,
    /// Skinning weights, one row for each body vertex.
    pub weights: SkinningWeights,
}

impl Character {
    /// Finds the joint that moves each face of the body most, by the sum of the weights of its
    /// corners. Of several the lowest index is taken.
    pub fn joints_of_faces(&self) -> Vec<usize> {
        let mut sums = vec![0.0f32; self.skeleton.len()];
        let mut heaviest = |face: &[u32; 3]| {
            sums.fill(0.0);
            let entries = face.iter().flat_map(|&v| self.weights.row(v as usize));
            entries.for_each(|(joint, weight)| sums[joint] += weight);
            // A strict comparison keeps the lowest index of equal sums.
            let larger = |best: usize, joint: usize| if sums[joint] > sums[best] { joint } else { best };
            (0..sums.len()).fold(0, larger)
        };
        self.body.faces.iter().map(&mut heaviest).collect()
    }
}

/// Garment in its rest shape, in the character's bind-pose space.
#[derive(Clone, Debug, PartialEq)]
pub struct Garment {
    /// Rest shape: defines the rest lengths, and may cut into the body.
    pub rest: TriMesh,
    /// Skinning weights over the character's joints, one row for each garment vertex.
    pub weights: SkinningWeights,
    /// Weight of the model's displacement at each vertex, in [0, 1]: at 0 the vertex is where
    /// skinning puts the rest shape. None means 1 everywhere.
    pub mask: Option<Vec<f32>>,
}

impl Garment {
    /// Makes a garment without a mask.
    pub fn new(rest: TriMesh, weights: SkinningWeights) -> Self {
        let mask = None;
        Self { rest, weights, mask }
    }

    /// Mask at one vertex; 1 without a mask.
    pub fn share(&self, vertex: usize) -> f32 {
        self.mask.as_ref().map_or(1.0, |mask| mask[vertex])
    }
}
