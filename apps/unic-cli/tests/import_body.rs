//! Contract: `unic import` makes a character of a body that comes as an animated surface without a rig,
//! with the joints of the motion file.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use glam::Vec3;
use std::{fs, path::Path};
use tempfile::TempDir;
use unic_core::{character::Character, clip::Clip, mesh::TriMesh};
use unic_io::{
    Capture, NpzWriter, VertexCacheWriter, alembic::AlembicWriter, usd::UsdWriter, write_bvh, write_obj,
};
use unic_testdata::{Figure, mixamo_clip};

/// Largest RMS distance of the skinned body from the animated one, metres.
const TOLERANCE_M: f32 = 1e-3;

fn import(folder: &Path, line: &str) -> serde_json::Value {
    json(folder, &format!("import {line} --force --json"))
}

/// Positions of the body of a character in a motion.
fn body(character: &Character, clip: &Clip) -> Vec<Vec<Vec3>> {
    let (mut joints, mut transforms) = (Vec::new(), Vec::new());
    let frames = clip.poses.iter().map(|pose| {
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        let mut vertices = Vec::new();
        (character.weights).skin(&character.body.vertices, &transforms, &mut vertices);
        vertices
    });
    frames.collect()
}

fn write(path: &Path, mesh: &TriMesh, frames: &[Vec<Vec3>]) {
    let mut cache = VertexCacheWriter::create(path, mesh, FPS).unwrap();
    frames.iter().for_each(|frame| cache.push(frame).unwrap());
    cache.finish().unwrap();
}

fn rms(a: &[Vec<Vec3>], b: &[Vec<Vec3>]) -> f32 {
    assert_eq!(a.len(), b.len());
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    let squares = pairs.map(|(a, b)| a.distance_squared(*b));
    (squares.sum::<f32>() / a.iter().flatten().count() as f32).sqrt()
}

/// Folder with a figure's body and garment as PC2 files, and its motion as BVH.
fn fresh() -> (TempDir, Figure, Clip) {
    let folder = tempfile::tempdir().unwrap();
    let (figure, clip) = (Figure::mixamo(), mixamo_clip("walk", 0, 30));
    let path = |name: &str| folder.path().join(name);
    write(
        &path("body.pc2"),
        &figure.character.body,
        &body(&figure.character, &clip),
    );
    write(&path("coat.pc2"), &figure.garment.rest, &figure.skinned(&clip));
    write_obj(&path("body.obj"), &figure.character.body).unwrap();
    write_obj(&path("coat.obj"), &figure.garment.rest).unwrap();
    write_bvh(&path("walk.bvh"), &clip, &figure.character.skeleton).unwrap();
    (folder, figure, clip)
}

#[test]
fn a_body_without_a_rig_gets_the_joints_of_its_motion() {
    let (folder, figure, clip) = fresh();
    let folder = folder.path();
    let line = format!(
        "--garment coat.pc2 --rest coat.obj --character body.pc2 --motion walk.bvh --fps {FPS} --out made"
    );
    let notes = import(folder, &line)["notes"].to_string();
    assert!(
        notes.contains("no rig in the file: 65 joints of walk.bvh"),
        "{notes}"
    );
    let capture = Capture::open(&folder.join("made")).unwrap();
    let imported = capture.load_clip("walk").unwrap().clip;
    let off = rms(
        &body(&capture.character, &imported),
        &body(&figure.character, &clip),
    );
    assert!(off < TOLERANCE_M, "{off} m");

    // Another clip of the body: the character of the capture stays.
    let notes = import(folder, &format!("{line} --clip again"))["notes"].to_string();
    assert!(notes.contains("the character of the capture is taken"), "{notes}");
    assert_eq!(
        Capture::open(&folder.join("made")).unwrap().character,
        capture.character
    );
}

#[test]
fn bodies_that_fit_no_motion_are_refused() {
    let (folder, figure, clip) = fresh();
    let folder = folder.path();
    let line =
        format!("import --garment coat.pc2 --rest coat.obj --motion walk.bvh --fps {FPS} --out made --force");
    let refused = |line: &str| {
        let output = unic(folder, line);
        assert!(!output.status.success() && !folder.join("made").join("capture.toml").exists());
        String::from_utf8(output.stderr).unwrap()
    };
    let away: Vec<Vec<Vec3>> = (body(&figure.character, &clip).iter().enumerate())
        .map(|(t, frame)| frame.iter().map(|v| *v + Vec3::X * 0.1 * t as f32).collect())
        .collect();
    write(&folder.join("away.pc2"), &figure.character.body, &away);
    write_obj(&folder.join("away.obj"), &figure.character.body).unwrap();
    let message = refused(&format!("{line} --character away.pc2"));
    assert!(
        message.contains("away.pc2: expected a body that the joints of the motion move"),
        "{message}"
    );
    fs::remove_file(folder.join("body.obj")).unwrap();
    let message = refused(&format!("{line} --character body.pc2"));
    assert!(
        message.contains("expected the body's faces") && message.contains("body.obj"),
        "{message}"
    );
}

