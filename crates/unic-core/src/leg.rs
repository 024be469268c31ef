//! Two-bone inverse kinematics of a leg.
//!
//! For tools and for [`motion_matching`](crate::motion_matching), which keep feet where they stand.

use crate::{
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Leg {
    /// Joint between pelvis and thigh.
    pub hip: usize,
    /// Joint between thigh and shank.
    pub knee: usize,
    /// Joint between shank and foot.
    pub ankle: usize,
    /// Joint of the ball of the foot.
    pub toe: usize,
}

/// Target positions of the joints of a foot, world space, metres.
#[derive(Clone, Copy, Debug)]
pub struct FootTarget {
    /// Target of the ankle.
    pub ankle: Vec3,
    /// Target of the toe joint. Its direction from the ankle's target orients the foot.
    pub toe: Vec3,
}

impl Leg {
    /// Bends the leg so that ankle and toe come to their targets, as near as the leg's length
    /// allows. The knee stays in its plane.
    ///
    /// `world` holds the forward kinematics of `pose` before the change.
    pub fn reach(&self, skeleton: &Skeleton, pose: &mut Pose, world: &[Rigid], target: FootTarget) {
        let FootTarget { ankle, toe } = target;
        let [hip, knee, heel] = [self.hip, self.knee, self.ankle].map(|j| world[j].translation);
        let (thigh, shank) = (knee - hip, heel - knee);
        let (upper, lower) = (thigh.length(), shank.length());
        // A bone without a length has no direction, nor has one that is not finite.
        if upper.min(lower) < f32::EPSILON || !(upper + lower).is_finite() {
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

/// Returns the smallest rotation that takes the direction of `from` to that of `to`.
///
/// Vectors of length zero count as +Y, so that a missing bone yields a finite rotation.
pub fn shortest_arc(from: Vec3, to: Vec3) -> Quat {
    Quat::from_rotation_arc(from.normalize_or(Vec3::Y), to.normalize_or(Vec3::Y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::SkeletonParts;
    use proptest::prelude::*;

    const LEG: Leg = Leg {
        hip: 1,
        knee: 2,
        ankle: 3,
        toe: 4,
    };

    fn skeleton() -> Skeleton {
        Skeleton::new(SkeletonParts {
            parents: vec![-1, 0, 1, 2, 3],
            joints: vec![
                Vec3::Y,
                Vec3::new(0.1, 0.9, 0.0),
                Vec3::new(0.11, 0.5, 0.03),
                Vec3::new(0.1, 0.08, 0.0),
                Vec3::new(0.1, 0.03, 0.15),
            ],
            ..SkeletonParts::default()
        })
        .unwrap()
    }

    proptest! {
        /// Every target within reach is reached, and bones keep their lengths.
        #[test]
        fn reachable_targets_are_reached(
            turns in prop::array::uniform5(prop::array::uniform3(-0.5f32..0.5)),
            bend in 0.1f32..1.5,
            direction in prop::array::uniform3(-1.0f32..1.0),
            length in 0.25f32..0.8,
        ) {
            let skeleton = skeleton();
            let mut pose = Pose::from_axis_angles(Vec3::ZERO, &turns.map(Vec3::from_array));
            pose.local[LEG.knee] = Quat::from_rotation_x(bend);
            let mut world = Vec::new();
            skeleton.forward_kinematics(&pose, &mut world);
            let down = Vec3::from_array(direction) * 0.6 - Vec3::Y;
            let ankle = world[LEG.hip].translation + down.normalize() * length;
            let foot = Vec3::new(0.1, -0.05, 0.9).normalize() * skeleton.joints()[4].distance(skeleton.joints()[3]);
            let target = FootTarget { ankle, toe: ankle + foot };
            LEG.reach(&skeleton, &mut pose, &world, target);
            skeleton.forward_kinematics(&pose, &mut world);
            prop_assert!(world[LEG.ankle].translation.distance(target.ankle) < 2e-3);
            prop_assert!(world[LEG.toe].translation.distance(target.toe) < 2e-3);
            for joint in 1..5 {
                let bone = world[joint].translation.distance(world[joint - 1].translation);
                let rest = skeleton.joints()[joint].distance(skeleton.joints()[joint - 1]);
                prop_assert!((bone - rest).abs() < 1e-5);
            }
        }
    }
}
