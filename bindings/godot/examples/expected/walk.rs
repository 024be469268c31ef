//! A walk on the spot that all tests of this extension animate.

use glam::{Quat, Vec3};
use unic_core::{Model, Pose, StepInput};

/// Pose of the walk after a number of ticks.
pub(crate) fn pose_at(model: &Model, ticks: f32) -> Pose {
    let skeleton = &model.character().skeleton;
    let mut pose = skeleton.bind_pose();
    let seconds = ticks / model.config().fps;
    pose.trans = Vec3::new(
        0.2 * (2.0 * seconds).sin(),
        0.01 * (8.0 * seconds).sin(),
        0.5 * seconds,
    );
    let turn = Quat::from_rotation_y(0.8 * (1.5 * seconds).sin());
    let root = skeleton.root();
    pose.local[root] = turn * pose.local[root];
    let limbs = [
        ("L_shoulder", 0.3),
        ("R_shoulder", -0.3),
        ("L_hip", -0.4),
        ("R_hip", 0.4),
    ];
    for (name, swing) in limbs {
        if let Some(joint) = skeleton.joint(name) {
            let turn = Quat::from_rotation_x(swing * (5.0 * seconds).sin());
            pose.local[joint] = turn * pose.local[joint];
        }
    }
    pose
}

/// Input of a step in still air, on ground at height 0.
pub(crate) fn input(pose: &Pose) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind: Vec3::ZERO,
    }
}
