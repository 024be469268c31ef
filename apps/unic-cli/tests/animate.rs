//! Contract: `unic animate` writes a complete GLB and a complete Alembic file, and never overwrites
//! files without `--overwrite`, folders or its inputs.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use serde_json::Value;
use std::{collections::BTreeMap, fs, path::Path, sync::LazyLock};
use tempfile::TempDir;
use unic_builtin::motion::{STANDARD_SEED, standard_clip};
use unic_cli::garments::Shipped;
use unic_core::{Model, Precision};

/// A capture and a model trained on it.
static TRAINED: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    train(folder.path(), "tube.unic", "--steps 10");
    folder
});

/// Folder with a copy of the model and of one motion.
fn fresh() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (from, to) in [("tube.unic", "tube.unic"), ("tube/clips/four.npz", "four.npz")] {
        fs::copy(TRAINED.path().join(from), folder.path().join(to)).unwrap();
    }
    folder
}

const ANIMATE: &str = "animate tube.unic --motion four.npz";

/// Names and bytes of the files in a folder. Folders in it have no bytes.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    entries
        .map(|entry| {
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read(entry.path()).unwrap_or_default())
        })
        .collect()
}

/// Runs a command that must fail and change no files. Returns the last line of stderr.
fn refusal(folder: &Path, line: &str) -> String {
    let before = contents(folder);
    let output = unic(folder, line);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(
        matches!(output.status.code(), Some(1 | 2)),
        "unic {line}: {stderr}"
    );
    assert!(contents(folder) == before, "unic {line} changes files");
    let error = stderr.lines().last().unwrap_or_default();
    assert!(error.starts_with("unic: "), "unic {line}: {stderr}");
    error.to_owned()
}

