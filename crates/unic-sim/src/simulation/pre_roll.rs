//! The pre-roll: the motion that leads from the bind pose into a clip while the garment settles.

use super::settings::SettleSettings;
use glam::{Quat, Vec3};
use unic_core::{Pose, skeleton::Skeleton, transform::Rigid};

/// Poses at negative times, in seconds; time zero is the clip's first pose.
///
/// - Hold: the bind pose, turned and moved to where the clip begins.
/// - Move: a smooth blend to the clip's first pose.
/// - Rest: the clip's first pose, while the garment comes to rest.
///
/// The clip's velocity is picked up exponentially at the end. The pose at time t is extrapolated
/// backwards by start_s · (1 − exp(t / start_s)) seconds of the clip's first motion. That offset is
/// constant for t far below zero, so that the character stands still. At zero the offset vanishes
/// and its rate is the clip's velocity.
#[derive(Debug, Clone)]
pub(super) struct PreRoll {
    /// Bind pose at the clip's position and heading.
    start: Pose,
    /// First pose of the clip.
    first: Pose,
    /// Motion of one frame backwards: local rotations and translation from the second pose to the
    /// first.
    back: Pose,
    fps: f32,
    settings: SettleSettings,
}

impl PreRoll {
    /// Creates the pre-roll into a clip that begins with the poses `first` and `second` at `fps`
    /// frames a second.
    pub(super) fn new(
        skeleton: &Skeleton,
        first: &Pose,
        second: &Pose,
        fps: f32,
        settings: SettleSettings,
    ) -> Self {
        let back = Pose {
            trans: first.trans - second.trans,
            local: (second.local.iter().zip(&first.local))
                .map(|(second, first)| shortest(second.inverse() * *first))
                .collect(),
        };
        let mut pre_roll = Self {
            start: first.clone(),
            first: first.clone(),
            back,
            fps,
            settings,
        };
        let mut start = skeleton.bind_pose();
        let bind = start.local[skeleton.root()];
        start.local[skeleton.root()] = heading(first.local[skeleton.root()] * bind.inverse()) * bind;
        start.trans = pre_roll.target(-pre_roll.seconds()).trans;
        pre_roll.start = start;
        pre_roll
    }

    /// Returns the duration of the pre-roll, seconds.
    pub(super) fn seconds(&self) -> f32 {
        self.settings.seconds()
    }

