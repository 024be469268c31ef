//! Checks of the content of a database, whether it is built or read.

use super::{
    database::{FARTHEST_M, Frames, MAX_TAGS},
    error::DatabaseError,
    features::FeatureScale,
    root::RootFrame,
};
use crate::skeleton::Skeleton;
use std::collections::HashSet;

/// Checks that no joint is too far from the origin.
pub(super) fn check_joints(skeleton: &Skeleton) -> Result<(), DatabaseError> {
    let is_near = |joint: &glam::Vec3| joint.abs().max_element() <= FARTHEST_M;
    match skeleton.joints().iter().all(is_near) {
        true => Ok(()),
        false => Err(DatabaseError::Content { what: "joints" }),
    }
}

/// Checks that each tag has a bit and a name of its own.
pub(super) fn check_tags(names: &[String]) -> Result<(), DatabaseError> {
    let (expected, found) = (MAX_TAGS, names.len());
    if found > expected {
        return Err(DatabaseError::Count {
            what: "tags or fewer",
            expected,
            found,
        });
    }
    match names.iter().collect::<HashSet<_>>().len() == found {
        true => Ok(()),
        false => Err(DatabaseError::Content {
            what: "names of tags",
        }),
    }
}

/// Checks that all numbers are finite and that no position is too far from the origin.
pub(super) fn check_arrays(frames: &Frames, scale: &FeatureScale, rows: &[f32]) -> Result<(), DatabaseError> {
    // Written so that NaN fails.
    let is_root = |r: &RootFrame| r.position.abs().max_element() <= FARTHEST_M && r.yaw.abs() <= 10.0;
    let is_finite = |values: &[f32]| values.iter().all(|x| x.is_finite());
    let is_near = |v: &glam::Vec3| v.abs().max_element() <= FARTHEST_M;
    let is_rotation = |q: &glam::Quat| q.is_finite() && q.is_normalized();
    let checks = [
        ("root frames", frames.roots.iter().all(is_root)),
        ("positions", frames.hips.iter().all(is_near)),
        ("rotations", frames.rotations.iter().all(is_rotation)),
        ("scales", is_finite(&scale.means) && is_finite(&scale.scales)),
        ("features", is_finite(rows)),
    ];
    match checks.into_iter().find(|(_, is_usable)| !is_usable) {
        None => Ok(()),
        Some((what, _)) => Err(DatabaseError::Content { what }),
    }
}
