//! Skeleton, pose and forward kinematics.

use crate::transform::Rigid;
use glam::{Quat, Vec3};
use thiserror::Error;

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

/// What is wrong with a skeleton's description.
#[derive(Debug, Error, PartialEq)]
pub enum SkeletonError {
    /// Arrays that should have one entry a joint differ in length.
    #[error("skeleton: expected {expected} {what} (one a joint), found {found}")]
    Length {
        /// Which array.
        what: &'static str,
        /// Number of joints.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// No root, or more than one.
    #[error("skeleton: expected one root joint (parent -1), found {found}")]
    Roots {
        /// Joints without a parent.
        found: usize,
    },
    /// A parent index outside the skeleton.
    #[error("skeleton: parent {parent} of joint {joint} is not among the {joints} joints")]
    Parent {
        /// Joint whose parent is wrong.
        joint: usize,
        /// The index found.
        parent: i64,
        /// Number of joints.
        joints: usize,
    },
    /// Joints that no path connects to the root.
    #[error("skeleton: joint {joint} is on a cycle of parents")]
    Cycle {
        /// One joint on it.
        joint: usize,
    },
    /// NaN or infinity.
    #[error("skeleton: {what} of joint {joint} is not finite")]
    NotFinite {
        /// Which array.
        what: &'static str,
        /// The joint.
        joint: usize,
    },
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

/// Joint names in SMPL's order.
pub const SMPL_JOINT_NAMES: [&str; 24] = [
    "pelvis",
    "L_hip",
    "R_hip",
    "spine1",
    "L_knee",
    "R_knee",
    "spine2",
    "L_ankle",
    "R_ankle",
    "spine3",
    "L_foot",
    "R_foot",
    "neck",
    "L_collar",
    "R_collar",
    "head",
    "L_shoulder",
    "R_shoulder",
    "L_elbow",
    "R_elbow",
    "L_wrist",
    "R_wrist",
    "L_hand",
    "R_hand",
];

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

/// Pose of a skeleton: local rotations and the root's translation.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// World position of the root minus its bind position, metres (SMPL's translation).
    pub trans: Vec3,
    /// Rotation of each joint relative to its parent (the root's: to the world).
    pub local: Vec<Quat>,
}

impl Pose {
    /// From axis-angle rotations in radians, one a joint.
    pub fn from_axis_angles(trans: Vec3, axis_angles: &[Vec3]) -> Self {
        Self {
            trans,
            local: axis_angles.iter().map(|&a| rotation(a)).collect(),
        }
    }

    /// Between two poses of one skeleton: spherical for the rotations, linear for the root;
    /// `t` in 0..=1.
    pub fn interpolate(&self, other: &Pose, t: f32) -> Pose {
        Pose {
            trans: self.trans.lerp(other.trans, t),
            local: (self.local.iter().zip(&other.local))
                .map(|(a, b)| a.slerp(*b, t))
                .collect(),
        }
    }

    /// No NaN, no infinity, unit rotations.
    pub fn is_valid(&self) -> bool {
        self.trans.is_finite() && self.local.iter().all(|q| q.is_finite() && q.is_normalized())
    }
}

/// The rotation of an axis-angle vector: its direction is the axis, its length the angle in radians.
pub fn rotation(axis_angle: Vec3) -> Quat {
    Quat::from_scaled_axis(axis_angle)
}

fn named(names: Vec<String>, count: usize) -> Vec<String> {
    if !names.is_empty() {
        return names;
    }
    if count == SMPL_JOINT_NAMES.len() {
        return SMPL_JOINT_NAMES.map(String::from).to_vec();
    }
    (0..count).map(|j| format!("joint_{j}")).collect()
}

fn check_length(what: &'static str, expected: usize, found: usize) -> Result<(), SkeletonError> {
    if expected == found {
        return Ok(());
    }
    Err(SkeletonError::Length {
        what,
        expected,
        found,
    })
}

fn check_finite(what: &'static str, values: &[Vec3]) -> Result<(), SkeletonError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(joint) => Err(SkeletonError::NotFinite { what, joint }),
    }
}

fn checked_parents(parents: &[i64]) -> Result<Vec<Option<usize>>, SkeletonError> {
    let joints = parents.len();
    (parents.iter().enumerate())
        .map(|(joint, &parent)| match usize::try_from(parent) {
            Ok(p) if p < joints => Ok(Some(p)),
            Err(_) if parent == -1 => Ok(None),
            _ => Err(SkeletonError::Parent {
                joint,
                parent,
                joints,
            }),
        })
        .collect()
}

