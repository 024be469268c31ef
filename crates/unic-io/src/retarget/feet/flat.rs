//! Feet that rest are flat, and so are their toes.

use super::foot::{Foot, speed, tracks};
use crate::retarget::transfer::swing;
use glam::{Quat, Vec3};
use unic_core::{clip::Clip, skeleton::Skeleton};

/// Below this speed of ankle and ball a foot is taken to be flat, m/s, and this long it must be so
/// before its tilt is believed, seconds.
const FLAT_SPEED: f32 = 0.2;
const FLAT_SECONDS: f32 = 0.3;

/// Largest tilt that is a difference between skeletons and no pose, radians: 25°.
const MOST_TILT: f32 = 0.44;

/// Height of the ball above its height at rest from which toes are left alone, metres.
const TOES_FREE: f32 = 0.08;

/// Turns a foot by one rotation in all frames, so that it is level in the median over those in which
/// it rests: skeletons differ in where the ankle's axes lie when the foot is flat.
pub(super) fn level(clip: &mut Clip, skeleton: &Skeleton, foot: &Foot) {
    let ups = ups_at_rest(clip, skeleton, foot);
    if ups.is_empty() || (ups.len() as f32) < FLAT_SECONDS * clip.fps {
        return;
    }
    let joint = foot.leg.ankle;
    let level_up = up_when_flat(skeleton, joint);
    let turn = swing(level_up, median(&ups).normalize_or(level_up));
    if turn.w.abs() < (0.5 * MOST_TILT).cos() {
        return;
    }
    let locals = clip.poses.iter_mut().map(|pose| &mut pose.local[joint]);
    locals.for_each(|local| *local = (*local * turn).normalize());
}

/// Up in the ankle's own axes, in each frame in which the foot rests.
fn ups_at_rest(clip: &Clip, skeleton: &Skeleton, foot: &Foot) -> Vec<Vec3> {
    let Some(track) = tracks(clip, skeleton, std::slice::from_ref(foot)).pop() else {
        return Vec::new();
    };
    let rests = |t: &usize| {
        let fastest = speed(&track.balls, *t, clip.fps).max(speed(&track.ankles, *t, clip.fps));
        fastest < FLAT_SPEED
    };
    let mut world = Vec::new();
    let up = |t: usize| {
        skeleton.forward_kinematics(&clip.poses[t], &mut world);
        world[foot.leg.ankle].rotation.inverse() * Vec3::Y
    };
    (0..clip.len()).filter(rests).map(up).collect()
}

/// Component by component, of at least one vector.
fn median(vectors: &[Vec3]) -> Vec3 {
    Vec3::from_array([0, 1, 2].map(|axis| {
        let mut values: Vec<f32> = vectors.iter().map(|v| v[axis]).collect();
        values.sort_by(f32::total_cmp);
        values[values.len() / 2]
    }))
}

/// Up in a joint's own axes when the foot is flat, as it is in the bind pose.
fn up_when_flat(skeleton: &Skeleton, joint: usize) -> Vec3 {
    let mut bind = Vec::new();
    skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind);
    bind[joint].rotation.inverse() * Vec3::Y
}

/// Toes lie on the ground while the ball is on it, and are as they were once it is
/// [`TOES_FREE`] above: markers hardly tell how toes bend, and bent down they would sink.
pub(super) fn lay_toes(clip: &mut Clip, skeleton: &Skeleton, foot: &Foot) {
    let flat_up = up_when_flat(skeleton, foot.leg.toe);
    let mut world = Vec::new();
    for pose in &mut clip.poses {
        skeleton.forward_kinematics(pose, &mut world);
        let toe = world[foot.leg.toe];
        let height = toe.translation.y - foot.ball_height;
        let laid = swing(toe.rotation * flat_up, Vec3::Y);
        let share = 1.0 - (height / TOES_FREE).clamp(0.0, 1.0);
        let by = toe.rotation.inverse() * Quat::IDENTITY.slerp(laid, share) * toe.rotation;
        pose.local[foot.leg.toe] = (pose.local[foot.leg.toe] * by).normalize();
    }
}
