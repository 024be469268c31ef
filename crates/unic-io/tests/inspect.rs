//! Contract: inspection names the kind of every file and lists its problems.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{small_character, small_clip, small_database, small_frame, small_garment};
use glam::Vec3;
use std::path::Path;
use unic_io::{
    Capture, CaptureWriter, Manifest, NpzWriter, Split,
    capture::{JointReference, VertexAttributes},
    inspect::{FileKind, Inspection, inspect},
    write_motion, write_motion_database, write_obj,
};

fn problems(report: &Inspection) -> String {
    report.problems.join("\n")
}

fn capture(root: &Path, garment_offset: Vec3) {
    let mut manifest = Manifest::new("small", 30.0);
    manifest.contact_joints = Some([0, 1, 0, 1].map(JointReference::Index));
    manifest.provenance = "a test".into();
    let (character, garment) = (small_character(), small_garment());
    let attributes = VertexAttributes::default();
    let mut writer = CaptureWriter::create(root, manifest, &character, &garment, &attributes).unwrap();
    for (name, split) in [("walk", Split::Train), ("run", Split::Test)] {
        let mut clip = writer.begin_clip(&small_clip(name, 3), split).unwrap();
        for t in 0..3 {
            let frame: Vec<Vec3> = small_frame(t).iter().map(|v| v + garment_offset).collect();
            clip.push(&frame).unwrap();
        }
        clip.finish().unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn clips_without_a_split_and_distant_garments_are_problems() {
    let root = tempfile::tempdir().unwrap();
    capture(root.path(), Vec3::X * 50.0);
    let clip = root.path().join("clips/walk.npz");
    std::fs::copy(clip, root.path().join("clips/stray.npz")).unwrap();
    let report = inspect(root.path()).unwrap();
    assert_eq!(report.kind, FileKind::Capture);
    let found = problems(&report);
    for words in [
        "clip `stray`: expected it in a split",
        "stray.garment.npy beside it, found neither",
        "clip `walk`: found a garment",
        "(RMS) from the skinned rest shape",
    ] {
        assert!(found.contains(words), "{found}");
    }
    assert!(
        report
            .get("clip run")
            .unwrap()
            .contains("3 frames, 0.07 s, test, mapped")
    );
}

#[test]
fn motion_databases_list_clips_tags_and_features() {
    let root = tempfile::tempdir().unwrap();
    // The first bytes tell, whatever the name.
    let path = root.path().join("walks.npz");
    write_motion_database(&path, &small_database()).unwrap();
    let report = inspect(&path).unwrap();
    assert_eq!(report.kind, FileKind::MotionDatabase);
    assert_eq!(report.problems, Vec::<String>::new());
    for (name, text) in [
        ("frames", "160"),
        ("frames per second", "30.0"),
        ("seconds", "5.33"),
        ("joints", "2"),
        ("mirrored", "true"),
        ("clips", "4"),
        ("clip 0", "walk, as captured, 40 frames, 1.33 s"),
        ("clip 3", "run, mirrored, 40 frames, 1.33 s"),
        ("tag crouched", "20 frames"),
        ("feature 0", "velocity of joint 1 (knée), weight 1.5"),
        ("feature 1", "positions of the root 0.50, 1.00 s ahead, weight 1"),
    ] {
        assert_eq!(report.get(name), Some(text), "{name}");
    }
    let mut bytes = std::fs::read(&path).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    std::fs::write(&path, bytes).unwrap();
    assert!(problems(&inspect(&path).unwrap()).contains("the file is damaged"));
}

#[test]
fn damaged_captures_are_reported_without_an_error() {
    let root = tempfile::tempdir().unwrap();
    capture(root.path(), Vec3::ZERO);
    std::fs::write(root.path().join("garment.obj"), "v 0 0\n").unwrap();
    let report = inspect(&root.path().join("capture.toml")).unwrap();
    assert!(problems(&report).contains("garment.obj: expected a finite number in line 1"));
    assert_eq!(report.problems.len(), 1);
}

#[test]
fn meshes_in_centimetres_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let mut mesh = small_garment().rest;
    mesh.vertices.iter_mut().for_each(|v| *v *= 100.0);
    mesh.vertices.push(Vec3::ZERO);
    mesh.faces.push([0, 0, 1]);
    mesh.uvs = None;
    write_obj(&path, &mesh).unwrap();
    let report = inspect(&path).unwrap();
    let found = problems(&report);
    for words in [
        "probably centimetres",
        "1 triangle without an area",
        "a vertex without a face",
    ] {
        assert!(found.contains(words), "{found}");
    }
    assert_eq!(report.get("mesh"), Some("5 vertices, 3 triangles, no UVs"));
}

#[test]
fn jumps_of_the_root_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.npz");
    let mut clip = small_clip("walk", 6);
    write_motion(&path, &clip, &[]).unwrap();
    assert_eq!(inspect(&path).unwrap().problems, Vec::<String>::new());
    clip.poses[3].trans.x += 1.0;
    write_motion(&path, &clip, &[]).unwrap();
    let report = inspect(&path).unwrap();
    assert_eq!(report.kind, FileKind::Motion);
    assert!(
        problems(&report).contains("in frame 2: probably a jump"),
        "{report}"
    );
}

