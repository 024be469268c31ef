//! Rigid transforms. They are named so that products read: `world_from_joint * joint_from_point`.
//!
//! For training and tools; an engine passes poses.

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::ops::Mul;

/// Rigid transform: a rotation followed by a translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rigid {
    /// Rotation, a unit quaternion.
    pub rotation: Quat,
    /// Translation after the rotation, metres.
    pub translation: Vec3,
}

impl Rigid {
    /// Transform that moves nothing.
    pub const IDENTITY: Self = Self {
        rotation: Quat::IDENTITY,
        translation: Vec3::ZERO,
    };

    /// Makes a transform from its rotation and translation.
    pub fn new(rotation: Quat, translation: Vec3) -> Self {
        Self {
            rotation,
            translation,
        }
    }

    /// Transforms a point.
    pub fn point(&self, point: Vec3) -> Vec3 {
        self.rotation * point + self.translation
    }

    /// Transforms a direction or displacement: rotates it without the translation.
    pub fn vector(&self, vector: Vec3) -> Vec3 {
        self.rotation * vector
    }

    /// Inverts the transform: `b_from_a` for an `a_from_b`.
    pub fn inverse(&self) -> Self {
        // The inverse of a unit quaternion is its conjugate: no division.
        let rotation = self.rotation.inverse();
        Self {
            rotation,
            translation: rotation * -self.translation,
        }
    }
}

impl Default for Rigid {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Mul for Rigid {
    type Output = Rigid;

    /// Composes transforms: `c_from_b * b_from_a = c_from_a`.
    fn mul(self, b_from_a: Rigid) -> Rigid {
        Rigid {
            rotation: self.rotation * b_from_a.rotation,
            translation: self.point(b_from_a.translation),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn product_and_inverse_act_on_points() {
        let a = Rigid::new(Quat::from_rotation_y(0.7), Vec3::new(1.0, -2.0, 0.5));
        let b = Rigid::new(Quat::from_rotation_x(-1.1), Vec3::new(0.2, 0.1, 3.0));
        let p = Vec3::new(0.3, 0.4, -0.9);
        assert!(((a * b).point(p) - a.point(b.point(p))).length() < 1e-6);
        assert!((a.inverse().point(a.point(p)) - p).length() < 1e-6);
        assert!((a.vector(p).length() - p.length()).abs() < 1e-6);
    }
}
