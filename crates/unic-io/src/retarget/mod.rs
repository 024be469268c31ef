//! Transfer of motion from any skeleton to a character.
//!
//! 1. Joints are identified by their names and by the tree. A [`BoneMap`] helps with unknown names.
//! 2. The file's up axis is estimated from the direction of the trunk, and its unit from the length
//!    of the legs.
//! 3. Every bone copies the source's rotation relative to a reference pose in which both bodies
//!    stand. Arms and legs are aligned with the source's first, so that rest poses may differ (T,
//!    A, arms down). Spines of different lengths distribute the rotation.
//! 4. The midpoint of the hips follows the source's, scaled by the ratio of the leg lengths.
//! 5. The result passes a low-pass filter, and standing feet are held: [`LowPass`](crate::LowPass),
//!    [`FootLock`](crate::FootLock).

mod bones;
pub(crate) mod feet;
mod humanoid;
pub(crate) mod low_pass;
mod rig;
mod same_skeleton;
mod smpl_joints;
mod transfer;

pub use bones::BoneMap;
pub use feet::{FootMeasure, legs_of, measure_feet};
pub(crate) use humanoid::bone_map;
pub(crate) use same_skeleton::{FileUnit, ReferenceJoint, SameSkeleton};
pub use smpl_joints::smpl_joints;

use crate::{
    bvh::Bvh,
    error::{Error, Result},
    joint_names::{BodySide, LimbJoint},
    up_axis::{UpAxis, uncertain_note, y_up_from_z_up},
};
use bones::{BodyJoints, JointTree};
use glam::{Quat, Vec3};
use rig::{ReferenceOrigin, ReferenceRig, mean_trunk};
use std::path::Path;
use transfer::Transfer;
use unic_core::{Pose, character::Character, clip::Clip, skeleton::Skeleton, transform::Rigid};
use unic_scene::Up;

/// Length of an adult's leg from hip to ankle, metres.
const LEG_M: f32 = 0.84;

/// Units that files come in: name and length in metres.
const UNITS: [(&str, f32); 6] = [
    ("metres", 1.0),
    ("decimetres", 0.1),
    ("CMU's 1/0.45 inches", 0.0254 / 0.45),
    ("inches", 0.0254),
    ("centimetres", 0.01),
    ("millimetres", 0.001),
];

/// Smallest cosine of the angle between mean trunk and up axis for a certain estimate: 45°.
const MIN_UP_COSINE: f32 = 0.7;

/// Note of a converted file.
const Z_UP_CONVERTED: &str = "Z up converted to Y up";

/// Motion on a character, with the conversions that made it.
#[derive(Clone, Debug)]
pub(crate) struct Retargeted {
    pub(crate) clip: Clip,
    /// Descriptions of the conversions, one sentence each.
    pub(crate) notes: Vec<String>,
}

/// Skeleton, reference pose and up axis of a file, independent of any character.
#[derive(Clone, Debug)]
pub(crate) struct RetargetSource {
    rig: ReferenceRig,
    world_from_source: Quat,
    pub(crate) notes: Vec<String>,
}

impl RetargetSource {
    /// Analyses a file of at least two frames; `path` is used in errors only.
    ///
    /// # Errors
    /// Fewer than two frames, joints that cannot be identified, legs without a length.
    pub(crate) fn new(path: &Path, bvh: &Bvh, map: &BoneMap, up: UpAxis) -> Result<Self> {
        if bvh.len() < 2 {
            return Err(Error::content(path, "at least two frames", bvh.len().to_string()));
        }
        let tree = JointTree {
            path,
            names: bvh.joints().iter().map(|j| j.name.as_str()).collect(),
            parents: bvh.joints().iter().map(|j| j.parent).collect(),
        };
        let bones = BodyJoints::identify(&tree, map)?;
        let mut notes = vec![format!("joints named as by {}", bones.convention)];
        // The up axis comes first: a reference frame needs the direction against gravity.
        let world_from_source = y_up(mean_trunk(bvh, &bones)?, up, &mut notes);
        let rig = ReferenceRig::of_bvh(bvh, bones, world_from_source.inverse() * Vec3::Y)?;
        if let ReferenceOrigin::Frame(frame) = rig.origin {
            notes.push(format!(
                "the body does not stand in the zero pose: frame {frame} stands for it"
            ));
        }
        let leg = rig.leg_length();
        // The scale divides by this length. The negation also refuses NaN.
        if !(leg.is_finite() && leg > f32::MIN_POSITIVE) {
            return Err(Error::content(path, "legs with a length", leg.to_string()));
        }
        notes.push(unit_note(leg));
        Ok(Self {
            rig,
            world_from_source,
            notes,
        })
    }

    /// Returns whether the body stands when all rotations are zero.
    pub(crate) fn stands_in_zero_pose(&self) -> bool {
        self.rig.origin == ReferenceOrigin::ZeroPose
    }

    /// Rotation from the file's axes to Y up.
    pub(crate) fn world_from_source(&self) -> Quat {
        self.world_from_source
    }

    /// Transfers the motion to a character: one pose for each frame of the file.
    ///
    /// # Errors
    /// A character whose joints cannot be identified, positions that overflow.
    pub(crate) fn on(&self, path: &Path, bvh: &Bvh, character: &Character) -> Result<Retargeted> {
        let skeleton = &character.skeleton;
        let target = ReferenceRig::of_skeleton(skeleton)?;
        let transfer = Transfer::new(skeleton, &self.rig, &target, self.world_from_source);
        let mut notes = self.notes.clone();
        notes.push(format!(
            "scaled by {:.4}, the ratio of the legs, to this body",
            transfer.scale
        ));
        let mut scratch = Vec::new();
        let poses: Result<Vec<_>> = (0..bvh.len())
            .map(|frame| transfer.pose(bvh, frame, &mut scratch))
            .collect();
        let clip = checked_clip(path, bvh, poses?)?;
        Ok(Retargeted { clip, notes })
    }
}

