//! Contract: bad input gives exit code 1 or 2 and one sentence on stderr that names the file. No
//! file is written.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::{fs, path::Path, sync::LazyLock};
use tempfile::TempDir;
use unic_io::NpzWriter;

/// A capture and a model trained on it; tests that damage them copy them first.
static TRAINED: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    train(folder.path(), "tube.unic", "--steps 10");
    folder
});

/// Folder with a copy of the capture and the model.
fn fresh() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    fs::copy(TRAINED.path().join("tube.unic"), folder.path().join("tube.unic")).unwrap();
    folder
}

/// Runs a command that must fail with one line that contains `word`, and write no files.
fn fails(folder: &Path, line: &str, word: &str) {
    let before = listing(folder);
    let output = unic(folder, line);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(
        matches!(output.status.code(), Some(1 | 2)),
        "unic {line}: {:?} {stderr}",
        output.status
    );
    let [error] = stderr.lines().collect::<Vec<_>>()[..] else {
        panic!("unic {line}: {stderr}")
    };
    assert!(
        error.starts_with("unic: ") && error.contains(word),
        "unic {line}: expected {word} in: {error}"
    );
    assert!(
        !stderr.contains("panicked") && !stderr.contains("internal error"),
        "unic {line}: {stderr}"
    );
    assert!(
        output.stdout.is_empty() || line.starts_with("inspect"),
        "unic {line} prints a result"
    );
    assert_eq!(listing(folder), before, "unic {line} leaves files");
}

fn listing(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

const TRAIN: &str = "train tube --preset tiny --steps 10 --out new.unic";
const EVAL: &str = "eval tube.unic tube";
const ANIMATE: &str = "animate tube.unic --motion tube/clips/four.npz --out a.pc2";

#[test]
fn missing_files() {
    let folder = fresh();
    fails(folder.path(), "train nowhere --out new.unic", "nowhere");
    fails(folder.path(), "eval nothing.unic tube", "nothing.unic");
    fails(folder.path(), "eval --baselines nowhere", "nowhere");
    fails(
        folder.path(),
        "animate nothing.unic --motion tube/clips/four.npz --out a.pc2",
        "nothing.unic",
    );
    fails(
        folder.path(),
        "animate tube.unic --motion nothing.npz --out a.pc2",
        "nothing.npz",
    );
    fails(
        folder.path(),
        &format!("{ANIMATE} --mesh nothing.obj"),
        "nothing.obj",
    );
    fails(
        folder.path(),
        &format!("{ANIMATE} --start nothing.obj"),
        "nothing.obj",
    );
    fails(folder.path(), "inspect nothing", "nothing");
    fails(
        folder.path(),
        &format!("{TRAIN} --config nothing.toml"),
        "nothing.toml",
    );
    fs::remove_file(folder.path().join("tube/clips/one.npz")).unwrap();
    fails(folder.path(), TRAIN, "one.npz");
}

#[test]
fn truncated_archives() {
    for name in ["character.npz", "clips/one.npz", "clips/one.garment.npy"] {
        let folder = fresh();
        let path = folder.path().join("tube").join(name);
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let word = Path::new(name).file_name().unwrap().to_str().unwrap();
        fails(folder.path(), TRAIN, word);
        fails(folder.path(), "inspect tube", word);
        fails(folder.path(), EVAL, word);
    }
}

#[test]
fn a_capture_of_another_version() {
    let folder = fresh();
    let path = folder.path().join("tube/capture.toml");
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains("version = 1"));
    fs::write(&path, text.replace("version = 1", "version = 7")).unwrap();
    fails(folder.path(), TRAIN, "capture.toml");
    fs::write(&path, text.replace("fps", "frames_a_second")).unwrap();
    fails(folder.path(), TRAIN, "capture.toml");
    fs::write(&path, "version = = 1\n").unwrap();
    fails(folder.path(), TRAIN, "capture.toml");
}

