//! The motion that leads from the bind pose into a clip.

use super::settings::SettleSettings;
use glam::{Quat, Vec3};
use unic_core::{
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};

/// Poses before a clip's first one, in seconds up to zero.
///
/// First the bind pose, turned and carried to where the clip begins; then the way over to the
/// clip's first pose; at last that pose, with the clip's own speed picked up exponentially: at
/// time t it lags start_s · (1 − exp(t / start_s)) seconds of the first motion behind, which is
/// still long before and has the clip's velocity at zero.
#[derive(Debug, Clone)]
pub(super) struct Approach {
    start: Pose,
    first: Pose,
    /// Rotations from the second pose back to the first, and the way.
    back: Pose,
    fps: f32,
    settings: SettleSettings,
}

impl Approach {
    /// Into a clip that begins with `first` and `second` at `fps`.
    pub(super) fn new(
        skeleton: &Skeleton,
        [first, second]: [&Pose; 2],
        fps: f32,
        settings: SettleSettings,
    ) -> Self {
        let back = Pose {
            trans: first.trans - second.trans,
            local: (second.local.iter().zip(&first.local))
                .map(|(second, first)| shortest(second.inverse() * *first))
                .collect(),
        };
        let mut approach = Self {
            start: first.clone(),
            first: first.clone(),
            back,
            fps,
            settings,
        };
        let mut start = skeleton.bind_pose();
        let bind = start.local[skeleton.root()];
        start.local[skeleton.root()] = heading(first.local[skeleton.root()] * bind.inverse()) * bind;
        start.trans = approach.target(-approach.seconds()).trans;
        approach.start = start;
        approach
    }

    /// Time from the start to the clip's first pose.
    pub(super) fn seconds(&self) -> f32 {
        self.settings.seconds()
    }

    /// Pose at `time` seconds; zero is the clip's first pose.
    pub(super) fn pose(&self, time: f32) -> Pose {
        let passed = time + self.settings.move_s + self.settings.rest_s;
        let t = (passed / self.settings.move_s.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        // The polynomial that starts and ends without speed and acceleration.
        let share = t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        self.start.interpolate(&self.target(time), share)
    }

    /// Damping at `time`, 1/s, given that of the simulation.
    pub(super) fn damping_per_s(&self, time: f32, afterwards: f32) -> f32 {
        let left = (-time / self.settings.rest_s.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        afterwards + (self.settings.damping_per_s - afterwards).max(0.0) * left
    }

    /// From the bind pose's space to where the approach begins.
    pub(super) fn world_from_rest(&self, skeleton: &Skeleton) -> Rigid {
        let root = skeleton.root();
        let bind = skeleton.bind_pose().local[root];
        let turn = self.start.local[root] * bind.inverse();
        let pivot = skeleton.joints()[root];
        Rigid::new(turn, pivot + self.start.trans - turn * pivot)
    }

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

/// The turn about the vertical that leaves a rotation facing the same way.
pub(crate) fn heading(rotation: Quat) -> Quat {
    let forward = rotation * Vec3::Z;
    // Lying on the back or face, the feet tell: their direction is against the head's.
    let forward = if forward.y.abs() < 0.9 {
        forward
    } else {
        rotation * Vec3::Y * -forward.y.signum()
    };
    Quat::from_rotation_y(forward.x.atan2(forward.z))
}

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
    fn it_ends_in_the_first_pose_with_the_first_velocity() {
        let (fps, settle) = (30.0, SettleSettings::default());
        let approach = Approach::new(&arm(), [&running(0.0), &running(1.0)], fps, settle);
        let end = approach.pose(0.0);
        assert!((end.trans - running(0.0).trans).length() < 1e-6);
        for (a, b) in end.local.iter().zip(&running(0.0).local) {
            assert!(a.dot(*b).abs() > 1.0 - 1e-6);
        }
        let step = 1e-3;
        let before = approach.pose(-step);
        let velocity = (end.trans - before.trans) / step;
        assert!((velocity - Vec3::X * 0.1 * fps).length() < 0.03, "{velocity}");
        let turn = (end.local[1] * before.local[1].inverse()).to_scaled_axis() / step;
        assert!((turn - Vec3::X * -0.2 * fps).length() < 0.1, "{turn}");
    }

    #[test]
    fn it_begins_in_the_bind_pose_facing_as_the_clip_does() {
        let (skeleton, settle) = (arm(), SettleSettings::default());
        let approach = Approach::new(&skeleton, [&running(0.0), &running(1.0)], 30.0, settle);
        let start = approach.pose(-approach.seconds());
        assert!(start.local[1].dot(skeleton.bind_pose().local[1]).abs() > 1.0 - 1e-6);
        assert!(start.local[0].dot(Quat::from_rotation_y(2.0)).abs() > 1.0 - 1e-6);
        let world = approach.world_from_rest(&skeleton);
        let mut world_from_joint = Vec::new();
        skeleton.forward_kinematics(&start, &mut world_from_joint);
        for (joint, at) in skeleton.joints().iter().zip(&world_from_joint) {
            assert!((world.point(*joint) - at.translation).length() < 1e-5);
        }
    }
}
