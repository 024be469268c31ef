//! Collecting and writing the key frames of the skeleton.

use super::{
    binary::{BinaryWriter, BufferUsage},
    json::{AnimationChannel, ChannelTarget, Index, Node, Property, Sampler},
};
use crate::error::Result;
use glam::{Quat, Vec3};
use unic_core::{Pose, skeleton::Skeleton, transform::Rigid};

/// Key frames of all joints. Node j of the file is joint j.
#[derive(Debug)]
pub(super) struct JointTracks {
    skeleton: Skeleton,
    /// World position of the root joint in each frame, metres.
    root: Vec<Vec3>,
    /// Local rotations of each joint in each frame.
    rotations: Vec<Vec<Quat>>,
}

/// Channels of an animation, and the samplers that they read.
#[derive(Default)]
pub(super) struct Curves {
    pub(super) channels: Vec<AnimationChannel>,
    pub(super) samplers: Vec<Sampler>,
}

impl Curves {
    /// Adds a linearly interpolated curve of a node's property: `input` is the accessor of the
    /// times, `output` that of the values.
    pub(super) fn add(&mut self, node: Index, path: Property, input: Index, output: Index) {
        self.channels.push(AnimationChannel {
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

impl JointTracks {
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

    /// Adds the pose of the next frame.
    pub(super) fn push(&mut self, pose: &Pose) {
        self.root
            .push(self.skeleton.joints()[self.skeleton.root()] + pose.trans);
        for (keys, rotation) in self.rotations.iter_mut().zip(&pose.local) {
            let rotation = rotation.normalize();
            // A rotation has two quaternions, q and −q. The one nearer to the previous key is
            // taken: readers that interpolate the four numbers, such as Blender, would otherwise
            // rotate the long way round.
            let is_opposite = keys.last().is_some_and(|last| last.dot(rotation) < 0.0);
            keys.push(if is_opposite { -rotation } else { rotation });
        }
    }

    /// Node of the root joint.
    pub(super) fn root_node(&self) -> Index {
        self.skeleton.root()
    }

    /// Returns the nodes of the joints in the pose of the first frame, which readers without
    /// animation show.
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
        // Only the root is animated in translation; the other joints keep their bind offsets.
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

    /// Writes all keys; `times` is the accessor of their times.
    pub(super) fn write(&self, times: Index, binary: &mut BinaryWriter) -> Result<Curves> {
        let mut curves = Curves::default();
        let output = binary.write(BufferUsage::Data, &self.root)?;
        curves.add(self.skeleton.root(), Property::Translation, times, output);
        for (joint, keys) in self.rotations.iter().enumerate() {
            let output = binary.write(BufferUsage::Data, keys)?;
            curves.add(joint, Property::Rotation, times, output);
        }
        Ok(curves)
    }
}
