//! Mirrored clips: left and right exchanged.

use crate::{
    clip::Clip,
    skeleton::{Pose, Skeleton},
};
use glam::{Quat, Vec3};

/// Mirrors a clip at the plane x = 0. `swap` is the joint on the other side, for each joint.
///
/// With M the reflection, a joint's rotation becomes M R M of its counterpart. That holds for
/// skeletons whose bind pose is symmetric.
pub(super) fn mirrored_clip(clip: &Clip, skeleton: &Skeleton, swap: &[usize]) -> Clip {
    let root = skeleton.joints()[skeleton.root()];
    let pose = |pose: &Pose| Pose {
        // The world position of the root joint is mirrored, and its bind position may be off the
        // plane.
        trans: mirrored(root + pose.trans) - root,
        local: swap.iter().map(|&j| mirrored_rotation(pose.local[j])).collect(),
    };
    Clip {
        name: clip.name.clone(),
        fps: clip.fps,
        poses: clip.poses.iter().map(pose).collect(),
        ground_height: clip.ground_height,
        wind: clip.wind.iter().map(|w| mirrored(*w)).collect(),
    }
}

fn mirrored(v: Vec3) -> Vec3 {
    Vec3::new(-v.x, v.y, v.z)
}

fn mirrored_rotation(q: Quat) -> Quat {
    Quat::from_xyzw(q.x, -q.y, -q.z, q.w)
}
