//! Contract: the reader reads back what the writer writes; parts that contradict each other are
//! refused in one sentence that names the file.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{largest_differences, small_character, small_clip, small_frame, small_garment};
use glam::Vec3;
use std::path::Path;
use unic_core::clip::Clip;
use unic_io::{
    Capture, CaptureWriter, Error, Manifest, NpzWriter, Split,
    capture::{VertexAttributes, WeightsSource},
};

fn manifest() -> Manifest {
    use unic_io::capture::JointReference::{Index, Name};
    let mut manifest = Manifest::new("small", 30.0);
    manifest.provenance = "made by a test, \"public domain\"\n".into();
    manifest.contact_joints = Some([Index(0), Name("knée".into()), Index(0), Index(1)]);
    manifest
}

fn attributes() -> VertexAttributes {
    VertexAttributes {
        pinned: Some(vec![true, false, false, true]),
        groups: Some(vec![0, 0, 7, u32::MAX]),
    }
}

fn write(root: &Path, clips: &[(&str, Split)]) {
    let (character, garment) = (small_character(), small_garment());
    let mut writer = CaptureWriter::create(root, manifest(), &character, &garment, &attributes()).unwrap();
    for (i, &(name, split)) in clips.iter().enumerate() {
        let mut clip = small_clip(name, 5 + i);
        if i == 0 {
            clip.wind = vec![Vec3::X; clip.len()];
        }
        let mut frames = writer.begin_clip(&clip, split).unwrap();
        for t in 0..clip.len() {
            frames.push(&small_frame(t)).unwrap();
        }
        frames.finish().unwrap();
    }
    assert!(Capture::open(root).is_err(), "no capture before capture.toml");
    writer.finish().unwrap();
}

#[test]
fn written_capture_is_read_back() {
    let root = tempfile::tempdir().unwrap();
    write(
        root.path(),
        &[
            ("walk", Split::Train),
            ("rün", Split::Validation),
            ("a b", Split::Test),
        ],
    );
    let capture = Capture::open(root.path()).unwrap();
    assert_eq!(capture.character, small_character());
    assert_eq!(capture.garment, small_garment());
    assert_eq!(capture.weights_source, WeightsSource::File);
    assert_eq!(capture.attributes, attributes());
    assert_eq!(capture.contact_joints, [0, 1, 0, 1]);
    assert_eq!(capture.manifest.provenance, manifest().provenance);
    assert_eq!(capture.clip_names(Split::Validation), ["rün"]);
    assert_eq!(capture.clips_on_disk().unwrap(), ["a b", "rün", "walk"]);

    let walk = capture.load_clip("walk").unwrap();
    let (angle, distance) = largest_differences(&walk.clip, &small_clip("walk", 5));
    assert!(angle < 1e-6 && distance == 0.0, "{angle} {distance}");
    assert_eq!((walk.clip.fps, walk.clip.ground_height), (30.0, -0.125));
    assert!(walk.garment.is_mapped());
    assert!((0..5).all(|t| walk.garment.frame(t) == small_frame(t)));
    assert_eq!(walk.clip.wind, vec![Vec3::X; 5]);
    assert!(capture.load_clip("a b").unwrap().clip.wind.is_empty());
}

#[test]
fn writing_is_deterministic() {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for root in [&a, &b] {
        write(root.path(), &[("walk", Split::Train)]);
    }
    for file in [
        "capture.toml",
        "character.npz",
        "garment.obj",
        "garment.npz",
        "clips/walk.npz",
    ] {
        let bytes = |root: &tempfile::TempDir| std::fs::read(root.path().join(file)).unwrap();
        assert_eq!(bytes(&a), bytes(&b), "{file}");
    }
}

/// Opens the capture, loads `walk`, and returns the error message.
fn message(root: &Path) -> String {
    let opened = Capture::open(root).and_then(|c| c.load_clip("walk").map(|_| ()));
    let message = opened.map_or_else(|e: Error| e.to_string(), |()| "nothing went wrong".into());
    assert!(!message.contains('\n'), "{message}");
    message
}

fn replace_clip(root: &Path, fill: impl FnOnce(&mut NpzWriter)) {
    let mut npz = NpzWriter::create(&root.join("clips/walk.npz")).unwrap();
    fill(&mut npz);
    npz.finish().unwrap();
}

#[test]
fn clips_that_do_not_fit_are_refused() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    write(root, &[("walk", Split::Train)]);
    let check = |rate: f64, joints: usize, frames: usize, expected: &str| {
        replace_clip(root, |npz| {
            let zeros = vec![0.0; frames * 3 * joints];
            npz.f32s("poses", &[frames, joints, 3], &zeros).unwrap();
            npz.f32s("trans", &[frames, 3], &vec![0.0; frames * 3]).unwrap();
            npz.f64s("mocap_framerate", &[], &[rate]).unwrap();
        });
        let found = message(root);
        assert!(found.contains(expected), "{found}");
    };
    check(30.0, 2, 5, "nothing went wrong");
    check(
        60.0,
        2,
        5,
        "expected the capture's 30 frames per second, found 60",
    );
    check(30.0, 3, 5, "6 numbers a frame");
    check(30.0, 2, 6, "(6, 4, 3), found shape (5, 4, 3)");
    check(30.0, 2, 1, "at least two frames");
    check(f64::NAN, 2, 5, "finite");
}

