//! The joints of a humanoid skeleton by SMPL's names.

use super::bones::{BodyJoints, BoneMap, JointTree};
use crate::joint_names::{BodySide, LimbJoint};
use std::path::Path;
use unic_core::skeleton::{SMPL_JOINT_NAMES, Skeleton};

/// Number of SMPL's joints.
const COUNT: usize = SMPL_JOINT_NAMES.len();

/// Finds the joint of a skeleton for each of [`SMPL_JOINT_NAMES`], by the joints' names and the
/// tree.
///
/// Where a skeleton lacks a joint, it is the next one towards the pelvis. Spines with another
/// number of joints share theirs out. Returns none for a skeleton that is not recognised as a
/// human's.
pub fn smpl_joints(skeleton: &Skeleton) -> Option<[usize; COUNT]> {
    let tree = JointTree {
        path: Path::new("character"),
        names: skeleton.names().iter().map(String::as_str).collect(),
        parents: skeleton.parents().to_vec(),
    };
    let bones = BodyJoints::identify(&tree, &BoneMap::default()).ok()?;
    let chest = *bones.spine.last()?;
    let neck = bones.neck.first().copied().unwrap_or(chest);
    let mut joints = [bones.pelvis; COUNT];
    for (k, smpl) in [3, 6, 9].into_iter().enumerate() {
        joints[smpl] = bones.spine[k * (bones.spine.len() - 1) / 2];
    }
    joints[12] = neck;
    joints[15] = bones.head.unwrap_or(neck);
    for side in BodySide::ALL {
        // From the trunk outwards, so that a missing joint takes the one before it.
        for limb in [
            &[LimbJoint::Hip, LimbJoint::Knee, LimbJoint::Ankle, LimbJoint::Toe][..],
            &[
                LimbJoint::Collar,
                LimbJoint::Shoulder,
                LimbJoint::Elbow,
                LimbJoint::Wrist,
                LimbJoint::Hand,
            ],
        ] {
            let mut inner = if limb[0] == LimbJoint::Hip {
                bones.pelvis
            } else {
                chest
            };
            for part in limb {
                inner = bones.limb(*part, side).unwrap_or(inner);
                joints[part.smpl_joint(side)] = inner;
            }
        }
    }
    Some(joints)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use unic_core::skeleton::{SMPL_PARENTS, SkeletonParts};

    fn skeleton(names: &[&str], parents: &[i64]) -> Skeleton {
        Skeleton::new(SkeletonParts {
            names: names.iter().map(|n| (*n).to_owned()).collect(),
            parents: parents.to_vec(),
            joints: (0..names.len()).map(|j| Vec3::Y * j as f32).collect(),
            ..SkeletonParts::default()
        })
        .unwrap()
    }

    #[test]
    fn smpl_finds_its_own_joints() {
        let smpl = skeleton(&SMPL_JOINT_NAMES, &SMPL_PARENTS);
        assert_eq!(smpl_joints(&smpl), Some(std::array::from_fn(|j| j)));
    }

    #[test]
    fn missing_joints_are_the_next_ones_towards_the_pelvis() {
        let names = [
            "Hips",
            "Spine",
            "Head",
            "LeftUpLeg",
            "LeftLeg",
            "LeftFoot",
            "RightUpLeg",
            "RightLeg",
            "RightFoot",
            "LeftArm",
            "LeftForeArm",
            "LeftHand",
            "RightArm",
            "RightForeArm",
            "RightHand",
        ];
        let parents = [-1, 0, 1, 0, 3, 4, 0, 6, 7, 1, 9, 10, 1, 12, 13];
        let found = smpl_joints(&skeleton(&names, &parents)).unwrap();
        let of = |name: &str| found[SMPL_JOINT_NAMES.iter().position(|n| *n == name).unwrap()];
        assert_eq!(["spine1", "spine2", "spine3", "neck", "L_collar"].map(of), [1; 5]);
        assert_eq!(
            ["L_ankle", "L_foot", "L_wrist", "L_hand", "head"].map(of),
            [5, 5, 11, 11, 2]
        );
    }

    #[test]
    fn an_animal_is_not_recognised() {
        assert_eq!(
            smpl_joints(&skeleton(&["root", "tail_1", "tail_2"], &[-1, 0, 1])),
            None
        );
    }
}
