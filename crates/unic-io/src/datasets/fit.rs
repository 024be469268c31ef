//! What the data sets leave unsaid, told by what lies nearest to the skinned garment.

use super::{sequence::Sequence, virtual_bones::y_up};
use crate::error::{Error, Result};
use glam::Vec3;
use std::path::Path;
use unic_core::{
    character::{Character, Garment},
    skeleton::Pose,
    transform::Rigid,
    weights::nearest_body_weights,
};

/// A garment farther than this from its skinned rest shape is not on the body, metres, RMS.
const FAR_M: f32 = 0.5;
/// Frames of a sequence that are looked at.
const FRAMES: usize = 20;

/// Which numbers a garment's positions are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Frame {
    /// World, metres, Y up.
    World,
    /// World, so many metres a unit, Z up.
    WorldZUp(f32),
    /// From the root joint and turned with it, so many metres a unit, Z up.
    Root(f32),
}

impl Frame {
    /// Of which one is found for VirtualBones.
    pub(super) const UNSAID: [Self; 4] = [
        Self::WorldZUp(1.0),
        Self::WorldZUp(0.1),
        Self::Root(1.0),
        Self::Root(0.1),
    ];

    /// World position, metres, Y up, of a character whose root joint is at `root`.
    pub(super) fn world(self, position: Vec3, root: Rigid) -> Vec3 {
        match self {
            Self::World => position,
            Self::WorldZUp(unit) => y_up(position * unit),
            // The root's rotation already turns what is Z up.
            Self::Root(unit) => root.point(position * unit),
        }
    }

    pub(super) fn name(self) -> String {
        match self {
            Self::World => "world, metres, Y up".into(),
            Self::WorldZUp(unit) => format!("world, units of {unit} m, Z up"),
            Self::Root(unit) => format!("the root joint's frame, units of {unit} m"),
        }
    }
}

/// The one of `frames` in which a sequence is nearest to its skinned garment.
pub(super) fn nearest(
    path: &Path,
    frames: &[Frame],
    sequence: &Sequence,
    character: &Character,
    garment: &Garment,
) -> Result<Frame> {
    let distances = frames
        .iter()
        .map(|&frame| (distance(frame, sequence, character, garment), frame));
    match distances.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((metres, frame)) if metres < FAR_M => Ok(frame),
        found => {
            let metres = found.map_or(f32::INFINITY, |f| f.0);
            let expected = "a garment on the character in its motion (is it the data set's own body?)";
            Err(Error::content(
                path,
                expected,
                format!("one that is {metres:.2} m off"),
            ))
        }
    }
}

/// RMS distance of a garment from its skinned rest shape, metres.
fn distance(frame: Frame, sequence: &Sequence, character: &Character, garment: &Garment) -> f32 {
    let (skeleton, poses) = (&character.skeleton, &sequence.clip.poses);
    let (mut joints, mut transforms, mut skinned) = (Vec::new(), Vec::new(), Vec::new());
    let (mut sum, mut count) = (0.0, 0);
    for t in (0..poses.len()).step_by(poses.len().div_ceil(FRAMES).max(1)) {
        skeleton.forward_kinematics(&poses[t], &mut joints);
        skeleton.world_from_rest(&joints, &mut transforms);
        garment
            .weights
            .skin(&garment.rest.vertices, &transforms, &mut skinned);
        let root = joints[skeleton.root()];
        let pairs = sequence.garment[t].iter().zip(&skinned);
        sum += pairs
            .map(|(&x, s)| frame.world(x, root).distance_squared(*s))
            .sum::<f32>();
        count += skinned.len();
    }
    (sum / count.max(1) as f32).sqrt()
}

/// The frame of a motion whose pose is nearest to the bind pose, and how far its joints are turned in all.
pub(super) fn calmest(character: &Character, poses: &[Pose]) -> (usize, f32) {
    let bind = character.skeleton.bind_pose();
    let root = character.skeleton.root();
    let turned = |pose: &Pose| -> f32 {
        let pairs = pose.local.iter().zip(&bind.local).enumerate();
        pairs
            .filter(|(j, _)| *j != root)
            .map(|(_, (a, b))| a.angle_between(*b))
            .sum()
    };
    let all = poses.iter().map(turned).enumerate();
    all.min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, f32::INFINITY))
}

/// A garment's world positions carried back to the bind pose by the joints of the nearest body vertices.
pub(super) fn unposed(
    path: &Path,
    character: &Character,
    pose: &Pose,
    garment: &[Vec3],
) -> Result<Vec<Vec3>> {
    let skeleton = &character.skeleton;
    let (mut joints, mut transforms, mut body) = (Vec::new(), Vec::new(), Vec::new());
    skeleton.forward_kinematics(pose, &mut joints);
    skeleton.world_from_rest(&joints, &mut transforms);
    character
        .weights
        .skin(&character.body.vertices, &transforms, &mut body);
    let weights =
        nearest_body_weights(&body, &character.weights, garment).map_err(|source| Error::Weights {
            path: path.to_owned(),
            source,
        })?;
    let back = |(v, x): (usize, &Vec3)| {
        let rotation = weights.rotation(v, &transforms);
        // Where skinning would leave the world's origin: the blend is affine.
        let origin = weights.position(v, Vec3::ZERO, &transforms);
        rotation.inverse() * (*x - origin)
    };
    Ok(garment.iter().enumerate().map(back).collect())
}
