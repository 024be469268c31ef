//! Names of joints.

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

/// Parents of [`SMPL_JOINT_NAMES`], as [`SkeletonParts`](super::SkeletonParts) has them: -1 for the root.
pub const SMPL_PARENTS: [i64; 24] = [
    -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
];

/// The names given, or those that a skeleton of `count` joints has without.
pub(super) fn named(names: Vec<String>, count: usize) -> Vec<String> {
    if !names.is_empty() {
        return names;
    }
    if count == SMPL_JOINT_NAMES.len() {
        return SMPL_JOINT_NAMES.map(String::from).to_vec();
    }
    (0..count).map(|j| format!("joint_{j}")).collect()
}
