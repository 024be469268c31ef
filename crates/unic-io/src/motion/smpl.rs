//! Motion in SMPL's order for characters of another skeleton, or of another zero pose.

use super::{
    arrays::{MotionArrays, numbers_a_frame},
    joints::{JointTarget, is_in_smpl_terms},
    layout::PoseLayout,
    options::MotionOptions,
    up,
};
use crate::{
    bvh::{Bvh, RestJoint},
    error::{Error, Result},
    finding::Finding,
    joint_names::{ARRAY_NAME as JOINT_NAMES, BodySide, LimbJoint},
    npz::Npz,
    retarget::{RetargetSource, Retargeted, stands_in_t_pose},
    up_axis::{UpAxis, y_up_from_z_up},
};
use glam::{Quat, Vec3};
use std::path::Path;
use unic_core::{
    character::Character,
    clip::Clip,
    skeleton::{ADULT_JOINTS, SMPL_JOINT_NAMES, SMPL_PARENTS, Skeleton, SkeletonParts},
    transform::Rigid,
};

/// Length from wrist to knuckles as a share of the forearm.
const HAND_SHARE: f32 = 0.35;

/// Reads motion in SMPL's order if the character cannot take its rotations as they are: it has
/// other joints, or does not stand in the T-pose when all rotations are zero. The motion is
/// transferred as that of a BVH file.
///
/// A file with joint names is never taken for SMPL's: its rotations are of the joints it names.
///
/// # Errors
/// Damaged arrays, a character whose joints cannot be identified.
pub(super) fn transferred(
    npz: &mut Npz,
    character: &Character,
    options: &MotionOptions,
) -> Result<Option<(Retargeted, Vec<Finding>)>> {
    if npz.contains(JOINT_NAMES) || !needs_transfer(npz, &character.skeleton)? {
        return Ok(None);
    }
    let Some(adult) = adult() else { return Ok(None) };
    let path = npz.path().to_path_buf();
    let AdultClip {
        clip,
        mut notes,
        findings,
        ..
    } = AdultClip::read(npz, &adult, options)?;
    notes.push(
        "the rotations are taken for SMPL's, whose zero pose is the T-pose: they are transferred".into(),
    );
    let bvh = as_bvh(&adult, &clip);
    let source = RetargetSource::new(&path, &bvh, &options.bones, UpAxis::Y)?;
    let mut transferred = source.on(&path, &bvh, character)?;
    transferred.clip.wind = clip.wind;
    notes.append(&mut transferred.notes);
    transferred.notes = notes;
    Ok(Some((transferred, findings)))
}

/// Reads motion in SMPL's order, on the joints of an adult in the T-pose.
///
/// # Errors
/// Missing arrays, another number of joints, other faults of a motion.
pub(crate) fn smpl_motion(path: &Path, options: &MotionOptions) -> Result<SmplMotion> {
    let mut npz = Npz::open(path)?;
    let expected = "a motion in SMPL's order, or one of a file with joints (BVH, glTF, FBX, USD)";
    let numbers = numbers_a_frame(&mut npz)?;
    if npz.contains(JOINT_NAMES) {
        let found = format!("the array {JOINT_NAMES}, whose joints have no places in the file");
        return Err(Error::content(path, expected, found));
    }
    let adult = adult().filter(|_| PoseLayout::of(numbers, SMPL_JOINT_NAMES.len()).is_some());
    let Some(adult) = adult else {
        let found = format!("{numbers} numbers a frame");
        return Err(Error::content(path, expected, found));
    };
    let read = AdultClip::read(&mut npz, &adult, options)?;
    Ok(SmplMotion {
        bvh: as_bvh(&adult, &read.clip),
        y_up_from_source: match read.turned {
            up::UpConversion::None => Quat::IDENTITY,
            up::UpConversion::FromZ => y_up_from_z_up(),
        },
    })
}

