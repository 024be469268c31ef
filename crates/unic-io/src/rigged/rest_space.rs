//! Transform from the space of a skin to that of the rest pose.

use super::{file::SceneFile, joint_nodes::JointNodes, rig::SAME_PLACE_M};
use crate::error::Result;
use glam::{Mat3, Mat4, Quat, Vec3};
use std::collections::HashMap;

/// Angle from the bind pose up to which the nodes of a file stand in it, radians. The arc cosine of
/// f32 quaternions is rounded to about 1e-3.
const SAME_ANGLE: f32 = 4e-3;
/// Largest relative difference of the scales along two axes.
const UNIFORM_SCALE: f32 = 1e-2;

/// Returns the transform from the space of the binds to the world, which a skin does not state.
///
/// Where the nodes stand in the bind pose, it is the same for all of them. Where they stand in
/// another pose, as in the first frame of an animation, the root is turned and moved by that pose:
/// the axes of the world or of the node above are taken then, whichever are nearer.
pub(super) fn rest_from_space(
    scene: &SceneFile,
    world: &[Mat4],
    joints: &JointNodes,
    inverse: &HashMap<usize, Mat4>,
) -> Mat4 {
    let own = |node: &usize| Some(world[*node] * *inverse.get(node)?);
    let mut all = joints.nodes.iter().filter_map(own);
    let Some(first) = all.next() else {
        return Mat4::IDENTITY;
    };
    let scale = first.x_axis.truncate().length();
    let is_same = |other: Mat4| {
        let turned = rotation_of(Mat3::from_mat4(other)).angle_between(rotation_of(Mat3::from_mat4(first)));
        let moved = other.w_axis.distance(first.w_axis);
        turned < SAME_ANGLE && moved < SAME_PLACE_M
    };
    if all.all(is_same) {
        return first;
    }
    let above = scene
        .parent(joints.nodes[0])
        .map_or(Mat4::IDENTITY, |parent| world[parent]);
    let turn = rotation_of(Mat3::from_mat4(first));
    let candidates = [Mat4::IDENTITY, above].map(|matrix| {
        let rotation = rotation_of(Mat3::from_mat4(matrix));
        (rotation, matrix.w_axis.truncate())
    });
    let off = |(rotation, _): &(Quat, Vec3)| rotation.angle_between(turn);
    let [world_axes, above] = candidates;
    let (rotation, translation) = match off(&world_axes) <= off(&above) {
        true => world_axes,
        false => above,
    };
    Mat4::from_scale_rotation_translation(Vec3::splat(scale), rotation, translation)
}

/// Rotation of a matrix that may scale.
pub(super) fn rotation_of(linear: Mat3) -> Quat {
    let x = linear.x_axis.normalize_or(Vec3::X);
    let y = linear
        .y_axis
        .reject_from_normalized(x)
        .normalize_or(x.any_orthonormal_vector());
    Quat::from_mat3(&Mat3::from_cols(x, y, x.cross(y))).normalize()
}

/// Checks that a transform keeps shapes: one scale for all axes, and no mirror.
///
/// # Errors
/// Scales that differ by axis, a mirrored body.
pub(super) fn check_scale(scene: &SceneFile, matrix: Mat4) -> Result<()> {
    let linear = Mat3::from_mat4(matrix);
    let lengths = [linear.x_axis, linear.y_axis, linear.z_axis].map(Vec3::length);
    let [low, high] = [f32::min, f32::max].map(|pick| lengths.into_iter().fold(lengths[0], pick));
    if !(low > 0.0 && high.is_finite()) || high - low > UNIFORM_SCALE * high {
        let found = format!("{lengths:?}");
        return Err(scene.error("a body of the same scale along all axes", found));
    }
    match linear.determinant() > 0.0 {
        true => Ok(()),
        false => Err(scene.error("a body that is not mirrored", "a mirrored one")),
    }
}
