//! The feet of a character and their positions through a clip.

use crate::{
    joint_names::{BodySide, LimbJoint},
    retarget::bones::{BodyJoints, BoneMap, JointTree},
};
use glam::Vec3;
use std::path::Path;
use unic_core::{character::Character, clip::Clip, leg::Leg, skeleton::Skeleton};

/// One foot of a character.
pub(super) struct Foot {
    pub(super) leg: Leg,
    /// Height of the ball's joint above the sole when the foot is flat, metres.
    pub(super) ball_height: f32,
    /// Height of the ankle above the sole when the foot is flat, metres.
    pub(super) ankle_height: f32,
}

/// World positions of one foot's joints in each frame, metres.
pub(super) struct FootTrack {
    pub(super) balls: Vec<Vec3>,
    pub(super) ankles: Vec<Vec3>,
}

/// Returns both feet; `None` if the joint names do not identify them.
pub(super) fn feet_of(character: &Character) -> Option<Vec<Foot>> {
    let skeleton = &character.skeleton;
    // The lowest vertex of the bind pose, in which feet are flat.
    let sole = character.body.vertices.iter().map(|v| v.y).reduce(f32::min)?;
    let foot = |leg: Leg| Foot {
        ball_height: skeleton.joints()[leg.toe].y - sole,
        ankle_height: skeleton.joints()[leg.ankle].y - sole,
        leg,
    };
    Some(legs_of(skeleton)?.map(foot).into())
}

/// Finds the joints of the left and of the right leg by their names; `None` if the names do not
/// identify them.
pub fn legs_of(skeleton: &Skeleton) -> Option<[Leg; 2]> {
    let tree = JointTree {
        path: Path::new("character"),
        names: skeleton.names().iter().map(String::as_str).collect(),
        parents: skeleton.parents().to_vec(),
    };
    let bones = BodyJoints::identify(&tree, &BoneMap::default()).ok()?;
    let leg = |side: BodySide| {
        let joint = |part: LimbJoint| bones.limb(part, side);
        Some(Leg {
            hip: joint(LimbJoint::Hip)?,
            knee: joint(LimbJoint::Knee)?,
            ankle: joint(LimbJoint::Ankle)?,
            toe: joint(LimbJoint::Toe)?,
        })
    };
    let [left, right] = BodySide::ALL.map(leg);
    Some([left?, right?])
}

/// Computes the positions of each foot through a clip.
pub(super) fn tracks(clip: &Clip, skeleton: &Skeleton, feet: &[Foot]) -> Vec<FootTrack> {
    let mut world = Vec::new();
    let empty = || FootTrack {
        balls: Vec::with_capacity(clip.len()),
        ankles: Vec::with_capacity(clip.len()),
    };
    let mut tracks: Vec<FootTrack> = feet.iter().map(|_| empty()).collect();
    for pose in &clip.poses {
        skeleton.forward_kinematics(pose, &mut world);
        for (track, foot) in tracks.iter_mut().zip(feet) {
            track.balls.push(world[foot.leg.toe].translation);
            track.ankles.push(world[foot.leg.ankle].translation);
        }
    }
    tracks
}

/// Returns the speed at a frame by central differences, one-sided at the ends, m/s.
pub(super) fn speed(track: &[Vec3], frame: usize, fps: f32) -> f32 {
    // Central differences are symmetric: forward ones would start a phase a frame late.
    let (before, after) = (frame.saturating_sub(1), (frame + 1).min(track.len() - 1));
    track[after].distance(track[before]) * fps / (after - before).max(1) as f32
}