#[test]
fn archives_are_classified_by_their_arrays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    for (names, kind) in [
        (&["pinned", "mask"][..], FileKind::Garment),
        (&["weights"], FileKind::Garment),
        (&["anything"], FileKind::Npz),
        (&["vertices", "fps"], FileKind::VertexAnimation),
        (&["vertices", "joints", "weights"], FileKind::Character),
        (&["poses"], FileKind::Motion),
    ] {
        let mut npz = NpzWriter::create(&path).unwrap();
        names.iter().for_each(|name| npz.bools(name, &[true]).unwrap());
        npz.finish().unwrap();
        let report = inspect(&path).unwrap();
        assert_eq!(report.kind, kind, "{names:?}");
        assert_eq!(report.get(&format!("array {}", names[0])), Some("bool (1,)"));
    }
}

#[test]
fn model_metadata_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.unic");
    let header = r#"{"__metadata__":{"unic":"{\"version\":1,\"name\":\"shirt\"}","license":"MIT"},
        "field.0.weight":{"dtype":"F32","shape":[2,3],"data_offsets":[0,24]}}"#;
    let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
    bytes.extend(header.bytes());
    bytes.extend([0; 24]);
    std::fs::write(&path, bytes).unwrap();
    let report = inspect(&path).unwrap();
    assert_eq!(
        (report.kind, report.get("license")),
        (FileKind::Model, Some("MIT"))
    );
    assert_eq!(report.get("unic.version"), Some("1"));
    assert_eq!(report.get("tensor field.0.weight"), Some("F32 [2,3]"));
    assert!(report.get("checksum").unwrap().starts_with("none"), "{report}");
    assert_eq!(report.problems, [""; 0]);

    let damaged = header.replace(
        r#""version\":1"#,
        r#""version\":1,\"checksum\":\"crc32:01234567\""#,
    );
    let mut bytes = (damaged.len() as u64).to_le_bytes().to_vec();
    bytes.extend(damaged.bytes());
    bytes.extend([0; 24]);
    std::fs::write(&path, bytes).unwrap();
    let report = inspect(&path).unwrap();
    let [problem] = report.problems.as_slice() else {
        panic!("{report}");
    };
    assert!(
        problem.contains("a.unic: the file is damaged: expected") && problem.contains("crc32:01234567"),
        "{problem}"
    );
}

#[test]
fn facts_are_a_json_object() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("notes.txt");
    std::fs::write(&path, "hello").unwrap();
    let json = serde_json::to_value(inspect(&path).unwrap()).unwrap();
    assert_eq!(json["kind"], "unknown");
    assert!(json["facts"].is_object() && json["problems"][0].is_string());
    let path = folder.path().join("walk.npz");
    write_motion(&path, &small_clip("walk", 6), &[]).unwrap();
    let json = serde_json::to_value(inspect(&path).unwrap()).unwrap();
    assert_eq!(
        (&json["facts"]["frames"], &json["facts"]["frames per second"]),
        (&6.into(), &30.0.into())
    );
    assert!(inspect(&folder.path().join("absent")).is_err());
}

#[test]
fn folders_that_are_no_capture_are_described() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("coat");
    capture(&root, Vec3::ZERO);
    let message = |root: &Path| {
        let opened = Capture::open(root).map_or_else(|e| e.to_string(), |_| String::new());
        let report = inspect(root).unwrap();
        assert!(
            report.kind == FileKind::Folder && opened.contains(report.get("folder").unwrap()),
            "{opened}"
        );
        opened
    };
    std::fs::rename(root.join("capture.toml"), root.join("simulation.toml")).unwrap();
    assert!(message(&root).contains("--resume goes on"));
    std::fs::remove_file(root.join("simulation.toml")).unwrap();
    assert!(message(&root).contains("a capture without its capture.toml"));
    assert!(message(folder.path()).contains("a folder without capture.toml"));
}
