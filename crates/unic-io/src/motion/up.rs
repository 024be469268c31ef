//! The up axis of a motion file, which files do not state.

use super::UpAxis;
use glam::{Quat, Vec3};
use std::f32::consts::FRAC_PI_2;
use unic_core::{clip::Clip, skeleton::Skeleton};

/// Frames looked at to guess the up axis.
const FRAMES_LOOKED_AT: usize = 500;

/// The mean up direction of a body that stands, walks or crouches is at least this long along the
/// axis, and this many times longer than along the other.
const CERTAIN: f32 = 0.5;
const CERTAIN_RATIO: f32 = 2.0;

/// What was done to a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turned {
    /// Nothing.
    No,
    /// Z up became Y up.
    FromZ,
}

/// Brings a clip to Y up and says so.
pub(super) fn to_y_up(clip: &mut Clip, skeleton: &Skeleton, up: UpAxis, notes: &mut Vec<String>) -> Turned {
    let from_z = match up {
        UpAxis::Y => false,
        UpAxis::Z => true,
        UpAxis::Auto => guess_is_z(clip, skeleton, notes),
    };
    if !from_z {
        return Turned::No;
    }
    turn(clip, skeleton);
    notes.push("Z up converted to Y up".into());
    Turned::FromZ
}

fn guess_is_z(clip: &Clip, skeleton: &Skeleton, notes: &mut Vec<String>) -> bool {
    let up = mean_up(clip, skeleton);
    let is_z = up.z > up.y;
    let (along, across) = if is_z {
        (up.z, up.y.abs())
    } else {
        (up.y, up.z.abs())
    };
    if along < CERTAIN || along < CERTAIN_RATIO * across {
        let (axis, other) = if is_z { ("Z", "Y") } else { ("Y", "Z") };
        notes.push(format!(
            "the up axis is uncertain, because the body does not stand for most of the clip: \
             {axis} is assumed, ask for {other} up if the character lies on the ground"
        ));
    }
    is_z
}

/// Mean unit vector from the root to the head.
fn mean_up(clip: &Clip, skeleton: &Skeleton) -> Vec3 {
    let (root, head) = (skeleton.root(), head(skeleton));
    let stride = clip.len().div_ceil(FRAMES_LOOKED_AT).max(1);
    let mut joints = Vec::new();
    let sum: Vec3 = (clip.poses.iter().step_by(stride))
        .map(|pose| {
            skeleton.forward_kinematics(pose, &mut joints);
            (joints[head].translation - joints[root].translation).normalize_or_zero()
        })
        .sum();
    sum.normalize_or_zero() * (sum.length() / clip.poses.len().div_ceil(stride).max(1) as f32)
}

/// The joint called `head`, else the highest of the bind pose.
fn head(skeleton: &Skeleton) -> usize {
    let heights = || skeleton.joints().iter().map(|j| j.y).enumerate();
    let highest = || heights().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(j, _)| j);
    (skeleton.joint("head").or_else(highest)).unwrap_or_else(|| skeleton.root())
}

/// R is −90° about x: (x, y, z) ↦ (x, z, −y).
///
/// SMPL's translation is not the root's position, which stands J₀ further: that point turns.
pub(crate) fn turn(clip: &mut Clip, skeleton: &Skeleton) {
    let y_up_from_z_up = Quat::from_rotation_x(-FRAC_PI_2);
    let root = skeleton.root();
    let origin = skeleton.joints()[root];
    for pose in &mut clip.poses {
        let p = pose.trans + origin;
        // Written out: the quaternion's own rounding would tilt long walks.
        pose.trans = Vec3::new(p.x, p.z, -p.y) - origin;
        pose.local[root] = (y_up_from_z_up * pose.local[root]).normalize();
    }
    for wind in &mut clip.wind {
        *wind = Vec3::new(wind.x, wind.z, -wind.y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_core::skeleton::{Pose, SkeletonParts};

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
    fn a_standing_body_tells_the_axis() {
        let mut notes = Vec::new();
        assert!(!guess_is_z(&clip(Vec3::Y), &spine(), &mut notes));
        assert!(guess_is_z(&clip(Vec3::X * FRAC_PI_2), &spine(), &mut notes));
        assert!(notes.is_empty());
        guess_is_z(&clip(Vec3::Z * FRAC_PI_2), &spine(), &mut notes);
        assert_eq!(notes.len(), 1);
    }

    #[test]
    fn the_root_joint_turns_and_not_its_translation() {
        let mut turned = clip(Vec3::X * FRAC_PI_2);
        let mut joints = Vec::new();
        spine().forward_kinematics(&turned.poses[0], &mut joints);
        let before = joints[0].translation;
        turn(&mut turned, &spine());
        spine().forward_kinematics(&turned.poses[0], &mut joints);
        let expected = Vec3::new(before.x, before.z, -before.y);
        assert!((joints[0].translation - expected).length() < 1e-6);
        assert!((joints[2].translation - expected - Vec3::Y * 0.6).length() < 1e-6);
    }
}
