//! Skeleton, pose and forward kinematics.

mod error;
mod names;
mod pose;
mod tree;

pub use error::SkeletonError;
pub use names::{SMPL_JOINT_NAMES, SMPL_PARENTS};
pub use pose::{Pose, rotation};

use crate::transform::Rigid;
use glam::{Quat, Vec3};
use names::named;
use tree::{check_finite, check_length, checked_parents, single_root, topological_order};

/// Joint tree with its bind pose: the pose in which the body's vertices and the joints are given.
///
/// The bind pose need not be pose zero: a body may be modelled in an A-pose while zero local
/// rotations mean a T-pose. `rest_rotations` say which local rotations the bind pose has.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    names: Vec<String>,
    parents: Vec<Option<usize>>,
    joints: Vec<Vec3>,
    rest_pose: Vec<Vec3>,
    rest_from_joint: Vec<Quat>,
    root: usize,
    order: Vec<usize>,
}

/// Description of a skeleton as files hold it; see [`Skeleton::new`].
#[derive(Clone, Debug, Default)]
pub struct SkeletonParts {
    /// One a joint; empty takes the SMPL names for 24 joints, else `joint_0`, `joint_1`, ...
    pub names: Vec<String>,
    /// Index of the parent, -1 for the root.
    pub parents: Vec<i64>,
    /// Joint positions in the bind pose, metres, world space.
    pub joints: Vec<Vec3>,
    /// Local axis-angle rotations of the bind pose, radians; empty means zero.
    pub rest_pose: Vec<Vec3>,
}

impl Skeleton {
    /// Checks a description and prepares it for forward kinematics.
    ///
    /// # Errors
    /// Lengths that differ, indices out of range, no single root, cycles, numbers that are not finite.
    pub fn new(parts: SkeletonParts) -> Result<Self, SkeletonError> {
        let count = parts.joints.len();
        let names = named(parts.names, count);
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

    /// Never true: a skeleton has a root.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Index of the root joint.
    pub fn root(&self) -> usize {
        self.root
    }

    /// Joint names.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Index of a joint by its name.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Parent of each joint.
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

    /// The description that [`Skeleton::new`] takes.
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

    /// The bind pose itself, with the root where the bind pose has it.
    pub fn bind_pose(&self) -> Pose {
        Pose {
            trans: Vec3::ZERO,
            local: self.rest_pose.iter().map(|&a| rotation(a)).collect(),
        }
    }

    /// Forward kinematics: `world_from_joint` for every joint, into `out`.
    ///
    /// With G⁰ the global rotations of the bind pose and `joints` its positions:
    /// G_j = G_parent · R(aa_j), p_root = joints_root + trans and
    /// p_j = p_parent + G_parent · (G⁰_parent)ᵀ · (joints_j − joints_parent).
    ///
    /// # Panics
    /// When the pose has another number of joints; [`Pose`]s are checked where they enter.
    pub fn forward_kinematics(&self, pose: &Pose, out: &mut Vec<Rigid>) {
        assert_eq!(pose.local.len(), self.len(), "joints of the pose");
        out.resize(self.len(), Rigid::IDENTITY);
        for &j in &self.order {
            out[j] = match self.parents[j] {
                None => Rigid::new(pose.local[j], self.joints[j] + pose.trans),
                Some(p) => {
                    let offset = self.rest_from_joint[p].inverse() * (self.joints[j] - self.joints[p]);
                    out[p] * Rigid::new(pose.local[j], offset)
                }
            };
        }
    }

    /// `world_from_rest` for every joint: moves a point of the bind pose rigidly with the joint,
    /// v ↦ G_j (G⁰_j)ᵀ (v − joints_j) + p_j. These are what skinning weights blend.
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
