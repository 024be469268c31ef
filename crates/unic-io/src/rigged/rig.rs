//! Rigs: joints in the bind pose, and their motion relative to it.

use super::{
    file::SceneFile,
    joint_nodes::JointNodes,
    rest_space::{check_scale, rest_from_space, rotation_of},
};
use crate::error::{Error, Result};
use glam::{Mat3, Mat4, Vec3};
use std::collections::{HashMap, HashSet};
use unic_core::{
    skeleton::{Skeleton, SkeletonParts},
    transform::Rigid,
};
use unic_scene::{Local, Motion, Skin};

/// Distance from the bind pose up to which the nodes of a file stand in it, metres.
pub(super) const SAME_PLACE_M: f32 = 1e-3;

/// Joints of a file in its bind pose, in world space: metres, Y up.
pub(super) struct Rig {
    pub(super) joints: Vec<RigJoint>,
    /// Descriptions of what was converted, one sentence each.
    pub(super) notes: Vec<String>,
}

/// A joint of a [`Rig`].
pub(super) struct RigJoint {
    node: usize,
    pub(super) name: String,
    /// Index of the parent among the joints; none for the root.
    pub(super) parent: Option<usize>,
    /// Position in the bind pose, metres, world space.
    pub(super) position: Vec3,
    /// `joint_from_rest`: the inverse of the joint's transform in the bind pose.
    joint_from_rest: Mat4,
}

/// Nodes that are joints, with `joint_from_space` at bind time in a space that all share.
pub(super) struct Binds {
    nodes: Vec<usize>,
    inverse: Vec<Mat4>,
    /// `world_from_space`, where the file states it.
    world_from_space: Option<Mat4>,
}

impl RigJoint {
    /// Makes a joint; None if its matrix has no inverse.
    fn new(node: usize, name: String, parent: Option<usize>, joint_from_rest: Mat4) -> Option<Self> {
        let rest_from_joint = joint_from_rest.inverse();
        (rest_from_joint.is_finite() && joint_from_rest.is_finite()).then(|| Self {
            node,
            name,
            parent,
            position: rest_from_joint.w_axis.truncate(),
            joint_from_rest,
        })
    }
}

impl Rig {
    /// Makes the joints of a file for its motion: those of the skin with most joints, else all
    /// animated nodes in the pose outside the animation.
    ///
    /// # Errors
    /// Those of [`Rig::new`].
    pub(super) fn of_motion(file: &SceneFile, motion: &Motion) -> Result<Self> {
        // Hats and eyes have skins of a few joints. Of skins with equally many the first is taken.
        let skins = file.scene.skins.iter().rev();
        let binds = match skins.max_by_key(|skin| skin.joints.len()) {
            Some(skin) => Binds::of_skin(skin),
            None => Binds::of_pose(file, motion),
        };
        // No joint is left out: the character may have each of them.
        let moving = binds.nodes.iter().copied().collect();
        Ok(Self::new(file, binds, &moving)?.0)
    }

