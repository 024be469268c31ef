//! Poses and their rotations.

use glam::{Quat, Vec3};

/// Pose of a skeleton: local rotations and the root's translation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// World position of the root minus its bind position, metres (SMPL's translation).
    pub trans: Vec3,
    /// Rotation of each joint relative to its parent, and of the root relative to the world.
    pub local: Vec<Quat>,
}

impl Pose {
    /// Makes a pose from axis-angle rotations in radians, one for each joint.
    pub fn from_axis_angles(trans: Vec3, axis_angles: &[Vec3]) -> Self {
        Self {
            trans,
            local: axis_angles.iter().map(|&a| rotation(a)).collect(),
        }
    }

    /// Interpolates between two poses of one skeleton, spherically for the rotations and linearly
    /// for the root; `t` is in 0..=1.
    pub fn interpolate(&self, other: &Pose, t: f32) -> Pose {
        Pose {
            trans: self.trans.lerp(other.trans, t),
            local: (self.local.iter().zip(&other.local))
                .map(|(a, b)| a.slerp(*b, t))
                .collect(),
        }
    }

    /// Returns whether all numbers are finite and all rotations have unit length.
    pub fn is_valid(&self) -> bool {
        self.trans.is_finite() && self.local.iter().all(|q| q.is_finite() && q.is_normalized())
    }
}

/// Converts an axis-angle vector to a rotation: its direction is the axis, its length the angle in
/// radians.
pub fn rotation(axis_angle: Vec3) -> Quat {
    Quat::from_scaled_axis(axis_angle)
}
