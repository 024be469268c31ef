//! Contract: a motion in any joint layout and axis convention of the SMPL family is read as one
//! clip.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{data, largest_differences, small_character, small_clip};
use glam::{Quat, Vec3};
use std::{f32::consts::FRAC_PI_2, path::Path};
use unic_core::{character::Character, clip::Clip};
use unic_io::{
    GroundPlacement, MotionImport, MotionOptions, NpzWriter, UpAxis, import_motion, read_character,
    write_motion,
};

/// Largest difference between a clip and its copy from a file, radians and metres. Resampling adds
/// nothing: the test writes each frame of the source as every fourth of the file.
const TOLERANCE: f32 = 2e-6;

fn character() -> Option<Character> {
    Some(read_character(&data("body/character.npz")?).unwrap())
}

fn locomotion(character: &Character) -> Option<Clip> {
    let path = data("motion/locomotion/Walk1.npz")?;
    let import = import_motion(&path, character, &MotionOptions::default()).unwrap();
    assert!(import.notes.is_empty(), "{:?}", import.notes);
    assert_eq!((import.clip.len(), import.clip.fps), (2803, 30.0));
    Some(import.clip)
}

/// Writes the clip in the layout of AMASS: Z up, 120 fps, f64, `numbers` values a frame, with bent
/// fingers.
fn write_amass(path: &Path, clip: &Clip, character: &Character, numbers: usize, rate_name: &str) {
    let z_up_from_y_up = Quat::from_rotation_x(FRAC_PI_2);
    let origin = character.skeleton.joints()[0];
    let fine = clip.resampled(120.0);
    let (mut poses, mut trans) = (Vec::new(), Vec::new());
    for pose in &fine.poses {
        let mut frame = vec![0.7; numbers];
        for (j, &local) in pose.local.iter().take(22).enumerate() {
            let local = if j == 0 { z_up_from_y_up * local } else { local };
            let axis_angle = local.to_scaled_axis().as_dvec3().to_array();
            frame[3 * j..3 * j + 3].copy_from_slice(&axis_angle);
        }
        poses.extend(frame);
        let p = pose.trans + origin;
        trans.extend((Vec3::new(p.x, -p.z, p.y) - origin).as_dvec3().to_array());
    }
    let mut npz = NpzWriter::create(path).unwrap();
    npz.f64s("poses", &[fine.len(), numbers], &poses).unwrap();
    npz.f64s("trans", &[fine.len(), 3], &trans).unwrap();
    npz.f64s("betas", &[16], &[0.0; 16]).unwrap();
    npz.f64s(rate_name, &[], &[120.0]).unwrap();
    npz.text("gender", &["neutral".into()]).unwrap();
    npz.finish().unwrap();
}

fn expected(clip: &Clip) -> Clip {
    let mut expected = clip.clone();
    for pose in &mut expected.poses {
        pose.local[22..].fill(Quat::IDENTITY);
    }
    expected
}

#[test]
fn amass_files_are_read_as_their_source_clip() {
    let Some(character) = character() else { return };
    let Some(mut clip) = locomotion(&character) else {
        return;
    };
    clip.poses.truncate(300);
    let folder = tempfile::tempdir().unwrap();
    for (numbers, rate_name) in [(156, "mocap_framerate"), (165, "mocap_frame_rate")] {
        let path = folder.path().join("amass.npz");
        write_amass(&path, &clip, &character, numbers, rate_name);
        let options = MotionOptions {
            fps: Some(30.0),
            up: UpAxis::Auto,
            ground: GroundPlacement::Keep,
            ..MotionOptions::default()
        };
        let import = import_motion(&path, &character, &options).unwrap();
        let (angle, distance) = largest_differences(&import.clip, &expected(&clip));
        assert!(
            angle < TOLERANCE && distance < TOLERANCE,
            "{angle} rad, {distance} m"
        );
        let notes = import.notes.join("\n");
        for word in [
            "fingers left out",
            "Z up converted",
            "resampled from 120 fps to 30 fps",
        ] {
            assert!(notes.contains(word), "{notes}");
        }
    }
}

