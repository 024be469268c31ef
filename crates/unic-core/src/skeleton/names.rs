//! Names and parents of SMPL's joints.

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

/// Parent of each of [`SMPL_JOINT_NAMES`], in the form of
/// [`SkeletonParts::parents`](super::SkeletonParts::parents).
pub const SMPL_PARENTS: [i64; 24] = [
    -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
];

/// Joints of an adult of 1.70 m in the T-pose, by index among [`SMPL_JOINT_NAMES`]: those on the
/// midline and on the left, without the hand. Metres; +Y up, the left is +X.
pub const ADULT_JOINTS: [(usize, [f32; 3]); 14] = [
    (0, [0.0, 0.935, 0.0]),
    (1, [0.088, 0.885, 0.0]),
    (3, [0.0, 1.02, -0.012]),
    (4, [0.094, 0.484, 0.004]),
    (6, [0.0, 1.115, -0.018]),
    (7, [0.1, 0.077, -0.026]),
    (9, [0.0, 1.225, -0.022]),
    (10, [0.112, 0.022, 0.1]),
    (12, [0.0, 1.45, -0.03]),
    (13, [0.055, 1.385, -0.02]),
    (15, [0.0, 1.525, -0.008]),
    (16, [0.165, 1.385, -0.02]),
    (18, [0.455, 1.385, -0.026]),
    (20, [0.703, 1.385, -0.02]),
];

/// Returns the given names, or default names for `count` joints if there are none.
pub(super) fn names_or_default(names: Vec<String>, count: usize) -> Vec<String> {
    if !names.is_empty() {
        return names;
    }
    if count == SMPL_JOINT_NAMES.len() {
        return SMPL_JOINT_NAMES.map(String::from).to_vec();
    }
    (0..count).map(|j| format!("joint_{j}")).collect()
}
