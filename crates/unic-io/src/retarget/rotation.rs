//! Rotations between directions.

use glam::{Quat, Vec3};

/// Returns the smallest rotation that takes the direction of `from` to that of `to`.
///
/// Vectors of length zero count as +Y, so that a missing bone yields a finite rotation.
pub(super) fn shortest_arc(from: Vec3, to: Vec3) -> Quat {
    Quat::from_rotation_arc(from.normalize_or(Vec3::Y), to.normalize_or(Vec3::Y))
}
