//! Contract: a character of any skeleton works by its joint names, here 65 joints named as
//! Mixamo's: in a capture, in inspection, in training with mirrored data and in animation.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::{fs, path::Path};
use unic_core::{Model, motion::JointSprings};
use unic_io::{Capture, Split};
use unic_testdata::{Figure, MIXAMO_JOINTS, mixamo_clip, write_capture as write_takes};

/// Joint names of the feet.
const FEET: [&str; 4] = ["LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase"];

/// Writes the capture `folder`/tube, whose manifest does not name the joints that touch the ground.
fn mixamo_capture(folder: &Path) {
    let (root, figure) = (folder.join("tube"), Figure::mixamo());
    let splits = [
        ("one", Split::Train),
        ("two", Split::Train),
        ("three", Split::Train),
        ("four", Split::Test),
    ];
    let takes: Vec<_> = (splits.into_iter().enumerate())
        .map(|(seed, (name, split))| (figure.swung(mixamo_clip(name, seed, FRAMES)), split))
        .collect();
    write_takes(&root, &figure, &takes);
    let manifest = root.join("capture.toml");
    let text = fs::read_to_string(&manifest).unwrap();
    let kept: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with("contact_joints"))
        .collect();
    assert!(kept.len() < text.lines().count());
    fs::write(&manifest, kept.join("\n")).unwrap();
}

#[test]
fn a_skeleton_of_65_joints_is_captured_trained_and_animated() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    mixamo_capture(path);
    let capture = Capture::open(&path.join("tube")).unwrap();
    let skeleton = &capture.character.skeleton;
    let feet = capture.contact_joints.map(|j| skeleton.names()[j].clone());
    assert_eq!(feet, FEET.map(|name| format!("mixamorig:{name}")));
    let inspected = succeeds(path, "inspect tube");
    assert!(inspected.contains("mixamorig:LeftHandPinky4"), "{inspected}");
    assert!(
        unic_train::MirrorMap::new(&JointSprings::default(), skeleton).is_some(),
        "left and right by name"
    );

    let summary = train(path, "tube.unic", "--steps 10");
    // The garment swings by a few centimetres.
    assert!(
        summary["validation_rmse_mm"].as_f64().unwrap() < 100.0,
        "{summary}"
    );
    let model = Model::from_bytes(&fs::read(path.join("tube.unic")).unwrap()).unwrap();
    assert_eq!(model.character().skeleton.len(), MIXAMO_JOINTS);
    let motion = &model.config().motion;
    assert_eq!(motion.springs.joints.len(), 24, "{:?}", motion.springs.joints);
    assert_eq!(model.normalisation().mean.len(), motion.len(MIXAMO_JOINTS));
    let animated = json(
        path,
        "animate tube.unic --motion tube/clips/four.npz --out four.glb --json",
    );
    assert_eq!(animated["frames"], FRAMES);
}