/// JSON document of a GLB.
fn document(path: &Path) -> Value {
    let bytes = fs::read(path).unwrap();
    assert!(bytes.starts_with(b"glTF\x02\0\0\0"));
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

#[test]
fn a_glb_contains_body_and_garment() {
    let folder = fresh();
    let summary = json(folder.path(), &format!("{ANIMATE} --out a.glb --json"));
    assert_eq!(summary["written"], serde_json::json!(["a.glb", "a.png"]));
    assert_eq!(summary["frames"], FRAMES);
    let glb = document(&folder.path().join("a.glb"));
    let positions = |mesh: usize| {
        let accessor = &glb["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"];
        glb["accessors"][accessor.as_u64().unwrap() as usize]["count"].clone()
    };
    assert_eq!(positions(0), BODY_VERTICES);
    assert_eq!(positions(1), VERTICES);
    let targets = &glb["meshes"][1]["primitives"][0]["targets"];
    assert_eq!(targets.as_array().unwrap().len(), FRAMES - 1);
    assert_eq!(glb["skins"][0]["joints"].as_array().unwrap().len(), JOINTS);
    assert_eq!(glb["animations"][0]["name"], "four");
}

#[test]
fn an_alembic_file_contains_the_frames_of_body_and_garment() {
    let folder = fresh();
    let summary = json(folder.path(), &format!("{ANIMATE} --out a.abc --json"));
    assert_eq!(summary["written"], serde_json::json!(["a.abc", "a.png"]));
    succeeds(folder.path(), &format!("{ANIMATE} --out b.pc2"));
    let mut archive = ogawa::Archive::open(folder.path().join("a.abc")).unwrap();
    let meshes = archive.meshes().unwrap();
    assert_eq!(meshes.len(), 2);
    for (mesh, name, cache) in [
        (&meshes[0], "/garment/garmentShape", "b"),
        (&meshes[1], "/body/bodyShape", "b.body"),
    ] {
        assert_eq!(archive.full_name(mesh.object()), name);
        assert_eq!(mesh.frames() as usize, FRAMES);
        let time = mesh.time(&archive, 1);
        assert!((time - 1.0 / summary["fps"].as_f64().unwrap()).abs() < 1e-6);
        let cache = |ending| folder.path().join(format!("{cache}.{ending}"));
        let expected = unic_io::read_vertex_cache(&cache("pc2")).unwrap().frames;
        let mut positions = Vec::new();
        for (frame, expected) in (0..).zip(expected.iter()) {
            mesh.world_positions(&mut archive, frame, &mut positions).unwrap();
            assert!(positions.iter().eq(expected.iter().map(AsRef::as_ref)));
        }
        let faces = mesh.faces(&mut archive, 0).unwrap();
        let expected = unic_io::read_obj(&cache("obj")).unwrap().faces;
        assert_eq!(faces.corners(), expected.as_flattened());
    }
}

#[test]
fn a_glb_of_more_than_300_frames_is_refused() {
    let folder = fresh();
    // One cycle of the motion, repeated.
    let long = format!("{ANIMATE} --repeat 60 --out a.glb");
    let message = refusal(folder.path(), &long);
    assert!(
        message.starts_with("unic: a.glb: expected 1 to 300 frames"),
        "{message}"
    );
    for other in [".pc2", ".npz", "OBJ"] {
        assert!(message.contains(other), "{message}");
    }
    succeeds(folder.path(), &format!("{long} --frames 0..300"));
}

#[test]
fn files_are_overwritten_only_with_overwrite() {
    for side_file in ["a.pc2", "a.body.pc2", "a.obj", "a.body.obj", "a.png"] {
        let folder = fresh();
        fs::write(folder.path().join(side_file), "somebody's work").unwrap();
        let message = refusal(folder.path(), &format!("{ANIMATE} --out a.pc2"));
        assert!(message.starts_with(&format!("unic: {side_file}: ")), "{message}");
        assert!(message.contains("--overwrite"), "{message}");
        succeeds(folder.path(), &format!("{ANIMATE} --out a.pc2 --overwrite"));
        assert!(fs::read(folder.path().join(side_file)).unwrap() != b"somebody's work");
    }
}

#[test]
fn folders_are_never_overwritten() {
    for name in ["frames", "frames_body", "frames.png"] {
        let folder = fresh();
        fs::create_dir(folder.path().join(name)).unwrap();
        for more in ["", "--overwrite"] {
            let message = refusal(folder.path(), &format!("{ANIMATE} --out frames {more}"));
            assert!(message.starts_with(&format!("unic: {name}: ")), "{message}");
        }
    }
}

#[test]
fn outputs_that_are_equal_or_inputs_are_refused() {
    let folder = fresh();
    for (line, name) in [
        ("--out a.glb --picture a.glb", "a.glb"),
        ("--out a.pc2 --picture a.body.obj --overwrite", "a.body.obj"),
        ("--out b.npz --picture four.npz --overwrite", "four.npz"),
        ("--out a.fbx", "a.fbx"),
    ] {
        let message = refusal(folder.path(), &format!("{ANIMATE} {line}"));
        assert!(message.starts_with(&format!("unic: {name}: ")), "{message}");
    }
}

#[test]
fn built_in_motions_are_animated_by_name() {
    let folder = fresh();
    fs::write(folder.path().join("skirt.unic"), Shipped::Skirt.bytes()).unwrap();
    // A file of that name does not change what the name means.
    fs::write(folder.path().join("dance"), "no motion").unwrap();
    let character = Shipped::Skirt.model().unwrap().character().clone();
    let clip = standard_clip(&character, "dance", STANDARD_SEED, 30.0)
        .unwrap()
        .unwrap();
    unic_io::write_motion(&folder.path().join("file.npz"), &clip, character.skeleton.names()).unwrap();
    let positions = ["dance", "file.npz"].map(|motion| {
        let line = format!("animate skirt.unic --motion {motion} --frames 60..62 --out made.npz --overwrite");
        succeeds(folder.path(), &line);
        let made = unic_io::read_vertex_cache(&folder.path().join("made.npz")).unwrap();
        made.frames.frame(1).to_vec()
    });
    let distances = positions[0]
        .iter()
        .zip(&positions[1])
        .map(|(a, b)| a.distance(*b));
    let farthest = distances.fold(0.0, f32::max);
    // The file has rounded poses.
    assert!(farthest < 1e-3, "{farthest} m");

    // The folder of the frames may be called like the motion.
    fs::remove_file(folder.path().join("dance")).unwrap();
    succeeds(
        folder.path(),
        "animate skirt.unic --motion dance --frames 0..2 --out dance",
    );
    assert!(folder.path().join("dance/frame_0001.obj").exists());

    let error = refusal(folder.path(), "animate skirt.unic --motion dence --out dence.npz");
    assert!(
        error.contains("dence: expected a motion file or one of idle"),
        "{error}"
    );
    let error = refusal(folder.path(), "animate tube.unic --motion dance --out other.npz");
    assert!(
        error.contains("dance: ") && error.contains("24 joints of SMPL"),
        "{error}"
    );
}

#[test]
fn a_precision_that_is_slower_than_f32_is_told_once() {
    let folder = fresh();
    let bytes = fs::read(folder.path().join("tube.unic")).unwrap();
    let width = Model::from_bytes(&bytes).unwrap().config().field.width;
    let told = |precision: &str| {
        let line = format!("{ANIMATE} --precision {precision} --out {precision}.pc2");
        let output = unic(folder.path(), &line);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{told}");
        told.matches("is slower than f32").count()
    };
    assert_eq!(told("auto"), 0);
    for precision in Precision::ALL {
        let expected = usize::from(precision.is_slower_than_f32(width));
        assert_eq!(told(precision.name()), expected, "{}", precision.name());
    }
}
