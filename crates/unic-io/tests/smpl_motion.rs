//! Contract: motion in SMPL's order moves a character of other joint names and another rest pose as it
//! moves SMPL's own skeleton. Files with joint names are never taken for SMPL's.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{full_body_motion, humanoid, largest_differences, without_filters};
use glam::Quat;
use std::f32::consts::FRAC_PI_4;
use unic_core::{
    Pose,
    character::Character,
    skeleton::{SMPL_JOINT_NAMES, Skeleton, SkeletonParts},
    transform::Rigid,
};
use unic_io::{NpzWriter, import_motion, write_motion};

/// The humanoid with Mixamo's names and, in its zero pose, arms that hang at 45°.
fn in_a_pose() -> Character {
    let mut character = humanoid();
    let side = |left: &str| [format!("mixamorig:Left{left}"), format!("mixamorig:Right{left}")];
    let pairs = [
        "UpLeg",
        "Leg",
        "Foot",
        "ToeBase",
        "Shoulder",
        "Arm",
        "ForeArm",
        "Hand",
        "HandIndex1",
    ];
    let mut pairs = pairs.iter().flat_map(|pair| side(pair));
    let middle = ["Hips", "Spine", "Spine1", "Spine2", "Neck", "Head"];
    let mut middle = middle.iter().map(|name| format!("mixamorig:{name}"));
    let skeleton = &character.skeleton;
    let name = |smpl: &&str| {
        if smpl.contains('_') {
            pairs.next()
        } else {
            middle.next()
        }
    };
    let names = SMPL_JOINT_NAMES.iter().map(name);
    // SMPL's order has the middle joints between the pairs, each in the order of the lists above.
    let names: Vec<String> = names.map(Option::unwrap).collect();
    let mut joints = skeleton.joints().to_vec();
    for (first, turn) in [(16, -FRAC_PI_4), (17, FRAC_PI_4)] {
        let shoulder = joints[first];
        for joint in (first..24).step_by(2) {
            joints[joint] = shoulder + Quat::from_rotation_z(turn) * (joints[joint] - shoulder);
        }
    }
    let parent = |p: &Option<usize>| p.map_or(-1, |p| p as i64);
    character.skeleton = Skeleton::new(SkeletonParts {
        names,
        parents: skeleton.parents().iter().map(parent).collect(),
        joints,
        rest_pose: Vec::new(),
    })
    .unwrap();
    character
}

#[test]
fn motion_in_smpls_order_is_transferred_to_other_names_and_rest_poses() {
    let (smpl, other, clip) = (humanoid(), in_a_pose(), full_body_motion(30));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("amass.npz");
    // Without names: the order is SMPL's, and 156 numbers are SMPL-H's.
    let mut npz = NpzWriter::create(&path).unwrap();
    let frame = |pose: &Pose| {
        let mut frame = vec![0.0; 156];
        for (joint, local) in pose.local.iter().take(22).enumerate() {
            frame[3 * joint..3 * joint + 3].copy_from_slice(&local.to_scaled_axis().to_array());
        }
        frame
    };
    let poses: Vec<f32> = clip.poses.iter().flat_map(frame).collect();
    npz.f32s("poses", &[clip.len(), 156], &poses).unwrap();
    let trans: Vec<f32> = clip.poses.iter().flat_map(|pose| pose.trans.to_array()).collect();
    npz.f32s("trans", &[clip.len(), 3], &trans).unwrap();
    npz.f64s("mocap_framerate", &[], &[30.0]).unwrap();
    npz.finish().unwrap();
    let import = import_motion(&path, &other, &without_filters()).unwrap();
    let notes = import.notes.join("\n");
    assert!(notes.contains("taken for SMPL's"), "{notes}");
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for (x, y) in clip.poses.iter().zip(&import.clip.poses) {
        smpl.skeleton.forward_kinematics(x, &mut a);
        other.skeleton.forward_kinematics(y, &mut b);
        // Bones from hip to knee, knee to ankle, shoulder to elbow and elbow to wrist.
        for [from, to] in [[1, 4], [4, 7], [16, 18], [17, 19], [18, 20], [19, 21]] {
            let bone = |world: &[Rigid]| (world[to].translation - world[from].translation).normalize();
            let angle = bone(&a).angle_between(bone(&b));
            // The recorded skeleton is not in the file: its bones lean up to 2° from these.
            assert!(angle < 0.06, "{from} to {to}: {angle}");
        }
        assert!(a[0].rotation.dot(b[0].rotation).abs() > 1.0 - 1e-5);
    }
    // Names make the rotations the character's own.
    write_motion(&path, &clip, other.skeleton.names()).unwrap();
    let import = import_motion(&path, &other, &without_filters()).unwrap();
    let (angle, distance) = largest_differences(&import.clip, &clip);
    assert!(angle < 2e-5 && distance < 2e-6, "{angle} rad, {distance} m");
}
