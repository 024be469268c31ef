//! Estimating the up axis of a motion npz, which the file does not state.

use crate::up_axis::{UpAxis, turn_to_y_up, uncertain_note};
use glam::Vec3;
use unic_core::{clip::Clip, skeleton::Skeleton};

/// Number of frames that the up axis is estimated from.
const SAMPLED_FRAMES: usize = 500;

/// Smallest component of the mean up direction along its axis for a certain estimate. Bodies that
/// stand, walk or crouch exceed it.
const MIN_COMPONENT: f32 = 0.5;
/// Smallest ratio of that component to the one along the other axis for a certain estimate.
const MIN_RATIO: f32 = 2.0;

/// Conversion of a clip's up axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum UpConversion {
    /// The clip has Y up already.
    None,
    /// Z up was rotated to Y up.
    FromZ,
}

/// Converts a clip to Y up, with a note.
pub(super) fn convert_to_y_up(
    clip: &mut Clip,
    skeleton: &Skeleton,
    up: UpAxis,
    notes: &mut Vec<String>,
) -> UpConversion {
    let from_z = match up {
        UpAxis::Y => false,
        UpAxis::Z => true,
        UpAxis::Auto => guess_is_z(clip, skeleton, notes),
    };
    if !from_z {
        return UpConversion::None;
    }
    turn_to_y_up(clip, skeleton);
    notes.push("Z up converted to Y up".into());
    UpConversion::FromZ
}

/// Returns whether the body's up direction follows Z rather than Y on average.
fn guess_is_z(clip: &Clip, skeleton: &Skeleton, notes: &mut Vec<String>) -> bool {
    let up = mean_up(clip, skeleton);
    let is_z = up.z > up.y;
    let (along, across) = if is_z {
        (up.z, up.y.abs())
    } else {
        (up.y, up.z.abs())
    };
    if along < MIN_COMPONENT || along < MIN_RATIO * across {
        notes.push(uncertain_note(is_z));
    }
    is_z
}

/// Returns the mean over frames of the unit vector from the root to the head.
fn mean_up(clip: &Clip, skeleton: &Skeleton) -> Vec3 {
    let (root, head) = (skeleton.root(), head(skeleton));
    let stride = clip.len().div_ceil(SAMPLED_FRAMES).max(1);
    let mut joints = Vec::new();
    let sum: Vec3 = (clip.poses.iter().step_by(stride))
        .map(|pose| {
            skeleton.forward_kinematics(pose, &mut joints);
            // Root to head points up while the body stands, walks or crouches.
            (joints[head].translation - joints[root].translation).normalize_or_zero()
        })
        .sum();
    // The length of the mean, from 0 to 1, is the certainty: directions that differ cancel.
    sum.normalize_or_zero() * (sum.length() / clip.poses.len().div_ceil(stride).max(1) as f32)
}

/// Returns the joint called `head`, else the highest joint of the bind pose.
fn head(skeleton: &Skeleton) -> usize {
    let heights = || skeleton.joints().iter().map(|j| j.y).enumerate();
    let highest = || heights().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(j, _)| j);
    // The bind pose of a character is Y up, so that its highest joint is near the head.
    (skeleton.joint("head").or_else(highest)).unwrap_or_else(|| skeleton.root())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;
    use unic_core::{Pose, skeleton::SkeletonParts};

    fn spine() -> Skeleton {
        Skeleton::new(SkeletonParts {
            names: ["pelvis", "spine", "head"].map(String::from).to_vec(),
            parents: vec![-1, 0, 1],
            joints: vec![Vec3::Y, Vec3::Y * 1.3, Vec3::Y * 1.6],
            rest_pose: vec![],
        })
        .unwrap()
    }

    fn clip(root: Vec3) -> Clip {
        let pose = Pose::from_axis_angles(Vec3::new(1.0, 2.0, 3.0), &[root, Vec3::ZERO, Vec3::ZERO]);
        Clip {
            name: "a".into(),
            fps: 30.0,
            poses: vec![pose; 10],
            ground_height: 0.0,
            wind: Vec::new(),
        }
    }

    #[test]
    fn up_axis_follows_a_standing_body() {
        let mut notes = Vec::new();
        assert!(!guess_is_z(&clip(Vec3::Y), &spine(), &mut notes));
        assert!(guess_is_z(&clip(Vec3::X * FRAC_PI_2), &spine(), &mut notes));
        assert!(notes.is_empty());
        guess_is_z(&clip(Vec3::Z * FRAC_PI_2), &spine(), &mut notes);
        assert_eq!(notes.len(), 1);
    }

    #[test]
    fn conversion_rotates_the_position_of_the_root_joint() {
        let mut turned = clip(Vec3::X * FRAC_PI_2);
        let mut joints = Vec::new();
        spine().forward_kinematics(&turned.poses[0], &mut joints);
        let before = joints[0].translation;
        turn_to_y_up(&mut turned, &spine());
        spine().forward_kinematics(&turned.poses[0], &mut joints);
        let expected = Vec3::new(before.x, before.z, -before.y);
        assert!((joints[0].translation - expected).length() < 1e-6);
        assert!((joints[2].translation - expected - Vec3::Y * 0.6).length() < 1e-6);
    }
}
