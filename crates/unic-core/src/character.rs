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

impl Character {
    /// The joint that moves each face of the body most, by the sum of the weights of its corners; the lower
    /// of two.
    pub fn joints_of_faces(&self) -> Vec<usize> {
        let mut sums = vec![0.0f32; self.skeleton.len()];
        let mut most = |face: &[u32; 3]| {
            sums.fill(0.0);
            let entries = face.iter().flat_map(|&v| self.weights.row(v as usize));
            entries.for_each(|(joint, weight)| sums[joint] += weight);
            let larger = |best: usize, joint: usize| if sums[joint] > sums[best] { joint } else { best };
            (0..sums.len()).fold(0, larger)
        };
        self.body.faces.iter().map(&mut most).collect()
    }
}

/// A garment in its rest shape, in the character's bind-pose space.
#[derive(Clone, Debug, PartialEq)]
pub struct Garment {
    /// The rest shape: defines rest lengths, may cut into the body.
    pub rest: TriMesh,
    /// One row a garment vertex, over the character's joints.
    pub weights: SkinningWeights,
    /// How far each vertex is the model's, in [0, 1]: 0 leaves it where skinning puts the rest shape,
    /// values between blend. None is 1 everywhere.
    pub mask: Option<Vec<f32>>,
}

impl Garment {
    /// A garment that is the model's everywhere.
    pub fn new(rest: TriMesh, weights: SkinningWeights) -> Self {
        let mask = None;
        Self { rest, weights, mask }
    }

    /// The mask at one vertex.
    pub fn share(&self, vertex: usize) -> f32 {
        self.mask.as_ref().map_or(1.0, |mask| mask[vertex])
    }
}
