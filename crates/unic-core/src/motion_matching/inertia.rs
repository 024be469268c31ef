//! Inertialisation: the difference between two motions at a switch, which decays afterwards.
//!
//! After Bollo 2016, "Inertialization", with critically damped springs. The output is always the
//! frame that plays plus the offset. Position and velocity are continuous, and only one frame is
//! played at a time.

use super::{
    database::Database,
    root::RootFrame,
    spring::{Moving, Spring},
};
use crate::heading::rotation_vector;
use glam::{Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::f32::consts::TAU;

/// Difference between the output and the frame that plays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseOffset {
    /// Offset of the root joint in the root frame, metres.
    pub(super) hips: Moving<Vec3>,
    /// Offset of each local rotation, a rotation vector in the parent's frame, radians.
    pub(super) joints: Vec<Moving<Vec3>>,
    /// Offset of the root frame's velocity, m/s, world (x, z), with its rate.
    pub(super) velocity: Moving<Vec2>,
    /// Offset of the root frame's yaw rate, rad/s, with its rate.
    pub(super) yaw_rate: Moving<f32>,
}

impl PoseOffset {
    /// No offset.
    pub(super) fn none(joints: usize) -> Self {
        Self {
            hips: Moving::default(),
            joints: vec![Moving::default(); joints],
            velocity: Moving::default(),
            yaw_rate: Moving::default(),
        }
    }

    /// Returns whether all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        let is_moving = |m: &Moving<Vec3>| m.value.is_finite() && m.rate.is_finite();
        is_moving(&self.hips)
            && self.joints.iter().all(is_moving)
            && self.velocity.value.is_finite()
            && self.velocity.rate.is_finite()
            && self.yaw_rate.value.is_finite()
            && self.yaw_rate.rate.is_finite()
    }

    /// Switches from one frame to another: the output stays where it is and moves on as it moved.
    pub(super) fn switch(&mut self, database: &Database, root: &RootFrame, from: usize, to: usize) {
        let (before, after) = (Velocities::of(database, from), Velocities::of(database, to));
        self.hips.value += database.hips(from) - database.hips(to);
        self.hips.rate += before.hips - after.hips;
        self.velocity.value += root.to_world(before.root - after.root);
        self.yaw_rate.value += before.yaw_rate - after.yaw_rate;
        let dt = 1.0 / database.fps();
        for (joint, offset) in self.joints.iter_mut().enumerate() {
            let (old, new) = (database.rotations(from)[joint], database.rotations(to)[joint]);
            let output = Quat::from_scaled_axis(offset.value) * old;
            // The output a tick later, as if there were no switch. A rate of a rotation vector is
            // no angular velocity, so the new rate is a difference of two rotation vectors.
            let ahead = Quat::from_scaled_axis(offset.value + offset.rate * dt) * before.turn(joint) * old;
            offset.value = rotation_vector((output * new.inverse()).normalize());
            let later = rotation_vector((ahead * (after.turn(joint) * new).inverse()).normalize());
            offset.rate = (unwrapped(later, offset.value) - offset.value) * (1.0 / dt);
        }
    }

    /// Lets the offset decay by `dt` seconds.
    pub(super) fn decay(&mut self, springs: &OffsetSprings, dt: f32) {
        self.hips = springs.pose.decay(self.hips, dt);
        for joint in &mut self.joints {
            *joint = springs.pose.decay(*joint, dt);
        }
        self.velocity = springs.root.decay(self.velocity, dt);
        self.yaw_rate = springs.root.decay(self.yaw_rate, dt);
    }
}

/// Springs by which offsets decay.
#[derive(Clone, Copy, Debug)]
pub(super) struct OffsetSprings {
    /// Spring of joints and hips.
    pub(super) pose: Spring,
    /// Spring of the root frame's velocity.
    pub(super) root: Spring,
}

/// Velocities from a frame to the next one of its clip.
pub(super) struct Velocities<'a> {
    database: &'a Database,
    /// First of the two frames.
    first: usize,
    /// Velocity of the root joint in the root frame, m/s.
    pub(super) hips: Vec3,
    /// Velocity of the root frame in itself, (x, z), m/s.
    pub(super) root: Vec2,
    /// Yaw rate, rad/s.
    pub(super) yaw_rate: f32,
}

impl<'a> Velocities<'a> {
    /// Velocities from this frame on; up to it where it is its clip's last one.
    pub(super) fn of(database: &'a Database, frame: usize) -> Self {
        let clip = database.clip_of(frame);
        // A clip has at least two frames.
        let first = frame.min(clip.end() - 2).max(clip.first);
        let step = database.root(first).local_of(&database.root(first + 1));
        let fps = database.fps();
        Self {
            database,
            first,
            hips: (database.hips(first + 1) - database.hips(first)) * fps,
            root: step.position * fps,
            yaw_rate: step.yaw * fps,
        }
    }

