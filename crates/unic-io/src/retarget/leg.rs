//! Two-bone inverse kinematics of a leg.

use super::swing;
use glam::{Quat, Vec3};
use unic_core::{
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};

/// Share of its length to which a leg stretches: a straight knee has no direction to bend in.
const STRETCH: f32 = 0.9995;

/// How much the thigh's own +X says about the knee's axis beside the plane that the leg is bent in:
/// a straight leg has no plane. Sine of 3°.
const HINGE: f32 = 0.05;

/// A foot that is this close stays as it is, metres.
const CLOSE: f32 = 1e-6;

/// Corrections of the knee's angle: its axis is not quite across the leg's plane.
const ITERATIONS: usize = 3;

/// Joints of one leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leg {
    pub(crate) hip: usize,
    pub(crate) knee: usize,
    pub(crate) ankle: usize,
    pub(crate) toe: usize,
}

impl Leg {
    /// Bends the leg so that the ankle comes to `ankle` and the foot points from there to `toe`,
    /// as near as the leg's length allows; the knee keeps the plane that it is in. `world` is the
    /// pose's forward kinematics before; world positions, metres.
    pub(crate) fn reach(
        &self,
        skeleton: &Skeleton,
        pose: &mut Pose,
        world: &[Rigid],
        (ankle, toe): (Vec3, Vec3),
    ) {
        let [hip, knee, heel] = [self.hip, self.knee, self.ankle].map(|j| world[j].translation);
        let (thigh, shank) = (knee - hip, heel - knee);
        let (upper, lower) = (thigh.length(), shank.length());
        if upper.min(lower) < f32::EPSILON {
            return;
        }
        let is_there = heel
            .distance(ankle)
            .max(world[self.toe].translation.distance(toe))
            < CLOSE;
        if is_there || upper.min(lower) < f32::EPSILON {
            return;
        }
        let (along, across) = (thigh / upper, shank / lower);
        let hinge = along.cross(across) + world[self.hip].rotation * Vec3::X * HINGE;
        let hinge = hinge.normalize_or(along.any_orthonormal_vector());
        let shortest = (upper - lower).abs() / STRETCH;
        let reach = hip.distance(ankle).clamp(shortest, (upper + lower) * STRETCH);
        let cosine = (reach * reach - upper * upper - lower * lower) / (2.0 * upper * lower);
        let bent = bent(along, across, hinge, cosine.clamp(-1.0, 1.0).acos());
        let turn = swing(thigh + bent * lower, ankle - hip);
        let hip_rotation = turn * world[self.hip].rotation;
        let knee_rotation = turn * swing(across, bent) * world[self.knee].rotation;
        let foot = world[self.toe].translation - heel;
        let foot_rotation = swing(foot, toe - ankle) * world[self.ankle].rotation;
        let parent = |joint: usize| skeleton.parents()[joint].map_or(Quat::IDENTITY, |p| world[p].rotation);
        // A knee or ankle whose parent is another joint than the one above it in the leg turns with
        // that one all the same: what lies between keeps its local rotation.
        let above = |joint: usize, by: Quat, of: usize| by * world[of].rotation.inverse() * parent(joint);
        pose.local[self.hip] = (parent(self.hip).inverse() * hip_rotation).normalize();
        let knee_parent = above(self.knee, hip_rotation, self.hip);
        pose.local[self.knee] = (knee_parent.inverse() * knee_rotation).normalize();
        let ankle_parent = above(self.ankle, knee_rotation, self.knee);
        pose.local[self.ankle] = (ankle_parent.inverse() * foot_rotation).normalize();
    }
}

/// The shank's direction turned about the knee until it makes `angle` with the thigh's, radians.
fn bent(along: Vec3, mut across: Vec3, hinge: Vec3, angle: f32) -> Vec3 {
    for _ in 0..ITERATIONS {
        let missing = angle - along.angle_between(across);
        across = Quat::from_axis_angle(hinge, missing) * across;
    }
    across
}