#[test]
fn a_garment_with_nan() {
    let folder = fresh();
    let path = folder.path().join("tube/clips/one.garment.npy");
    let mut bytes = fs::read(&path).unwrap();
    let end = bytes.len();
    bytes[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(&path, bytes).unwrap();
    fails(folder.path(), TRAIN, "one.garment.npy");
    fails(folder.path(), EVAL, "one.garment.npy");
}

fn write_clip(path: &Path, frames: usize, joints: usize, value: f32) {
    let mut npz = NpzWriter::create(path).unwrap();
    npz.f32s("poses", &[frames, 3 * joints], &vec![value; frames * 3 * joints])
        .unwrap();
    npz.f32s("trans", &[frames, 3], &vec![0.0; frames * 3]).unwrap();
    npz.f64s("mocap_framerate", &[], &[f64::from(FPS)]).unwrap();
    npz.finish().unwrap();
}

#[test]
fn motions_that_do_not_fit() {
    let folder = fresh();
    for (name, frames, joints, value) in [
        ("joints", 30, JOINTS + 1, 0.0),
        ("empty", 0, JOINTS, 0.0),
        ("short", 1, JOINTS, 0.0),
        ("nan", 30, JOINTS, f32::NAN),
    ] {
        let file = format!("{name}.npz");
        write_clip(&folder.path().join(&file), frames, joints, value);
        fails(
            folder.path(),
            &format!("animate tube.unic --motion {file} --out a.pc2"),
            &file,
        );
        fs::copy(
            folder.path().join(&file),
            folder.path().join("tube/clips/two.npz"),
        )
        .unwrap();
        fails(folder.path(), TRAIN, "two");
        fails(folder.path(), EVAL, "two");
    }
    fails(
        folder.path(),
        "animate tube.unic --motion tube/garment.npz --out a.pc2",
        "garment.npz",
    );
    fails(folder.path(), &format!("{ANIMATE} --frames 10..999"), "four.npz");
    fails(
        folder.path(),
        &format!("{ANIMATE} --start tube/character.npz"),
        "character.npz",
    );
}

#[test]
fn a_character_that_does_not_fit_its_weights() {
    let folder = fresh();
    let path = folder.path().join("tube/character.npz");
    let character = common::character();
    let mut npz = NpzWriter::create(&path).unwrap();
    npz.f32s("vertices", &[3, 3], &[0.0; 9]).unwrap();
    npz.i32s("faces", &[1, 3], &[0, 1, 2]).unwrap();
    npz.f32s("joints", &[JOINTS, 3], &[0.0; 3 * JOINTS]).unwrap();
    npz.i32s("parents", &[JOINTS], &[-1, 0, 0, 0, 0, 0]).unwrap();
    npz.f32s("weights", &[3, 5], &[0.2; 15]).unwrap();
    npz.text("joint_names", character.skeleton.names()).unwrap();
    npz.finish().unwrap();
    fails(folder.path(), TRAIN, "character.npz");
}

#[test]
fn damaged_models() {
    let folder = fresh();
    let path = folder.path().join("tube.unic");
    let bytes = fs::read(&path).unwrap();
    let text = b"{\\\"version\\\":1";
    let place = bytes.windows(text.len()).position(|w| w == text).unwrap();
    let mut newer = bytes.clone();
    newer[place + text.len() - 1] = b'9';
    let mut damaged = bytes.clone();
    *damaged.last_mut().unwrap() ^= 1;
    for content in [
        b"garbage".to_vec(),
        Vec::new(),
        bytes[..bytes.len() - 100].to_vec(),
        newer,
        damaged,
    ] {
        fs::write(&path, content).unwrap();
        fails(folder.path(), EVAL, "tube.unic");
        fails(folder.path(), ANIMATE, "tube.unic");
        fails(folder.path(), "inspect tube.unic", "tube.unic");
    }
}

#[test]
fn a_model_of_another_garment() {
    let folder = fresh();
    let mut mesh = garment().rest;
    mesh.vertices.truncate(48);
    mesh.faces.retain(|face| face.iter().all(|&v| v < 48));
    unic_io::write_obj(&folder.path().join("tube/garment.obj"), &mesh).unwrap();
    fs::remove_file(folder.path().join("tube/garment.npz")).unwrap();
    fails(folder.path(), EVAL, "tube.unic");
    fails(folder.path(), TRAIN, "garment.npy");
}

#[test]
fn invalid_settings() {
    let folder = fresh();
    fails(
        folder.path(),
        &format!("{TRAIN} --set optimiser.stepz=7"),
        "stepz",
    );
    fails(
        folder.path(),
        &format!("{TRAIN} --set batch.points=none"),
        "points",
    );
    fails(
        folder.path(),
        &format!("{TRAIN} --set batch.points=0"),
        "batch.points",
    );
    fails(folder.path(), &format!("{TRAIN} --set seed"), "seed");
    fails(
        folder.path(),
        &format!("{TRAIN} --set batch.windows=60000 --set batch.points=1000"),
        "product of batch.windows, batch.points",
    );
    fails(
        folder.path(),
        &format!("{TRAIN} --set validation.refit=sometimes"),
        "all_clips",
    );
    fs::write(folder.path().join("s.toml"), "[optimiser]\nsteps = \"many\"\n").unwrap();
    fails(folder.path(), &format!("{TRAIN} --config s.toml"), "s.toml");
}

#[test]
fn outputs_that_cannot_be_written() {
    let folder = fresh();
    // A path below a file cannot be written even by the superuser, who may run the tests.
    fails(
        folder.path(),
        "train tube --preset tiny --out tube.unic/new.unic",
        "tube.unic",
    );
    fails(folder.path(), "train tube --preset tiny --out tube", "tube");
    fails(
        folder.path(),
        &format!("{EVAL} --dump tube.unic/dump"),
        "tube.unic/dump",
    );
    fails(
        folder.path(),
        &format!("{EVAL} --pictures tube.unic/worst"),
        "tube.unic/worst",
    );
    fails(
        folder.path(),
        &ANIMATE.replace("a.pc2", "tube.unic/a.pc2"),
        "tube.unic",
    );
    fails(folder.path(), &ANIMATE.replace("a.pc2", "a.fbx"), "a.fbx");
    // The picture is opened last and fails: the files opened before it must not stay.
    fails(
        folder.path(),
        &format!("{ANIMATE} --picture tube.unic/a.png"),
        "tube.unic",
    );
    fails(folder.path(), &ANIMATE.replace("a.pc2", "tube"), "tube");
}

#[test]
fn outputs_that_would_replace_an_input() {
    let folder = fresh();
    let clip = "tube/clips/four.npz";
    assert!(ANIMATE.contains(clip), "{ANIMATE}");
    let before = fs::read(folder.path().join(clip)).unwrap();
    fails(folder.path(), &ANIMATE.replace("a.pc2", clip), "is no input");
    fs::copy(
        folder.path().join("tube/garment.obj"),
        folder.path().join("a.obj"),
    )
    .unwrap();
    fails(folder.path(), &format!("{ANIMATE} --mesh a.obj"), "a.obj");
    assert_eq!(fs::read(folder.path().join(clip)).unwrap(), before);
}

#[test]
fn captures_without_clips() {
    let folder = fresh();
    let path = folder.path().join("tube/capture.toml");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(
        &path,
        text.replace("\"one\"", "")
            .replace("\"two\"", "")
            .replace(",\n", "\n")
            .replace("    \n", ""),
    )
    .unwrap();
    fails(folder.path(), TRAIN, "tube");
    fs::write(&path, text.replace("\"four\"", "\"nowhere\"")).unwrap();
    fails(folder.path(), EVAL, "nowhere");
    fs::write(&path, text).unwrap();
    fails(folder.path(), &format!("{EVAL} --clips nowhere"), "nowhere");
}

#[test]
fn invalid_command_lines() {
    let folder = tempfile::tempdir().unwrap();
    for line in [
        "",
        "trian tube",
        "eval tube",
        "train tube --budget 5",
        "train tube --resume --overwrite",
        "animate m.unic --motion a.npz",
        "animate m.unic --motion a.npz --out a.pc2 --frames 9..3",
        "inspect tube --threads 0",
    ] {
        let output = unic(folder.path(), line);
        assert_eq!(output.status.code(), Some(2), "unic {line}");
        assert!(
            output.stdout.is_empty() && !output.stderr.is_empty(),
            "unic {line}"
        );
    }
}