/// A sequence folder whose motion has joints alone: the body is that of the OBJ files in `motion`.
#[test]
fn the_body_of_a_sequence_folder_is_read() {
    let (folder, figure, clip) = fresh();
    let folder = folder.path();
    let sequence = folder.join("sequence_03");
    fs::create_dir(&sequence).unwrap();
    write(
        &sequence.join("motion/"),
        &figure.character.body,
        &body(&figure.character, &clip),
    );
    write(
        &sequence.join("deformation/"),
        &figure.garment.rest,
        &figure.skinned(&clip),
    );
    let line = format!("--garment sequence_03 --rest coat.obj --motion walk.bvh --fps {FPS} --out made");
    let notes = import(folder, &line)["notes"].to_string();
    assert!(notes.contains("motion: no rig in the file: 65 joints"), "{notes}");
    let capture = Capture::open(&folder.join("made")).unwrap();
    let imported = capture.load_clip("sequence_03").unwrap().clip;
    let off = rms(
        &body(&capture.character, &imported),
        &body(&figure.character, &clip),
    );
    assert!(off < TOLERANCE_M, "{off} m");
}

/// A folder of sequences, each with its own motion file.
#[test]
fn a_folder_of_sequences_is_imported_whole() {
    let (folder, figure, _) = fresh();
    let folder = folder.path();
    for (seed, name) in ["sequence_1", "sequence_2"].into_iter().enumerate() {
        let (clip, sequence) = (mixamo_clip(name, seed, 12), folder.join("takes").join(name));
        fs::create_dir_all(&sequence).unwrap();
        let bodies = body(&figure.character, &clip);
        write(&sequence.join("motion/"), &figure.character.body, &bodies);
        let garments = figure.skinned(&clip);
        write(&sequence.join("deformation/"), &figure.garment.rest, &garments);
        write_bvh(&sequence.join("take.bvh"), &clip, &figure.character.skeleton).unwrap();
    }
    let line = format!("--garment takes --rest coat.obj --fps {FPS} --out made");
    let refused = |more: &str| {
        let output = unic(folder, &format!("import {line} {more}"));
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(refused("--motion walk.bvh").contains("--motion: expected a garment of one clip"));
    assert!(refused("--test sequence_3").contains("--test: expected names among sequence_1, sequence_2"));

    let summary = import(folder, &format!("{line} --test sequence_2"));
    assert_eq!(summary["imported"].as_array().unwrap().len(), 2);
    let capture = Capture::open(&folder.join("made")).unwrap();
    assert_eq!(capture.manifest.splits.train, ["sequence_1"]);
    assert_eq!(capture.manifest.splits.test, ["sequence_2"]);
    for (seed, name) in ["sequence_1", "sequence_2"].into_iter().enumerate() {
        let imported = capture.load_clip(name).unwrap();
        let expected = figure.skinned(&mixamo_clip(name, seed, 12));
        let frames: Vec<Vec<Vec3>> = imported.garment.iter().map(|f| f.to_vec()).collect();
        assert!(rms(&frames, &expected) < 1e-6, "{name}");
    }
    // A second time only what is new is read, even where its files are gone.
    assert!(refused("--test sequence_1").contains("--test: expected new clips, found sequence_1"));
    assert!(refused("--character body.pc2").contains("--character: expected a garment of one clip"));
    fs::remove_file(folder.join("takes/sequence_1/take.bvh")).unwrap();
    let summary = import(folder, &line);
    assert_eq!(summary["imported"].as_array().unwrap().len(), 0);
    assert_eq!(summary["kept"], serde_json::json!(["sequence_1", "sequence_2"]));
}

/// Every format of vertex animation gives the same character.
#[test]
fn a_body_is_read_from_every_format_of_vertex_animation() {
    let (folder, figure, clip) = fresh();
    let folder = folder.path();
    let (mesh, frames) = (&figure.character.body, body(&figure.character, &clip));
    let path = |name: &str| folder.join(name);
    let mut alembic = AlembicWriter::create(&path("body.abc"), &[("body", mesh)], FPS).unwrap();
    frames.iter().for_each(|frame| alembic.push(&[frame]).unwrap());
    alembic.finish().unwrap();
    for name in ["body.usda", "body.usdc"] {
        let mut usd = UsdWriter::create(&path(name), &[("body", mesh)], FPS).unwrap();
        frames.iter().for_each(|frame| usd.push(&[frame]).unwrap());
        usd.finish().unwrap();
    }
    write(&path("body.mdd"), mesh, &frames);
    write(&path("body.npz"), mesh, &frames);
    // Another name of the array of positions.
    let mut other = NpzWriter::create(&path("other.npz")).unwrap();
    let shape = [frames.len(), mesh.vertices.len(), 3];
    let numbers: Vec<f32> = frames.iter().flatten().flat_map(|v| v.to_array()).collect();
    other.f32s("verts", &shape, &numbers).unwrap();
    other.finish().unwrap();
    fs::copy(path("body.obj"), path("other.obj")).unwrap();
    let line = format!("--garment coat.pc2 --rest coat.obj --motion walk.bvh --fps {FPS}");
    let character = |name: &str| {
        let out = format!("made_{name}");
        import(folder, &format!("{line} --character {name} --out {out}"));
        Capture::open(&folder.join(out)).unwrap().character
    };
    let expected = character("body.pc2");
    for name in [
        "body.abc",
        "body.usda",
        "body.usdc",
        "body.mdd",
        "body.npz",
        "other.npz",
    ] {
        assert!(character(name) == expected, "{name}");
    }
}
