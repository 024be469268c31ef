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
