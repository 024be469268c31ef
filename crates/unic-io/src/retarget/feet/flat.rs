//! Flattening feet that rest, and their toes.

use super::foot::{Foot, speed, tracks};
use glam::{Quat, Vec3};
use unic_core::leg::shortest_arc;
use unic_core::{clip::Clip, skeleton::Skeleton};

/// Speed of ankle and ball below which a foot rests and is taken to be flat, m/s.
const REST_SPEED: f32 = 0.2;
/// Duration of rest from which the tilt of a foot is corrected, seconds. A shorter rest is too
/// uncertain.
const MIN_REST_SECONDS: f32 = 0.3;

/// Largest tilt that is corrected as a difference between skeletons, radians: 25°. A larger one is
/// a pose.
const MAX_TILT: f32 = 0.44;

/// Height of the ball above its height at rest from which the toes are not changed, metres.
const TOES_FREE_HEIGHT: f32 = 0.08;

/// Rotates a foot by one rotation in all frames, so that it is level in the median over the frames
/// in which it rests.
///
/// Skeletons differ in the ankle's axes when the foot is flat.
pub(super) fn level_foot(clip: &mut Clip, skeleton: &Skeleton, foot: &Foot) {
    let ups = ups_at_rest(clip, skeleton, foot);
    if ups.is_empty() || (ups.len() as f32) < MIN_REST_SECONDS * clip.fps {
        return;
    }
    let joint = foot.leg.ankle;
    let level_up = up_when_flat(skeleton, joint);
    let turn = shortest_arc(level_up, median(&ups).normalize_or(level_up));
    // w is the cosine of half the angle.
    if turn.w.abs() < (0.5 * MAX_TILT).cos() {
        return;
    }
    let locals = clip.poses.iter_mut().map(|pose| &mut pose.local[joint]);
    locals.for_each(|local| *local = (*local * turn).normalize());
}

/// Returns the up direction in the ankle's axes for each frame in which the foot rests.
fn ups_at_rest(clip: &Clip, skeleton: &Skeleton, foot: &Foot) -> Vec<Vec3> {
    let Some(track) = tracks(clip, skeleton, std::slice::from_ref(foot)).pop() else {
        return Vec::new();
    };
    let rests = |t: &usize| {
        let fastest = speed(&track.balls, *t, clip.fps).max(speed(&track.ankles, *t, clip.fps));
        fastest < REST_SPEED
    };
    let mut world = Vec::new();
    let up = |t: usize| {
        skeleton.forward_kinematics(&clip.poses[t], &mut world);
        world[foot.leg.ankle].rotation.inverse() * Vec3::Y
    };
    (0..clip.len()).filter(rests).map(up).collect()
}

/// Returns the median of each component; `vectors` is not empty.
fn median(vectors: &[Vec3]) -> Vec3 {
    Vec3::from_array([0, 1, 2].map(|axis| {
        let mut values: Vec<f32> = vectors.iter().map(|v| v[axis]).collect();
        values.sort_by(f32::total_cmp);
        values[values.len() / 2]
    }))
}

/// Returns the up direction in a joint's axes when the foot is flat, as it is in the bind pose.
fn up_when_flat(skeleton: &Skeleton, joint: usize) -> Vec3 {
    let mut bind = Vec::new();
    skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind);
    bind[joint].rotation.inverse() * Vec3::Y
}

/// Flattens the toes while the ball of the foot is on the ground, fading out with its height.
///
/// Markers hardly record how toes bend, and toes that bend down would sink into the ground.
pub(super) fn flatten_toes(clip: &mut Clip, skeleton: &Skeleton, foot: &Foot) {
    let flat_up = up_when_flat(skeleton, foot.leg.toe);
    let mut world = Vec::new();
    for pose in &mut clip.poses {
        skeleton.forward_kinematics(pose, &mut world);
        let toe = world[foot.leg.toe];
        let height = toe.translation.y - foot.ball_height;
        let laid = shortest_arc(toe.rotation * flat_up, Vec3::Y);
        let share = 1.0 - (height / TOES_FREE_HEIGHT).clamp(0.0, 1.0);
        let by = toe.rotation.inverse() * Quat::IDENTITY.slerp(laid, share) * toe.rotation;
        pose.local[foot.leg.toe] = (pose.local[foot.leg.toe] * by).normalize();
    }
}
