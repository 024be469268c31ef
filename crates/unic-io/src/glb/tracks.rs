//! Key frames of the skeleton.

use super::{
    binary::{Binary, Usage},
    json::{Channel, ChannelTarget, Index, Node, Property, Sampler},
};
use crate::error::Result;
use glam::{Quat, Vec3};
use unic_core::{
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};

/// What every frame says about the joints. Node j is joint j.
#[derive(Debug)]
pub(super) struct Tracks {
    skeleton: Skeleton,
    /// World position of the root, one a frame.
    root: Vec<Vec3>,
    /// Local rotations, by joint and frame.
    rotations: Vec<Vec<Quat>>,
}

/// Channels of an animation and what they sample.
#[derive(Default)]
pub(super) struct Curves {
    pub(super) channels: Vec<Channel>,
    pub(super) samplers: Vec<Sampler>,
}

impl Curves {
    /// Moves a property of a node from key to key.
    pub(super) fn add(&mut self, node: Index, path: Property, input: Index, output: Index) {
        self.channels.push(Channel {
            sampler: self.samplers.len(),
            target: ChannelTarget { node, path },
        });
        self.samplers.push(Sampler {
            input,
            output,
            interpolation: "LINEAR",
        });
    }
}

impl Tracks {
    pub(super) fn new(skeleton: &Skeleton) -> Self {
        Self {
            rotations: vec![Vec::new(); skeleton.len()],
            skeleton: skeleton.clone(),
            root: Vec::new(),
        }
    }

    /// Number of frames so far.
    pub(super) fn len(&self) -> usize {
        self.root.len()
    }

    /// Number of joints.
    pub(super) fn joint_count(&self) -> usize {
        self.skeleton.len()
    }

    pub(super) fn push(&mut self, pose: &Pose) {
        self.root
            .push(self.skeleton.joints()[self.skeleton.root()] + pose.trans);
        for (keys, rotation) in self.rotations.iter_mut().zip(&pose.local) {
            let rotation = rotation.normalize();
            // Of the two quaternions of a rotation the nearer one: readers that interpolate the four
            // numbers, Blender among them, would go the long way round to the other.
            let turned = keys.last().is_some_and(|last| last.dot(rotation) < 0.0);
            keys.push(if turned { -rotation } else { rotation });
        }
    }

    /// Root of the joints.
    pub(super) fn root_node(&self) -> Index {
        self.skeleton.root()
    }

    /// The joints in the first frame's pose, so that a still picture of the file is that frame.
    pub(super) fn nodes(&self) -> Vec<Node> {
        let mut bind_from_joint = Vec::new();
        self.skeleton
            .forward_kinematics(&self.skeleton.bind_pose(), &mut bind_from_joint);
        let mut nodes: Vec<Node> = (0..self.skeleton.len())
            .map(|j| self.node(j, &bind_from_joint))
            .collect();
        for (j, parent) in self.skeleton.parents().iter().enumerate() {
            if let Some(parent) = parent {
                nodes[*parent].children.push(j);
            }
        }
        nodes
    }

    fn node(&self, joint: usize, bind_from_joint: &[Rigid]) -> Node {
        let translation = match self.skeleton.parents()[joint] {
            None => self.root.first().copied().unwrap_or_default(),
            Some(parent) => (bind_from_joint[parent].inverse() * bind_from_joint[joint]).translation,
        };
        let rotation = self.rotations[joint].first().copied().unwrap_or_default();
        Node {
            name: self.skeleton.names()[joint].clone(),
            translation: Some(translation.to_array()),
            rotation: Some(rotation.to_array()),
            ..Default::default()
        }
    }

    /// Writes the keys; `times` is the accessor of their times.
    pub(super) fn write(&self, times: Index, binary: &mut Binary) -> Result<Curves> {
        let mut curves = Curves::default();
        let output = binary.write(Usage::Data, &self.root)?;
        curves.add(self.skeleton.root(), Property::Translation, times, output);
        for (joint, keys) in self.rotations.iter().enumerate() {
            let output = binary.write(Usage::Data, keys)?;
            curves.add(joint, Property::Rotation, times, output);
        }
        Ok(curves)
    }
}
