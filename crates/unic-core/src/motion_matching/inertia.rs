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
        for (joint, offset) in self.joints.iter_mut().enumerate() {
            let turn = Quat::from_scaled_axis(offset.value);
            let (old, new) = (database.rotations(from)[joint], database.rotations(to)[joint]);
            let output = turn * old;
            let rate = offset.rate + turn * before.rotation(joint);
            offset.value = rotation_vector((output * new.inverse()).normalize());
            offset.rate = rate - Quat::from_scaled_axis(offset.value) * after.rotation(joint);
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

    /// Angular velocity of a joint in its parent's frame, rad/s.
    fn rotation(&self, joint: usize) -> Vec3 {
        let now = self.database.rotations(self.first)[joint];
        let next = self.database.rotations(self.first + 1)[joint];
        rotation_vector((next * now.inverse()).normalize()) * self.database.fps()
    }
}