/// A motion in SMPL's order on the skeleton of an adult.
pub(crate) struct SmplMotion {
    /// Joints and frames, Y up.
    pub(crate) bvh: Bvh,
    /// Rotation that has made them so. Translations are relative to the root joint before it.
    pub(crate) y_up_from_source: Quat,
}

/// A motion in SMPL's order on the skeleton of an adult, Y up.
struct AdultClip {
    clip: Clip,
    turned: up::UpConversion,
    notes: Vec<String>,
    findings: Vec<Finding>,
}

impl AdultClip {
    fn read(npz: &mut Npz, adult: &Skeleton, options: &MotionOptions) -> Result<Self> {
        let name = (npz.path().file_stem().unwrap_or_default())
            .to_string_lossy()
            .into_owned();
        let arrays = MotionArrays::read_at(npz, &JointTarget::Character(adult), options.fps_of_file)?;
        let (mut notes, findings) = (arrays.notes.clone(), arrays.findings.clone());
        let mut clip = arrays.into_clip(name);
        let turned = up::convert_to_y_up(&mut clip, adult, options.up, &mut notes);
        Ok(Self {
            clip,
            turned,
            notes,
            findings,
        })
    }
}

fn needs_transfer(npz: &mut Npz, skeleton: &Skeleton) -> Result<bool> {
    let numbers = numbers_a_frame(npz)?;
    if PoseLayout::of(numbers, SMPL_JOINT_NAMES.len()).is_none() {
        return Ok(false);
    }
    Ok(match (is_in_smpl_terms(skeleton), stands_in_t_pose(skeleton)) {
        (true, t_pose) => t_pose == Some(false),
        (false, None) => false,
        // A rotation for each joint belongs to the character's own joints, whatever their names.
        (false, Some(_)) => numbers != 3 * skeleton.len(),
    })
}

/// Skeleton of an adult in SMPL's order. Its zero pose is the T-pose.
///
/// Motion files do not state the skeleton of the recorded person. Only the directions of its bones
/// and the length of its legs matter, which vary little between adults.
fn adult() -> Option<Skeleton> {
    let mut joints = [Vec3::ZERO; 24];
    for (joint, place) in ADULT_JOINTS {
        joints[joint] = Vec3::from_array(place);
    }
    let [elbow, wrist, hand] = [18, 20, 22];
    joints[hand] = joints[wrist] + HAND_SHARE * (joints[wrist] - joints[elbow]);
    for limb in LimbJoint::ALL {
        let [left, right] = BodySide::ALL.map(|side| limb.smpl_joint(side));
        joints[right] = joints[left] * Vec3::new(-1.0, 1.0, 1.0);
    }
    let parts = SkeletonParts {
        names: SMPL_JOINT_NAMES.map(str::to_owned).to_vec(),
        parents: SMPL_PARENTS.to_vec(),
        joints: joints.to_vec(),
        rest_pose: Vec::new(),
    };
    // The tables are a tree, which a test checks.
    Skeleton::new(parts).ok()
}

/// Converts a clip to the form that retargeting takes.
fn as_bvh(skeleton: &Skeleton, clip: &Clip) -> Bvh {
    let joint = |joint: usize| RestJoint {
        name: skeleton.names()[joint].clone(),
        parent: skeleton.parents()[joint],
        position: skeleton.joints()[joint],
    };
    let joints: Vec<RestJoint> = (0..skeleton.len()).map(joint).collect();
    let (mut frames, mut world): (Vec<f32>, Vec<Rigid>) = Default::default();
    for pose in &clip.poses {
        skeleton.forward_kinematics(pose, &mut world);
        Bvh::push_frame(&joints, &world, &mut frames);
    }
    Bvh::from_rest(joints, clip.fps, frames)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_adult_stands_in_the_t_pose() {
        let adult = adult().unwrap();
        assert_eq!(stands_in_t_pose(&adult), Some(true));
        assert!(is_in_smpl_terms(&adult));
    }
}
