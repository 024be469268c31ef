//! The feet of a character and their way through a clip.

use crate::retarget::{
    bones::{BoneMap, Bones, Tree},
    leg::Leg,
    names::{Part, Side},
};
use glam::Vec3;
use std::path::Path;
use unic_core::{character::Character, clip::Clip, skeleton::Skeleton};

/// One foot of a character.
pub(super) struct Foot {
    pub(super) leg: Leg,
    /// Heights of the joints above the sole when the foot is flat, metres.
    pub(super) ball_height: f32,
    pub(super) ankle_height: f32,
}

/// World positions of one foot, a frame each.
pub(super) struct Track {
    pub(super) balls: Vec<Vec3>,
    pub(super) ankles: Vec<Vec3>,
}

/// Both feet, or `None` when the joints have no names that tell which they are.
pub(super) fn feet_of(character: &Character) -> Option<Vec<Foot>> {
    let skeleton = &character.skeleton;
    let tree = Tree {
        path: Path::new("character"),
        names: skeleton.names().iter().map(String::as_str).collect(),
        parents: skeleton.parents().to_vec(),
    };
    let bones = Bones::identify(&tree, &BoneMap::default()).ok()?;
    let sole = character.body.vertices.iter().map(|v| v.y).reduce(f32::min)?;
    let foot = |side: Side| {
        let joint = |part: Part| bones.limb(part, side);
        let leg = Leg {
            hip: joint(Part::Hip)?,
            knee: joint(Part::Knee)?,
            ankle: joint(Part::Ankle)?,
            toe: joint(Part::Toe)?,
        };
        Some(Foot {
            ball_height: skeleton.joints()[leg.toe].y - sole,
            ankle_height: skeleton.joints()[leg.ankle].y - sole,
            leg,
        })
    };
    Side::ALL.map(foot).into_iter().collect()
}

/// The way of each foot through the clip.
pub(super) fn tracks(clip: &Clip, skeleton: &Skeleton, feet: &[Foot]) -> Vec<Track> {
    let mut world = Vec::new();
    let empty = || Track {
        balls: Vec::with_capacity(clip.len()),
        ankles: Vec::with_capacity(clip.len()),
    };
    let mut tracks: Vec<Track> = feet.iter().map(|_| empty()).collect();
    for pose in &clip.poses {
        skeleton.forward_kinematics(pose, &mut world);
        for (track, foot) in tracks.iter_mut().zip(feet) {
            track.balls.push(world[foot.leg.toe].translation);
            track.ankles.push(world[foot.leg.ankle].translation);
        }
    }
    tracks
}

/// Speed by central differences, one-sided at the ends, m/s.
pub(super) fn speed(track: &[Vec3], frame: usize, fps: f32) -> f32 {
    let (before, after) = (frame.saturating_sub(1), (frame + 1).min(track.len() - 1));
    track[after].distance(track[before]) * fps / (after - before).max(1) as f32
}
