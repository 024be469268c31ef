//! Skeleton, pose and forward kinematics.
//!
//! For engines, which make a [`Pose`] a tick, and for tools that import characters.

mod error;
mod names;
mod pose;
mod tree;

pub use error::SkeletonError;
pub use names::{ADULT_JOINTS, SMPL_JOINT_NAMES, SMPL_PARENTS};
pub use pose::{Pose, rotation};

use crate::transform::Rigid;
use glam::{Quat, Vec3};
use names::names_or_default;
use tree::{check_finite, check_length, checked_parents, single_root, topological_order};

/// Tree of joints with its bind pose: the pose in which the body's vertices and the joints are
/// given.
///
/// The bind pose need not have zero rotations. A body may be modelled in an A-pose while zero local
/// rotations mean a T-pose; [`rest_pose`](Self::rest_pose) holds the local rotations of the bind
/// pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    names: Vec<String>,
    parents: Vec<Option<usize>>,
    joints: Vec<Vec3>,
    rest_pose: Vec<Vec3>,
    /// Global rotations of the bind pose.
    rest_from_joint: Vec<Quat>,
    root: usize,
    /// Joints in an order in which parents precede their children.
    order: Vec<usize>,
}

/// Description of a skeleton as files hold it; see [`Skeleton::new`].
#[derive(Clone, Debug, Default)]
pub struct SkeletonParts {
    /// Name of each joint. If empty, 24 joints get the SMPL names, others `joint_0`, `joint_1`, ...
    pub names: Vec<String>,
    /// Index of each joint's parent; -1 for the root.
    pub parents: Vec<i64>,
    /// Joint positions in the bind pose, metres, world space.
    pub joints: Vec<Vec3>,
    /// Local axis-angle rotations of the bind pose, radians. If empty, all are zero.
    pub rest_pose: Vec<Vec3>,
}

impl Skeleton {
    /// Checks a description and prepares it for forward kinematics.
    ///
    /// # Errors
    /// Fails on lengths that differ, indices out of range, no root or several, cycles, and numbers
    /// that are not finite.
    pub fn new(parts: SkeletonParts) -> Result<Self, SkeletonError> {
        let count = parts.joints.len();
        let names = names_or_default(parts.names, count);
        let rest_pose = if parts.rest_pose.is_empty() {
            vec![Vec3::ZERO; count]
        } else {
            parts.rest_pose
        };
        check_length("names", count, names.len())?;
        check_length("parents", count, parts.parents.len())?;
        check_length("rest rotations", count, rest_pose.len())?;
        check_finite("the position", &parts.joints)?;
        check_finite("the rest rotation", &rest_pose)?;
        let parents = checked_parents(&parts.parents)?;
        let root = single_root(&parents)?;
        let order = topological_order(&parents, root)?;
        let mut skeleton = Self {
            names,
            parents,
            joints: parts.joints,
            rest_from_joint: vec![Quat::IDENTITY; count],
            rest_pose,
            root,
            order,
        };
        let local: Vec<Quat> = skeleton.rest_pose.iter().map(|&a| rotation(a)).collect();
        skeleton.rest_from_joint = skeleton.accumulate(&local);
        Ok(skeleton)
    }

    /// Number of joints J, the root included.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Returns whether there are no joints; never true, because a skeleton has a root.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Index of the root joint.
    pub fn root(&self) -> usize {
        self.root
    }

    /// Name of each joint.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Finds the index of a joint by its name.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Parent of each joint; none for the root.
    pub fn parents(&self) -> &[Option<usize>] {
        &self.parents
    }

    /// Joint positions in the bind pose, metres.
    pub fn joints(&self) -> &[Vec3] {
        &self.joints
    }

    /// Local axis-angle rotations of the bind pose, radians.
    pub fn rest_pose(&self) -> &[Vec3] {
        &self.rest_pose
    }

    /// Returns a description from which [`Skeleton::new`] makes the same skeleton.
    pub fn to_parts(&self) -> SkeletonParts {
        SkeletonParts {
            names: self.names.clone(),
            parents: (self.parents.iter())
                .map(|p| p.map_or(-1, |p| p as i64))
                .collect(),
            joints: self.joints.clone(),
            rest_pose: self.rest_pose.clone(),
        }
    }

    /// Bind pose, with the root at its bind position.
    pub fn bind_pose(&self) -> Pose {
        Pose {
            trans: Vec3::ZERO,
            local: self.rest_pose.iter().map(|&a| rotation(a)).collect(),
        }
    }

    /// Computes forward kinematics: `world_from_joint` for every joint, into `out`.
    ///
    /// With G⁰ the global rotations of the bind pose and `joints` its positions:
    /// G_j = G_parent · R(aa_j), p_root = joints_root + trans and
    /// p_j = p_parent + G_parent · (G⁰_parent)ᵀ · (joints_j − joints_parent).
    ///
    /// # Panics
    /// When the number of joints of the pose is not the skeleton's. Callers check poses where they
    /// enter the program.
    pub fn forward_kinematics(&self, pose: &Pose, out: &mut Vec<Rigid>) {
        assert_eq!(pose.local.len(), self.len(), "joints of the pose");
        out.resize(self.len(), Rigid::IDENTITY);
        // `order` has parents first, whatever the order of the file.
        for &j in &self.order {
            out[j] = match self.parents[j] {
                None => Rigid::new(pose.local[j], self.joints[j] + pose.trans),
                Some(p) => {
                    // Bone from the parent, in the parent's own frame, where no pose changes it.
                    let offset = self.rest_from_joint[p].inverse() * (self.joints[j] - self.joints[p]);
                    out[p] * Rigid::new(pose.local[j], offset)
                }
            };
        }
    }

    /// Computes `world_from_rest` for every joint, into `out`: the transforms that skinning blends.
    ///
    /// Each moves a point v of the bind pose rigidly with the joint: G_j (G⁰_j)ᵀ (v − joints_j) +
    /// p_j.
    pub fn world_from_rest(&self, world_from_joint: &[Rigid], out: &mut Vec<Rigid>) {
        out.clear();
        out.extend((0..self.len()).map(|j| {
            let rotation = world_from_joint[j].rotation * self.rest_from_joint[j].inverse();
            Rigid::new(
                rotation,
                world_from_joint[j].translation - rotation * self.joints[j],
            )
        }));
    }

    /// Multiplies local rotations along the tree into global ones.
    fn accumulate(&self, local: &[Quat]) -> Vec<Quat> {
        let mut global = vec![Quat::IDENTITY; local.len()];
        for &j in &self.order {
            global[j] = self.parents[j].map_or(local[j], |p| global[p] * local[j]);
        }
        global
    }
}

#[cfg(test)]
mod tests;
