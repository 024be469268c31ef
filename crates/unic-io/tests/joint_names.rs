//! Contract: joints of a motion file are matched by name, in any order of file and character.
//! Ambiguous and missing names are refused.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use glam::{Quat, Vec3};
use std::path::Path;
use unic_core::{
    Pose,
    character::Character,
    clip::Clip,
    skeleton::{SMPL_JOINT_NAMES, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use unic_io::{MotionOptions, UpAxis, import_motion, write_motion};
use unic_testdata::Figure;

/// A chain of joints with these names.
fn character(names: &[String]) -> Character {
    let joints = names.len();
    let tube = Figure::tube().character;
    let rows = (0..tube.body.vertices.len()).map(|v| std::iter::once((v % joints, 1.0)));
    Character {
        weights: SkinningWeights::from_rows(joints, rows).unwrap(),
        skeleton: Skeleton::new(SkeletonParts {
            names: names.to_vec(),
            parents: (0..joints as i64).map(|j| j - 1).collect(),
            joints: (0..joints).map(|j| Vec3::Y * j as f32).collect(),
            rest_pose: Vec::new(),
        })
        .unwrap(),
        body: tube.body,
        file_mesh: None,
    }
}

fn rotation(joint: usize, frame: usize) -> Quat {
    Quat::from_rotation_x(0.01 * (joint + 1) as f32 + 0.1 * frame as f32)
}

/// A clip of three frames in which joint j has the rotation `rotation(j, frame)`.
fn clip(joints: usize) -> Clip {
    let pose = |frame: usize| Pose {
        trans: Vec3::Z * frame as f32,
        local: (0..joints).map(|joint| rotation(joint, frame)).collect(),
    };
    Clip {
        name: "walk".into(),
        fps: 30.0,
        poses: (0..3).map(pose).collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    }
}

fn names(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

/// Returns the joint of the file for each joint of the character, recognised by its rotation.
fn sources(path: &Path, character: &Character) -> Result<Vec<usize>, String> {
    let options = MotionOptions {
        up: UpAxis::Y,
        ..MotionOptions::default()
    };
    let import = import_motion(path, character, &options).map_err(|e| e.to_string())?;
    let local = &import.clip.poses[0].local;
    Ok(local
        .iter()
        .map(|q| (q.to_scaled_axis().x / 0.01).round() as usize - 1)
        .collect())
}

#[test]
fn named_joints_are_found_in_any_order_and_spelling() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.npz");
    write_motion(&path, &clip(5), &names("root extra arm.R arm.L head")).unwrap();
    let found = |text: &str| sources(&path, &character(&names(text)));
    assert_eq!(found("root head arm.L arm.R"), Ok(vec![0, 4, 3, 2]));
    assert_eq!(found("mixamorig:Root Head L_arm R_arm"), Ok(vec![0, 4, 3, 2]));
    // A leaf joint may be missing; it does not rotate.
    let options = MotionOptions {
        up: UpAxis::Y,
        ..MotionOptions::default()
    };
    let import = import_motion(&path, &character(&names("root head hat")), &options).unwrap();
    assert_eq!(import.clip.poses[1].local[2], Quat::IDENTITY);
    let error = found("root tail head").unwrap_err();
    assert!(
        error.contains("joint_names") && error.contains("tail among them"),
        "{error}"
    );
}

#[test]
fn files_without_names_have_smpl_order() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.npz");
    write_motion(&path, &clip(24), &[]).unwrap();
    let smpl = SMPL_JOINT_NAMES.map(str::to_owned);
    assert_eq!(sources(&path, &character(&smpl)), Ok((0..24).collect()));
    let order: Vec<usize> = (0..24).rev().collect();
    let reversed: Vec<String> = order.iter().map(|j| smpl[*j].clone()).collect();
    assert_eq!(sources(&path, &character(&reversed)), Ok(order));
    let others: Vec<String> = (0..24).map(|j| format!("bone {j}")).collect();
    let error = sources(&path, &character(&others)).unwrap_err();
    assert!(
        error.contains("bone 0") && error.contains("SMPL's order"),
        "{error}"
    );
}

#[test]
fn names_of_another_number_of_joints_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.npz");
    write_motion(&path, &clip(3), &names("a b")).unwrap();
    let error = sources(&path, &character(&names("a b c"))).unwrap_err();
    assert!(
        error.contains("2 joint names") && error.contains("9 numbers"),
        "{error}"
    );
}
