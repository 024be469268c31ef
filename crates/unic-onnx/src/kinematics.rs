//! Joint transforms of a pose, and skinning.

use crate::{
    graph::{Graph, Value},
    port::{REST, SKINNING_WEIGHTS},
};
use glam::{Quat, Vec3};
use unic_core::{skeleton::Skeleton, transform::Rigid};

/// World transforms of the joints.
#[derive(Clone, Copy)]
pub(crate) struct Joints {
    /// Positions (J, 3), metres.
    pub(crate) positions: Value,
    /// Rotations (J, 4).
    pub(crate) rotations: Value,
}

/// Skinned vertices.
#[derive(Clone, Copy)]
pub(crate) struct Skinned {
    /// Rest positions after linear blend skinning (V, 3), metres.
    pub(crate) positions: Value,
    /// Rotations of the vertices' frames (V, 4).
    pub(crate) rotations: Value,
}

impl Joints {
    /// Position of the root joint (1, 3).
    pub(crate) fn root_position(self, graph: &mut Graph, skeleton: &Skeleton) -> Value {
        graph.take(self.positions, &[skeleton.root() as i64], 0)
    }

    /// Rotation of the root joint (1, 4).
    pub(crate) fn root_rotation(self, graph: &mut Graph, skeleton: &Skeleton) -> Value {
        graph.take(self.rotations, &[skeleton.root() as i64], 0)
    }

    /// `yes` where a condition (1) is true, else `no`.
    pub(crate) fn choose(graph: &mut Graph, condition: Value, yes: Joints, no: Joints) -> Joints {
        Joints {
            positions: graph.choose(condition, yes.positions, no.positions),
            rotations: graph.choose(condition, yes.rotations, no.rotations),
        }
    }
}

/// Forward kinematics of a pose: `root` (3) and local `rotations` (J, 4).
///
/// Joints are not visited one after the other. Products along the tree are doubled in length until
/// they reach the root, which takes as many steps as the logarithm of its depth.
pub(crate) fn forward_kinematics(
    graph: &mut Graph,
    skeleton: &Skeleton,
    root: Value,
    rotations: Value,
) -> Joints {
    let joints = skeleton.len();
    let rotations = world_rotations(graph, skeleton, rotations);
    // Each bone from the parent, turned by the parent.
    let bind = bind_transforms(skeleton);
    let parent_of = |joint: usize| skeleton.parents()[joint].unwrap_or(joint);
    let bones: Vec<f32> = (0..joints)
        .flat_map(|j| {
            let parent = parent_of(j);
            let bone = skeleton.joints()[j] - skeleton.joints()[parent];
            (bind[parent].rotation.inverse() * bone).to_array()
        })
        .collect();
    let parents: Vec<i64> = (0..joints).map(|j| parent_of(j) as i64).collect();
    let matrices = graph.matrices(rotations);
    let matrices = graph.take(matrices, &parents, 0);
    let bones = graph.constant(&[joints, 3], &bones);
    let bones = graph.rotated(matrices, bones);
    // A joint is at the sum of the bones on its way to the root.
    let ways = graph.constant(&[joints, joints], &ways_to_root(skeleton));
    let offsets = graph.matmul(ways, bones);
    let rest = graph.constant(&[3], &skeleton.joints()[skeleton.root()].to_array());
    let root = graph.add(root, rest);
    Joints {
        positions: graph.add(offsets, root),
        rotations,
    }
}

/// World rotations (J, 4) of local ones.
fn world_rotations(graph: &mut Graph, skeleton: &Skeleton, local: Value) -> Value {
    // One more entry, the identity, stands for the parent of the root.
    let beyond = skeleton.len();
    let identity = graph.constant(&[1, 4], &Quat::IDENTITY.to_array());
    let padded = graph.concat(&[local, identity], 0);
    let mut products = graph.left_factors(padded);
    let parents = skeleton.parents().iter().map(|p| p.unwrap_or(beyond));
    let mut ancestors: Vec<usize> = parents.chain([beyond]).collect();
    while ancestors.iter().any(|&a| a != beyond) {
        let indices: Vec<i64> = ancestors.iter().map(|&a| a as i64).collect();
        let above = graph.take(products, &indices, 0);
        products = graph.matmul(above, products);
        ancestors = ancestors.iter().map(|&a| ancestors[a]).collect();
    }
    // The factors of q have q itself as their last column.
    let all = graph.take(products, &[3], 2);
    let all = graph.reshape(all, &[-1, 4]);
    graph.slice(all, 0, skeleton.len(), 0)
}

/// Matrix (J, J) with a 1 for each joint on the way from a joint to the root, both included.
fn ways_to_root(skeleton: &Skeleton) -> Vec<f32> {
    let joints = skeleton.len();
    let mut ways = vec![0.0; joints * joints];
    for (joint, row) in ways.chunks_exact_mut(joints).enumerate() {
        let mut at = Some(joint);
        while let Some(j) = at {
            row[j] = 1.0;
            at = skeleton.parents()[j];
        }
    }
    ways
}

/// World transforms of the joints in the bind pose.
fn bind_transforms(skeleton: &Skeleton) -> Vec<Rigid> {
    let mut transforms = Vec::new();
    skeleton.forward_kinematics(&skeleton.bind_pose(), &mut transforms);
    transforms
}

/// Linear blend skinning of the rest positions, and the blended rotations of the vertices.
pub(crate) fn skin(graph: &mut Graph, skeleton: &Skeleton, joints: Joints) -> Skinned {
    let (rest, weights) = (graph.input(REST), graph.input(SKINNING_WEIGHTS));
    let count = skeleton.len();
    // Transforms from the rest pose to the world.
    let bind = bind_transforms(skeleton);
    let inverse: Vec<f32> = bind
        .iter()
        .flat_map(|t| t.rotation.inverse().to_array())
        .collect();
    let inverse = graph.constant(&[count, 4], &inverse);
    let turns = graph.product(joints.rotations, inverse);
    let matrices = graph.matrices(turns);
    let rest_joints: Vec<f32> = skeleton.joints().iter().flat_map(Vec3::to_array).collect();
    let rest_joints = graph.constant(&[count, 3], &rest_joints);
    let turned = graph.rotated(matrices, rest_joints);
    let translations = graph.sub(joints.positions, turned);
    // The blend of transforms moves a point as the blend of its images.
    let transforms = graph.concat(&[matrices, translations], 1);
    let blended = graph.matmul(weights, transforms);
    let turn = graph.slice(blended, 0, 9, 1);
    let translation = graph.slice(blended, 9, 12, 1);
    let turned = graph.rotated(turn, rest);
    Skinned {
        positions: graph.add(turned, translation),
        rotations: blend_rotations(graph, weights, turns),
    }
}

/// Normalised blend (V, 4) of quaternions (J, 4) by weights (V, J). Each quaternion takes the sign
/// that brings it to the hemisphere of the heaviest joint's.
fn blend_rotations(graph: &mut Graph, weights: Value, turns: Value) -> Value {
    let heaviest = graph.largest(weights);
    let leading = graph.take_at(turns, heaviest, 0);
    let columns = graph.transpose(turns);
    let cosines = graph.matmul(leading, columns);
    let is_opposite = graph.is_below(cosines, 0.0);
    let negative = graph.map("Neg", weights);
    let signed = graph.choose(is_opposite, negative, weights);
    let sum = graph.matmul(signed, turns);
    let squared = graph.squared_lengths(sum);
    let length = graph.map("Sqrt", squared);
    graph.div(sum, length)
}
