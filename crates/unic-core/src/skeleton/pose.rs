//! Poses and their rotations.

use glam::{Quat, Vec3};

/// Pose of a skeleton: local rotations and the root's translation.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// World position of the root minus its bind position, metres (SMPL's translation).
    pub trans: Vec3,
    /// Rotation of each joint relative to its parent (the root's: to the world).
    pub local: Vec<Quat>,
}

impl Pose {
    /// From axis-angle rotations in radians, one a joint.
    pub fn from_axis_angles(trans: Vec3, axis_angles: &[Vec3]) -> Self {
        Self {
            trans,
            local: axis_angles.iter().map(|&a| rotation(a)).collect(),
        }
    }

    /// Between two poses of one skeleton: spherical for the rotations, linear for the root;
    /// `t` in 0..=1.
    pub fn interpolate(&self, other: &Pose, t: f32) -> Pose {
        Pose {
            trans: self.trans.lerp(other.trans, t),
            local: (self.local.iter().zip(&other.local))
                .map(|(a, b)| a.slerp(*b, t))
                .collect(),
        }
    }

    /// No NaN, no infinity, unit rotations.
    pub fn is_valid(&self) -> bool {
        self.trans.is_finite() && self.local.iter().all(|q| q.is_finite() && q.is_normalized())
    }
}

/// The rotation of an axis-angle vector: its direction is the axis, its length the angle in radians.
pub fn rotation(axis_angle: Vec3) -> Quat {
    Quat::from_scaled_axis(axis_angle)
}