fn single_root(parents: &[Option<usize>]) -> Result<usize, SkeletonError> {
    let found = parents.iter().filter(|p| p.is_none()).count();
    match parents.iter().position(Option::is_none) {
        Some(root) if found == 1 => Ok(root),
        _ => Err(SkeletonError::Roots { found }),
    }
}

/// Parents before children, whatever the order in the file.
fn topological_order(parents: &[Option<usize>], root: usize) -> Result<Vec<usize>, SkeletonError> {
    let mut order = vec![root];
    let mut next = 0;
    while let Some(&parent) = order.get(next) {
        order.extend((0..parents.len()).filter(|&j| parents[j] == Some(parent)));
        next += 1;
    }
    match (0..parents.len()).find(|j| order.len() < parents.len() && !order.contains(j)) {
        None => Ok(order),
        Some(joint) => Err(SkeletonError::Cycle { joint }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    fn arm(rest_pose: Vec<Vec3>) -> Skeleton {
        Skeleton::new(SkeletonParts {
            parents: vec![-1, 0, 1],
            joints: vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0],
            rest_pose,
            ..SkeletonParts::default()
        })
        .unwrap()
    }

    #[test]
    fn a_bent_elbow_lifts_the_hand() {
        let skeleton = arm(vec![]);
        let mut pose = skeleton.bind_pose();
        pose.trans = Vec3::Y;
        pose.local[1] = Quat::from_rotation_z(FRAC_PI_2);
        let mut world = Vec::new();
        skeleton.forward_kinematics(&pose, &mut world);
        assert!((world[2].translation - Vec3::new(1.0, 2.0, 0.0)).length() < 1e-6);
    }

    #[test]
    fn the_bind_pose_moves_nothing_even_when_it_is_not_zero() {
        let skeleton = arm(vec![Vec3::ZERO, Vec3::new(0.1, 0.5, -0.2), Vec3::X]);
        let (mut joints, mut rest) = (Vec::new(), Vec::new());
        skeleton.forward_kinematics(&skeleton.bind_pose(), &mut joints);
        skeleton.world_from_rest(&joints, &mut rest);
        for (j, world_from_rest) in rest.iter().enumerate() {
            assert!((joints[j].translation - skeleton.joints()[j]).length() < 1e-6);
            let p = Vec3::new(0.3, -0.4, 0.5);
            assert!((world_from_rest.point(p) - p).length() < 1e-6);
        }
    }

    #[test]
    fn a_rest_pose_is_taken_away_before_the_pose_is_applied() {
        // The bind pose has the elbow bent by 90°; pose zero must therefore straighten it.
        let skeleton = Skeleton::new(SkeletonParts {
            parents: vec![-1, 0, 1],
            joints: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0)],
            rest_pose: vec![Vec3::ZERO, Vec3::Z * FRAC_PI_2, Vec3::ZERO],
            ..SkeletonParts::default()
        })
        .unwrap();
        let mut world = Vec::new();
        let zero = Pose::from_axis_angles(Vec3::ZERO, &[Vec3::ZERO; 3]);
        skeleton.forward_kinematics(&zero, &mut world);
        assert!((world[2].translation - Vec3::X * 2.0).length() < 1e-6);
    }

    #[test]
    fn children_may_stand_before_their_parents() {
        let skeleton = Skeleton::new(SkeletonParts {
            parents: vec![2, 0, -1],
            joints: vec![Vec3::X, Vec3::X * 2.0, Vec3::ZERO],
            ..SkeletonParts::default()
        })
        .unwrap();
        let mut pose = skeleton.bind_pose();
        pose.local[2] = Quat::from_rotation_y(FRAC_PI_2);
        let mut world = Vec::new();
        skeleton.forward_kinematics(&pose, &mut world);
        assert!((world[1].translation - Vec3::Z * -2.0).length() < 1e-6);
    }

    #[test]
    fn descriptions_that_are_no_tree_are_refused() {
        let skeleton = |parents: Vec<i64>| {
            Skeleton::new(SkeletonParts {
                joints: vec![Vec3::ZERO; parents.len()],
                parents,
                ..SkeletonParts::default()
            })
        };
        assert_eq!(skeleton(vec![]), Err(SkeletonError::Roots { found: 0 }));
        assert_eq!(skeleton(vec![-1, -1]), Err(SkeletonError::Roots { found: 2 }));
        assert_eq!(skeleton(vec![-1, 2, 1]), Err(SkeletonError::Cycle { joint: 1 }));
        assert!(matches!(
            skeleton(vec![-1, 7]),
            Err(SkeletonError::Parent { parent: 7, .. })
        ));
    }
}