    /// Rotation of a joint within a tick, in its parent's frame.
    fn turn(&self, joint: usize) -> Quat {
        let now = self.database.rotations(self.first)[joint];
        let next = self.database.rotations(self.first + 1)[joint];
        next * now.inverse()
    }
}

/// Returns the rotation vector of the same rotation that is nearer to `last`: vectors of half a
/// turn jump to the other side.
fn unwrapped(vector: Vec3, last: Vec3) -> Vec3 {
    let other = vector - vector.normalize_or_zero() * TAU;
    match other.distance_squared(last) < vector.distance_squared(last) {
        true => other,
        false => vector,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        clip::Clip,
        leg::Leg,
        motion_matching::{DatabaseSettings, Feature, FeatureGroup, TaggedClip},
        skeleton::{Pose, SkeletonParts},
    };

    /// Two joints that turn and move, on no particular path.
    fn database() -> Database {
        let skeleton = crate::skeleton::Skeleton::new(SkeletonParts {
            parents: vec![-1, 0],
            joints: vec![Vec3::Y, Vec3::Y * 0.5],
            ..SkeletonParts::default()
        });
        let skeleton = skeleton.unwrap();
        let turn = |t: f32| Quat::from_scaled_axis(Vec3::new(1.1 * t.sin(), 0.7 * t, 0.8 * (0.6 * t).cos()));
        let pose = |i: usize| {
            let t = i as f32 / 300.0;
            Pose {
                trans: Vec3::new(t.sin(), 0.2 * (2.0 * t).sin(), t * t),
                local: vec![Quat::from_rotation_y(0.4 * t), turn(3.0 * t)],
            }
        };
        let clip = Clip {
            name: "turning".into(),
            fps: 300.0,
            poses: (0..900).map(pose).collect(),
            ground_height: 0.0,
            wind: Vec::new(),
        };
        let leg = Leg {
            hip: 0,
            knee: 0,
            ankle: 1,
            toe: 1,
        };
        let settings = DatabaseSettings {
            groups: vec![FeatureGroup {
                feature: Feature::JointPosition(1),
                weight: 1.0,
            }],
            legs: [leg; 2],
            toe_heights_m: [0.0; 2],
            mirror: None,
            end_margin_s: 0.1,
            contact_speed_m_s: 0.1,
            contact_height_m: 0.1,
        };
        Database::build(&skeleton, &[TaggedClip::untagged(&clip)], settings).unwrap()
    }

    fn shown(database: &Database, offset: &PoseOffset, frame: usize) -> (Vec3, Quat) {
        let turn = Quat::from_scaled_axis(offset.joints[1].value);
        (
            database.hips(frame) + offset.hips.value,
            turn * database.rotations(frame)[1],
        )
    }

    /// The output and its velocity are the same before and after a switch, also in the middle of
    /// another one. The tolerance is the change of velocity within a tick of 1/300 s.
    #[test]
    fn switches_keep_position_and_velocity() {
        let database = database();
        let spring = Spring::of_half_life(0.1);
        let springs = OffsetSprings {
            pose: spring,
            root: spring,
        };
        let dt = 1.0 / database.fps();
        let mut offset = PoseOffset::none(2);
        let mut frame = 100;
        for to in [700, 250, 420] {
            let mut ahead = offset.clone();
            ahead.decay(&springs, dt);
            let old = [
                shown(&database, &offset, frame),
                shown(&database, &ahead, frame + 1),
            ];
            offset.switch(&database, &RootFrame::default(), frame, to);
            ahead = offset.clone();
            ahead.decay(&springs, dt);
            let new = [shown(&database, &offset, to), shown(&database, &ahead, to + 1)];
            assert!(old[0].0.distance(new[0].0) < 1e-5 && old[0].1.angle_between(new[0].1) < 1e-3);
            let velocity = |two: &[(Vec3, Quat); 2]| (two[1].0 - two[0].0) / dt;
            assert!((velocity(&old) - velocity(&new)).length() < 0.15);
            let rate = |two: &[(Vec3, Quat); 2]| rotation_vector(two[1].1 * two[0].1.inverse()) / dt;
            let jump = (rate(&old) - rate(&new)).length();
            assert!(jump < 0.25 * rate(&old).length().max(4.0), "{jump} rad/s");
            // Some ticks later the next switch comes into the decay.
            for _ in 0..10 {
                offset.decay(&springs, dt);
            }
            frame = to + 10;
        }
    }

    #[test]
    fn offsets_decay_to_nothing() {
        let database = database();
        let spring = Spring::of_half_life(0.1);
        let mut offset = PoseOffset::none(2);
        offset.switch(&database, &RootFrame::default(), 100, 700);
        let springs = OffsetSprings {
            pose: spring,
            root: spring,
        };
        offset.decay(&springs, 2.0);
        assert!(offset.joints[1].value.length() < 1e-4 && offset.hips.value.length() < 1e-4);
    }
}
