//! Two-bone inverse kinematics of a leg.

use super::rotation::shortest_arc;
use glam::{Quat, Vec3};
use unic_core::{Pose, skeleton::Skeleton, transform::Rigid};

/// Largest share of its length to which a leg is stretched. A straight knee has no direction to
/// bend in, and the arc cosine of its angle is ill-conditioned.
const MAX_STRETCH: f32 = 0.9995;

/// Weight of the thigh's own +X axis in the axis of the knee: the sine of 3°. The other part is the
/// normal of the leg's plane, whose length is the sine of the knee's angle and vanishes for a
/// straight leg.
const THIGH_AXIS_WEIGHT: f32 = 0.05;

/// Distance from its target up to which a foot is not moved, metres.
const CLOSE: f32 = 1e-6;

/// Number of corrections of the knee's angle. One is not exact, because the axis is not quite
/// perpendicular to the leg's plane; each further one corrects the rest.
const ITERATIONS: usize = 3;

/// Joints of one leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leg {
    pub(crate) hip: usize,
    pub(crate) knee: usize,
    pub(crate) ankle: usize,
    pub(crate) toe: usize,
}

/// Target positions of the joints of a foot, world space, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FootTarget {
    pub(crate) ankle: Vec3,
    pub(crate) toe: Vec3,
}

impl Leg {
    /// Bends the leg so that ankle and toe come to their targets, as near as the leg's length
    /// allows. The knee stays in its plane.
    ///
    /// `world` holds the forward kinematics of `pose` before the change.
    pub(crate) fn reach(&self, skeleton: &Skeleton, pose: &mut Pose, world: &[Rigid], target: FootTarget) {
        let FootTarget { ankle, toe } = target;
        let [hip, knee, heel] = [self.hip, self.knee, self.ankle].map(|j| world[j].translation);
        let (thigh, shank) = (knee - hip, heel - knee);
        let (upper, lower) = (thigh.length(), shank.length());
        // A bone without a length has no direction.
        if upper.min(lower) < f32::EPSILON {
            return;
        }
        let is_there = heel
            .distance(ankle)
            .max(world[self.toe].translation.distance(toe))
            < CLOSE;
        if is_there {
            return;
        }
        let (along, across) = (thigh / upper, shank / lower);
        let hinge = along.cross(across) + world[self.hip].rotation * Vec3::X * THIGH_AXIS_WEIGHT;
        let hinge = hinge.normalize_or(along.any_orthonormal_vector());
        // Law of cosines in the triangle of hip, knee and ankle, within the lengths that it can
        // have.
        let shortest = (upper - lower).abs() / MAX_STRETCH;
        let reach = hip.distance(ankle).clamp(shortest, (upper + lower) * MAX_STRETCH);
        let cosine = (reach * reach - upper * upper - lower * lower) / (2.0 * upper * lower);
        let bent = bent(along, across, hinge, cosine.clamp(-1.0, 1.0).acos());
        let turn = shortest_arc(thigh + bent * lower, ankle - hip);
        let hip_rotation = turn * world[self.hip].rotation;
        let knee_rotation = turn * shortest_arc(across, bent) * world[self.knee].rotation;
        let foot = world[self.toe].translation - heel;
        let foot_rotation = shortest_arc(foot, toe - ankle) * world[self.ankle].rotation;
        // Rotations of parents before the change. The hip's parent, the pelvis, does not change.
        let parent = |joint: usize| skeleton.parents()[joint].map_or(Quat::IDENTITY, |p| world[p].rotation);
        // Twist joints may stand between the joints of a leg. They keep their local rotations, so
        // that the parent of a knee rotates by the same rotation as the hip.
        let above = |joint: usize, by: Quat, of: usize| by * world[of].rotation.inverse() * parent(joint);
        pose.local[self.hip] = (parent(self.hip).inverse() * hip_rotation).normalize();
        let knee_parent = above(self.knee, hip_rotation, self.hip);
        pose.local[self.knee] = (knee_parent.inverse() * knee_rotation).normalize();
        let ankle_parent = above(self.ankle, knee_rotation, self.knee);
        pose.local[self.ankle] = (ankle_parent.inverse() * foot_rotation).normalize();
    }
}

/// Rotates the shank's direction `across` about the axis `hinge` of the knee until it makes `angle`
/// (radians) with the thigh's direction `along`.
fn bent(along: Vec3, mut across: Vec3, hinge: Vec3, angle: f32) -> Vec3 {
    for _ in 0..ITERATIONS {
        let missing = angle - along.angle_between(across);
        across = Quat::from_axis_angle(hinge, missing) * across;
    }
    across
}
