//! Determining coordinate frames and rest shapes that the data sets do not state.

use super::sequence::GarmentSequence;
use crate::{
    error::{Error, Result},
    up_axis::to_y_up,
};
use glam::Vec3;
use std::path::Path;
use unic_core::{
    Pose,
    character::{Character, Garment},
    transform::Rigid,
    weights::nearest_body_weights,
};

/// Largest RMS distance of a garment from its skinned rest shape, metres. A garment farther away is
/// not on the body.
const MAX_DISTANCE_M: f32 = 0.5;
/// Number of frames of a sequence that distances are averaged over.
const SAMPLED_FRAMES: usize = 20;

/// Coordinate frame of a garment's positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum CoordinateFrame {
    /// World space, metres, Y up.
    World,
    /// World space, Z up; the number is the unit in metres.
    WorldZUp(f32),
    /// The frame of the root joint, Z up; the number is the unit in metres.
    Root(f32),
}

impl CoordinateFrame {
    /// Candidates for VirtualBones.
    pub(super) const CANDIDATES: [Self; 4] = [
        Self::WorldZUp(1.0),
        Self::WorldZUp(0.1),
        Self::Root(1.0),
        Self::Root(0.1),
    ];

    /// Converts a position to world space, metres, Y up. `root` is `world_from_joint` of the root.
    pub(super) fn world(self, position: Vec3, root: Rigid) -> Vec3 {
        match self {
            Self::World => position,
            Self::WorldZUp(unit) => to_y_up(position * unit),
            // The root's rotation includes the one from Z up to Y up.
            Self::Root(unit) => root.point(position * unit),
        }
    }

    /// Name for notes.
    pub(super) fn name(self) -> String {
        match self {
            Self::World => "world, metres, Y up".into(),
            Self::WorldZUp(unit) => format!("world, units of {unit} m, Z up"),
            Self::Root(unit) => format!("the root joint's frame, units of {unit} m"),
        }
    }
}

/// Returns the coordinate frame in which a sequence is nearest to its skinned garment.
///
/// # Errors
/// A garment that is far from the skinned one in all of them.
pub(super) fn nearest(
    path: &Path,
    frames: &[CoordinateFrame],
    sequence: &GarmentSequence,
    character: &Character,
    garment: &Garment,
) -> Result<CoordinateFrame> {
    let distances = frames
        .iter()
        .map(|&frame| (distance(frame, sequence, character, garment), frame));
    match distances.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((metres, frame)) if metres < MAX_DISTANCE_M => Ok(frame),
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

/// Returns the RMS distance of a garment from its skinned rest shape, metres.
fn distance(
    frame: CoordinateFrame,
    sequence: &GarmentSequence,
    character: &Character,
    garment: &Garment,
) -> f32 {
    let (skeleton, poses) = (&character.skeleton, &sequence.clip.poses);
    let (mut joints, mut transforms, mut skinned) = (Vec::new(), Vec::new(), Vec::new());
    let (mut sum, mut count) = (0.0, 0);
    for t in (0..poses.len()).step_by(poses.len().div_ceil(SAMPLED_FRAMES).max(1)) {
        // Skinning of the rest shape is within decimetres of the garment; a wrong unit or frame is
        // metres away.
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

/// The frame of a motion whose pose is nearest to the bind pose.
pub(super) struct NeutralFrame {
    /// Index of the frame.
    pub(super) frame: usize,
    /// Sum of the angles between the joints' rotations and the bind pose, radians.
    pub(super) rotation: f32,
}

/// Finds the frame whose pose is nearest to the bind pose. The root's rotation does not count.
pub(super) fn nearest_to_bind_pose(character: &Character, poses: &[Pose]) -> NeutralFrame {
    let bind = character.skeleton.bind_pose();
    let root = character.skeleton.root();
    let turned = |pose: &Pose| -> f32 {
        let pairs = pose.local.iter().zip(&bind.local).enumerate();
        pairs
            // Facing and place do not change the shape of the garment.
            .filter(|(j, _)| *j != root)
            .map(|(_, (a, b))| a.angle_between(*b))
            .sum()
    };
    let all = poses.iter().map(turned).enumerate();
    let (frame, rotation) = all
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, f32::INFINITY));
    NeutralFrame { frame, rotation }
}

/// Transforms a garment's world positions back to the bind pose with the weights of the nearest
/// body vertices.
///
/// # Errors
/// A body without vertices.
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
    // Nearest vertices of the posed body, because the garment is around that and not around the
    // bind pose.
    let weights =
        nearest_body_weights(&body, &character.weights, garment).map_err(|source| Error::Weights {
            path: path.to_owned(),
            source,
        })?;
    let back = |(v, x): (usize, &Vec3)| {
        let rotation = weights.rotation(v, &transforms);
        // Skinning is x ↦ R x + t with a blended R; t is the image of the origin.
        let origin = weights.position(v, Vec3::ZERO, &transforms);
        rotation.inverse() * (*x - origin)
    };
    Ok(garment.iter().enumerate().map(back).collect())
}