/// Takes the motion of a file as it is, if the joints of its zero pose are the character's: in one unit or
/// another, Y up after the rotation `turn`.
///
/// # Errors
/// Positions that overflow.
pub(crate) fn on_same_skeleton(
    path: &Path,
    bvh: &Bvh,
    turn: Quat,
    skeleton: &Skeleton,
) -> Result<Option<Retargeted>> {
    let turned = |joint: &Rigid| Rigid::new(turn * joint.rotation * turn.inverse(), turn * joint.translation);
    let mut world = Vec::new();
    bvh.world_from_joint_at_zero(&mut world);
    let joints: Vec<ReferenceJoint<'_>> = (bvh.joints().iter().zip(&world))
        .map(|(joint, place)| ReferenceJoint {
            name: &joint.name,
            place: turn * place.translation,
        })
        .collect();
    let zero = Pose::from_axis_angles(Vec3::ZERO, &vec![Vec3::ZERO; skeleton.len()]);
    let Some(same) = SameSkeleton::find(&joints, FileUnit::Unknown, skeleton, &zero) else {
        return Ok(None);
    };
    let pose = |frame: usize| {
        bvh.world_from_joint(frame, &mut world);
        let world: Vec<Rigid> = world.iter().map(turned).collect();
        same.pose(&world)
    };
    let clip = checked_clip(path, bvh, (0..bvh.len()).map(pose).collect())?;
    let notes = vec![format!(
        "the joints are the character's: the motion is taken as it is, scaled by {:.4}",
        same.metres_per_unit
    )];
    Ok(Some(Retargeted { clip, notes }))
}

/// [`on_same_skeleton`] for joints whose names do not tell which way the body stands: with the axis that
/// `up` states, else with the one at which the joints are the character's.
///
/// # Errors
/// Positions that overflow.
pub(crate) fn on_same_unnamed_skeleton(
    path: &Path,
    bvh: &Bvh,
    up: UpAxis,
    skeleton: &Skeleton,
) -> Result<Option<Retargeted>> {
    for axis in [Up::Y, Up::Z] {
        if up.stated().is_some_and(|stated| stated != axis) {
            continue;
        }
        let (turn, note) = match axis {
            Up::Y => (Quat::IDENTITY, None),
            Up::Z => (y_up_from_z_up(), Some(Z_UP_CONVERTED.to_owned())),
        };
        if let Some(mut taken) = on_same_skeleton(path, bvh, turn, skeleton)? {
            taken.notes.splice(..0, note);
            return Ok(Some(taken));
        }
    }
    Ok(None)
}

/// Makes a clip that is named like its file.
///
/// # Errors
/// Positions that overflow: huge numbers in a file are more than f32 holds.
fn checked_clip(path: &Path, bvh: &Bvh, poses: Vec<Pose>) -> Result<Clip> {
    if let Some(frame) = poses.iter().position(|p| !p.is_valid()) {
        let found = format!("others in frame {frame}");
        return Err(Error::content(path, "positions that a body can take", found));
    }
    let name = path.file_stem().unwrap_or_default();
    Ok(Clip {
        name: name.to_string_lossy().into_owned(),
        fps: bvh.fps(),
        poses,
        ground_height: 0.0,
        wind: Vec::new(),
    })
}

/// Largest sine of the angle between the upper arms and the line across the shoulders in a T-pose:
/// 27°.
const MAX_T_POSE_SINE: f32 = 0.45;

/// Returns whether a skeleton stands in the T-pose when all rotations are zero; `None` if its joints
/// are not identified, or no body that stands.
pub(crate) fn stands_in_t_pose(skeleton: &Skeleton) -> Option<bool> {
    let rig = ReferenceRig::of_skeleton(skeleton)
        .ok()
        .filter(ReferenceRig::stands)?;
    let across = rig.facing * Vec3::X;
    Some(BodySide::ALL.into_iter().all(|side| {
        let arm = rig.direction(LimbJoint::Shoulder, LimbJoint::Elbow, side);
        arm.cross(across).length() < MAX_T_POSE_SINE
    }))
}

/// Returns `world_from_source` for the requested up axis, or for the one that the trunk follows on
/// average.
fn y_up(trunk: Vec3, up: UpAxis, notes: &mut Vec<String>) -> Quat {
    // Only Y and Z are in use.
    let is_z = match up {
        UpAxis::Auto => trunk.z > trunk.y,
        UpAxis::Y => false,
        UpAxis::Z => true,
    };
    let along = if is_z { trunk.z } else { trunk.y };
    if up == UpAxis::Auto && along < MIN_UP_COSINE {
        notes.push(uncertain_note(is_z));
    }
    if !is_z {
        return Quat::IDENTITY;
    }
    notes.push(Z_UP_CONVERTED.into());
    y_up_from_z_up()
}

/// Note about the probable unit of a file whose legs have this length. The motion is scaled by the
/// ratio of the legs, independent of the unit.
fn unit_note(leg: f32) -> String {
    // Logarithms, so that half and double the usual length are equally far off.
    let off = |unit: f32| (leg * unit / LEG_M).ln().abs();
    let nearest = UNITS.iter().min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    let (name, unit) = nearest.unwrap_or(&UNITS[0]);
    format!(
        "the unit is taken to be {name}: legs of {leg:.4} are {:.2} m",
        leg * unit
    )
}