#[test]
fn non_finite_positions_are_found() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    write(root, &[("walk", Split::Train)]);
    let path = root.join("clips/walk.garment.npy");
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.len() - 8;
    bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    let found = message(root);
    assert!(found.contains("frame 4, vertex 3"), "{found}");
}

#[test]
fn body_frames_are_read_and_checked() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    write(root, &[("walk", Split::Train)]);
    let with_body = |vertices: usize| {
        replace_clip(root, |npz| {
            npz.f32s("poses", &[5, 6], &[0.0; 30]).unwrap();
            npz.f32s("trans", &[5, 3], &[0.0; 15]).unwrap();
            npz.f64s("mocap_frame_rate", &[1], &[30.0]).unwrap();
            npz.f32s("body", &[5, vertices, 3], &vec![0.5; 15 * vertices])
                .unwrap();
        });
    };
    with_body(4);
    let body = Capture::open(root)
        .and_then(|c| c.load_clip("walk"))
        .unwrap()
        .body
        .unwrap();
    assert_eq!(body.frame(4), [Vec3::splat(0.5); 4]);
    with_body(5);
    let found = message(root);
    assert!(
        found.contains("`body`: expected shape (5, 4, 3), found shape (5, 5, 3)"),
        "{found}"
    );
}

#[test]
fn splits_with_missing_clips_are_refused() {
    let root = tempfile::tempdir().unwrap();
    write(root.path(), &[("walk", Split::Train)]);
    std::fs::rename(
        root.path().join("clips/walk.npz"),
        root.path().join("clips/run.npz"),
    )
    .unwrap();
    let found = message(root.path());
    assert!(
        found.contains("clips/walk.npz") && found.contains("train"),
        "{found}"
    );
}

#[test]
fn writer_refuses_what_the_reader_refuses() {
    let root = tempfile::tempdir().unwrap();
    let (character, garment) = (small_character(), small_garment());
    let create = || CaptureWriter::create(root.path(), manifest(), &character, &garment, &attributes());
    let mut writer = create().unwrap();
    let clip = small_clip("walk", 3);
    let mut frames = writer.begin_clip(&clip, Split::Train).unwrap();
    assert!(
        writer.begin_clip(&clip, Split::Test).is_err(),
        "the same name twice"
    );
    assert!(writer.begin_clip(&small_clip("../walk", 3), Split::Test).is_err());
    assert!(writer.begin_clip(&small_clip("run", 1), Split::Test).is_err());
    assert!(frames.push(&[Vec3::ZERO]).is_err(), "too few vertices");
    assert!(frames.push(&[Vec3::NAN; 4]).is_err());
    frames.push(&small_frame(0)).unwrap();
    assert!(frames.finish().is_err(), "one frame of three");
    assert!(writer.finish().is_err(), "an unfinished clip");
    write(root.path(), &[("walk", Split::Train)]);
    assert!(create().is_err(), "a capture is not overwritten");
}

#[test]
fn finished_clips_are_kept_after_an_interruption() {
    let root = tempfile::tempdir().unwrap();
    let (character, garment) = (small_character(), small_garment());
    let create =
        || CaptureWriter::create(root.path(), manifest(), &character, &garment, &attributes()).unwrap();
    let (walk, run) = (small_clip("walk", 3), small_clip("run", 4));
    let finish = |writer: &mut CaptureWriter, clip: &Clip| {
        let mut frames = writer.begin_clip(clip, Split::Train).unwrap();
        (0..clip.len()).for_each(|t| frames.push(&small_frame(t)).unwrap());
        frames.finish().unwrap();
    };
    let mut interrupted = create();
    finish(&mut interrupted, &walk);
    drop(interrupted.begin_clip(&run, Split::Test).unwrap());

    let mut writer = create();
    assert!(
        writer.keep_clip(&small_clip("walk", 9), Split::Train).is_err(),
        "another length"
    );
    assert!(writer.keep_clip(&walk, Split::Train).unwrap());
    assert!(writer.keep_clip(&walk, Split::Test).is_err(), "twice");
    assert!(
        !writer.keep_clip(&run, Split::Test).unwrap(),
        "it was never finished"
    );
    finish(&mut writer, &run);
    writer.finish().unwrap();
    let capture = Capture::open(root.path()).unwrap();
    assert_eq!(capture.clip_names(Split::Train), ["walk", "run"]);
}