    /// Makes the rig, and the transform from the space of the binds to the rest space.
    ///
    /// # Errors
    /// Several roots without a node above them, scales that differ by axis, a mirrored body,
    /// matrices without an inverse.
    pub(super) fn new(file: &SceneFile, binds: Binds, moving: &HashSet<usize>) -> Result<(Self, Mat4)> {
        let mut world = Vec::new();
        file.world(&file.locals(), &mut world);
        let joints = JointNodes::new(file, &binds.nodes, moving)?;
        let inverse: HashMap<usize, Mat4> = binds.nodes.iter().copied().zip(binds.inverse).collect();
        let rest_from_space = match binds.world_from_space {
            Some(stated) => stated,
            None => rest_from_space(file, &world, &joints, &inverse),
        };
        check_scale(file, rest_from_space)?;
        let space_from_rest = rest_from_space.inverse();
        let mut rig = Self {
            joints: Vec::new(),
            notes: joints.notes,
        };
        let mut farthest = (0.0, String::new());
        for (node, parent) in joints.nodes.iter().zip(joints.parents) {
            let joint_from_rest = match inverse.get(node) {
                Some(inverse) => *inverse * space_from_rest,
                // A node above the joints stands where the file has it.
                None => world[*node].inverse(),
            };
            let name = file.name(*node).to_owned();
            let Some(joint) = RigJoint::new(*node, name, parent, joint_from_rest) else {
                let found = format!("another at {}", file.name(*node));
                return Err(file.error("bind matrices that can be inverted", found));
            };
            let off = joint.position.distance(world[*node].w_axis.truncate());
            if off > farthest.0 {
                farthest = (off, joint.name.clone());
            }
            rig.joints.push(joint);
        }
        if farthest.0 > SAME_PLACE_M {
            rig.notes.push(format!(
                "the nodes do not stand in the bind pose, {} by {:.0} mm: the bind pose is the rest pose",
                farthest.1,
                1e3 * farthest.0
            ));
        }
        Ok((rig, rest_from_space))
    }

    /// Index among the joints for each node that is one.
    pub(super) fn places(&self) -> HashMap<usize, usize> {
        let nodes = self.joints.iter().enumerate();
        nodes.map(|(index, joint)| (joint.node, index)).collect()
    }

    /// Makes the skeleton, whose joints have the axes of the world in the bind pose: its zero pose.
    pub(super) fn skeleton(&self, file: &SceneFile) -> Result<Skeleton> {
        let parent = |joint: &RigJoint| joint.parent.map_or(-1, |parent| parent as i64);
        let parts = SkeletonParts {
            names: self.joints.iter().map(|joint| joint.name.clone()).collect(),
            parents: self.joints.iter().map(parent).collect(),
            joints: self.joints.iter().map(|joint| joint.position).collect(),
            rest_pose: Vec::new(),
        };
        Skeleton::new(parts).map_err(|source| Error::Skeleton {
            path: file.path.clone(),
            source,
        })
    }

    /// Writes the pose of a frame into `out`: for each joint the rotation from the bind pose, and the
    /// position in metres, world space.
    pub(super) fn frame(
        &self,
        file: &SceneFile,
        motion: &Motion,
        frame: usize,
        scratch: &mut RigScratch,
        out: &mut Vec<Rigid>,
    ) {
        scratch.locals.clear();
        scratch
            .locals
            .extend(file.scene.nodes.iter().map(|node| node.local));
        for track in &motion.tracks {
            scratch.locals[track.node] = track.locals[frame];
        }
        file.world(&scratch.locals, &mut scratch.world);
        out.clear();
        out.extend(self.joints.iter().map(|joint| {
            let world_from_rest = scratch.world[joint.node] * joint.joint_from_rest;
            let linear = Mat3::from_mat4(world_from_rest);
            Rigid::new(
                rotation_of(linear),
                world_from_rest.transform_point3(joint.position),
            )
        }));
    }
}

/// Transforms of all nodes at one time, kept between frames.
#[derive(Default)]
pub(super) struct RigScratch {
    locals: Vec<Local>,
    world: Vec<Mat4>,
}

impl Binds {
    pub(super) fn of_skin(skin: &Skin) -> Self {
        Self {
            nodes: skin.joints.clone(),
            inverse: skin.inverse_binds.clone(),
            world_from_space: skin.world_from_mesh,
        }
    }

    /// Animated nodes in the pose outside the animation.
    fn of_pose(file: &SceneFile, motion: &Motion) -> Self {
        let mut nodes: Vec<usize> = motion.tracks.iter().map(|track| track.node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let mut world = Vec::new();
        file.world(&file.locals(), &mut world);
        Self {
            inverse: nodes.iter().map(|node| world[*node].inverse()).collect(),
            nodes,
            world_from_space: None,
        }
    }
}