#[test]
fn floating_body_is_placed_on_the_ground() {
    let Some(character) = character() else { return };
    let Some(mut clip) = locomotion(&character) else {
        return;
    };
    clip.poses.truncate(300);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("amass.npz");
    let mut raised = clip.clone();
    raised.poses.iter_mut().for_each(|p| p.trans.y += 0.4);
    write_amass(&path, &raised, &character, 156, "fps");
    let import = import_motion(&path, &character, &MotionOptions::default()).unwrap();
    let note = import.notes.iter().find(|n| n.contains("lowered by 0.4"));
    assert!(
        note.is_some() || import.notes.iter().any(|n| n.contains("lowered by 0.39")),
        "{:?}",
        import.notes
    );
    let shift = import.clip.poses[0].trans.y - clip.poses[0].trans.y;
    // The locomotion clips themselves stand on y = 0 within about a centimetre.
    assert!(shift.abs() < 0.015, "{shift}");
}

#[test]
fn frames_of_75_numbers_hold_the_translation() {
    let Some(character) = character() else { return };
    let Some(mut clip) = locomotion(&character) else {
        return;
    };
    clip.poses.truncate(50);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("vto.npz");
    let mut poses = Vec::new();
    for pose in &clip.poses {
        poses.extend(pose.local.iter().flat_map(|q| q.to_scaled_axis().to_array()));
        poses.extend(pose.trans.to_array());
    }
    let mut npz = NpzWriter::create(&path).unwrap();
    npz.f32s("poses", &[50, 75], &poses).unwrap();
    npz.f64s("fps", &[1], &[30.0]).unwrap();
    npz.finish().unwrap();
    let options = MotionOptions {
        ground: GroundPlacement::Keep,
        ..MotionOptions::default()
    };
    let import = import_motion(&path, &character, &options).unwrap();
    let (angle, distance) = largest_differences(&import.clip, &clip);
    assert!(angle < TOLERANCE && distance == 0.0, "{angle} {distance}");
}

#[test]
fn all_locomotion_clips_are_read() {
    let Some(character) = character() else { return };
    let Some(folder) = data("motion/locomotion") else {
        return;
    };
    let mut frames = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "npz") {
            let import = import_motion(&path, &character, &MotionOptions::default()).unwrap();
            assert!(import.clip.poses.iter().all(|p| p.is_valid()));
            assert!(import.notes.is_empty(), "{}: {:?}", path.display(), import.notes);
            frames += import.clip.len();
        }
    }
    // The total of the folder's README.
    assert_eq!(frames, 45_475);
}

#[test]
fn written_motion_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.npz");
    let clip = small_clip("walk", 9);
    write_motion(&path, &clip, &[]).unwrap();
    let options = MotionOptions {
        up: UpAxis::Y,
        ..MotionOptions::default()
    };
    let import = import_motion(&path, &small_character(), &options).unwrap();
    let (angle, distance) = largest_differences(&import.clip, &clip);
    assert!(angle < TOLERANCE && distance == 0.0, "{angle} {distance}");
    assert_eq!(import.clip.ground_height, clip.ground_height);
    assert_eq!(import.clip.name, "walk");
}

#[test]
fn other_skeletons_and_rates_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.npz");
    let import = |joints: usize, rate: f64, value: f32, target: Option<f32>| {
        let mut npz = NpzWriter::create(&path).unwrap();
        npz.f32s("poses", &[4, joints, 3], &vec![value; 12 * joints])
            .unwrap();
        npz.f32s("trans", &[4, 3], &[0.0; 12]).unwrap();
        npz.f64s("fps", &[], &[rate]).unwrap();
        npz.finish().unwrap();
        let options = MotionOptions {
            fps: target,
            ..MotionOptions::default()
        };
        let result = import_motion(&path, &small_character(), &options);
        let summary = |i: MotionImport| format!("{} frames, {:?}", i.clip.len(), i.findings);
        result.map_or_else(|e| e.to_string(), summary)
    };
    assert!(import(2, 30.0, 0.1, None).starts_with("4 frames"));
    for (joints, rate, value, target, words) in [
        (52, 30.0, 0.1, None, "expected 6 numbers a frame"),
        (2, 0.0, 0.1, None, "frame rate from 1 to 1000"),
        (2, 1e-30, 0.1, None, "frame rate from 1 to 1000"),
        (2, 30.0, f32::INFINITY, None, "finite"),
        (2, 30.0, 180.0, None, "degrees instead of radians"),
        (2, 30.0, 0.1, Some(1e30), "target frame rate"),
        (2, 30.0, 0.1, Some(1.0), "at least two frames"),
    ] {
        let found = import(joints, rate, value, target);
        assert!(found.contains(words), "{found}");
    }
}