    /// Returns the pose at `time` seconds, at most zero; zero is the clip's first pose.
    pub(super) fn pose(&self, time: f32) -> Pose {
        let passed = time + self.settings.move_s + self.settings.rest_s;
        // A move of zero seconds is allowed: the quotient is then huge or infinite, and clamped.
        let t = (passed / self.settings.move_s.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        // Smootherstep (Perlin): velocity and acceleration are zero at both ends, so that the cloth
        // is not jerked.
        let share = t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        self.start.interpolate(&self.target(time), share)
    }

    /// Returns the damping rate at `time`, 1/s. It falls linearly during the rest phase to
    /// `afterwards`, the simulation's own rate.
    pub(super) fn damping_per_s(&self, time: f32, afterwards: f32) -> f32 {
        let left = (-time / self.settings.rest_s.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        afterwards + (self.settings.damping_per_s - afterwards).max(0.0) * left
    }

    /// Returns the transform from bind-pose space to the body's position and heading at the start
    /// of the pre-roll.
    pub(super) fn world_from_rest(&self, skeleton: &Skeleton) -> Rigid {
        let root = skeleton.root();
        let bind = skeleton.bind_pose().local[root];
        let turn = self.start.local[root] * bind.inverse();
        let pivot = skeleton.joints()[root];
        Rigid::new(turn, pivot + self.start.trans - turn * pivot)
    }

    /// Returns the clip's first pose, moved backwards along the clip's first motion.
    fn target(&self, time: f32) -> Pose {
        let lag = self.settings.start_s * (1.0 - (time / self.settings.start_s).exp());
        let frames = lag * self.fps;
        Pose {
            trans: self.first.trans + self.back.trans * frames,
            local: (self.first.local.iter().zip(&self.back.local))
                .map(|(&first, back)| first * Quat::from_scaled_axis(back.to_scaled_axis() * frames))
                .collect(),
        }
    }
}

/// Returns the rotation about the vertical axis that faces the same way as `rotation`.
pub(crate) fn heading(rotation: Quat) -> Quat {
    let forward = rotation * Vec3::Z;
    // For a character that lies on its back or face, +Z is nearly vertical and its horizontal part
    // is noise. The body's axis gives the heading then: towards the feet when lying on the back,
    // towards the head when lying on the face.
    let forward = if forward.y.abs() < 0.9 {
        forward
    } else {
        rotation * Vec3::Y * -forward.y.signum()
    };
    Quat::from_rotation_y(forward.x.atan2(forward.z))
}

/// Returns the representation of a rotation whose angle is at most π. `to_scaled_axis` of the other
/// one would be the long way around.
fn shortest(q: Quat) -> Quat {
    if q.w < 0.0 { -q } else { q }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_core::skeleton::SkeletonParts;

    fn arm() -> Skeleton {
        Skeleton::new(SkeletonParts {
            parents: vec![-1, 0],
            joints: vec![Vec3::Y, Vec3::new(0.4, 1.4, 0.0)],
            rest_pose: vec![Vec3::ZERO, Vec3::NEG_Z],
            ..Default::default()
        })
        .unwrap()
    }

    fn running(frame: f32) -> Pose {
        let axis_angles = [Vec3::Y * (2.0 + 0.1 * frame), Vec3::X * (0.5 - 0.2 * frame)];
        Pose::from_axis_angles(Vec3::new(5.0, 0.1, -3.0) + Vec3::X * 0.1 * frame, &axis_angles)
    }

    #[test]
    fn pre_roll_ends_in_the_first_pose_with_the_first_velocity() {
        let (fps, settle) = (30.0, SettleSettings::default());
        let pre_roll = PreRoll::new(&arm(), &running(0.0), &running(1.0), fps, settle);
        let end = pre_roll.pose(0.0);
        assert!((end.trans - running(0.0).trans).length() < 1e-6);
        for (a, b) in end.local.iter().zip(&running(0.0).local) {
            assert!(a.dot(*b).abs() > 1.0 - 1e-6);
        }
        let step = 1e-3;
        let before = pre_roll.pose(-step);
        let velocity = (end.trans - before.trans) / step;
        assert!((velocity - Vec3::X * 0.1 * fps).length() < 0.03, "{velocity}");
        let turn = (end.local[1] * before.local[1].inverse()).to_scaled_axis() / step;
        assert!((turn - Vec3::X * -0.2 * fps).length() < 0.1, "{turn}");
    }

    #[test]
    fn pre_roll_begins_in_the_bind_pose_with_the_heading_of_the_clip() {
        let (skeleton, settle) = (arm(), SettleSettings::default());
        let pre_roll = PreRoll::new(&skeleton, &running(0.0), &running(1.0), 30.0, settle);
        let start = pre_roll.pose(-pre_roll.seconds());
        assert!(start.local[1].dot(skeleton.bind_pose().local[1]).abs() > 1.0 - 1e-6);
        assert!(start.local[0].dot(Quat::from_rotation_y(2.0)).abs() > 1.0 - 1e-6);
        let world_from_rest = pre_roll.world_from_rest(&skeleton);
        let mut world_from_joint = Vec::new();
        skeleton.forward_kinematics(&start, &mut world_from_joint);
        for (joint, posed) in skeleton.joints().iter().zip(&world_from_joint) {
            assert!((world_from_rest.point(*joint) - posed.translation).length() < 1e-5);
        }
    }
}
