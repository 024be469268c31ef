//! Small synthetic captures, and the program run as a user runs it.
#![allow(
    dead_code,
    unused_imports,
    reason = "every test file is a program of its own and uses only some of these items"
)]

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
};
use unic_core::character::{Character, Garment};
use unic_io::Split;
pub(crate) use unic_testdata::{BODY_VERTICES, FPS, JOINTS, VERTICES};
use unic_testdata::{Figure, take};

pub(crate) const FRAMES: usize = 30;

pub(crate) fn character() -> Character {
    Figure::tube().character
}

pub(crate) fn garment() -> Garment {
    Figure::tube().garment
}

/// Writes the capture `folder`/tube with two training clips, one validation clip and two test
/// clips.
pub(crate) fn write_capture(folder: &Path) -> PathBuf {
    write_splits(folder, Split::Validation)
}

/// Writes the capture `folder`/tube with three training clips and no validation clip.
///
/// The seed then draws the training clip that is held out.
pub(crate) fn write_capture_without_validation(folder: &Path) -> PathBuf {
    write_splits(folder, Split::Train)
}

fn write_splits(folder: &Path, third: Split) -> PathBuf {
    let root = folder.join("tube");
    let splits = [
        ("one", Split::Train),
        ("two", Split::Train),
        ("three", third),
        ("four", Split::Test),
        ("five", Split::Test),
    ];
    let clips: Vec<_> = splits
        .into_iter()
        .enumerate()
        .map(|(seed, (name, split))| (take(name, seed, FRAMES), split))
        .collect();
    unic_testdata::write_capture(&root, &Figure::tube(), &clips);
    root
}

/// Command that runs the program in `folder` with the arguments of `line`.
pub(crate) fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_unic"));
    command.current_dir(folder).args(line.split_whitespace());
    command
}

/// Runs the program in `folder` with the arguments of `line`.
pub(crate) fn unic(folder: &Path, line: &str) -> Output {
    command(folder, line).output().unwrap()
}

/// Runs the program, which must succeed. Returns its stdout.
pub(crate) fn succeeds(folder: &Path, line: &str) -> String {
    let output = unic(folder, line);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "unic {line}: {:?}\n{stderr}",
        output.status
    );
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the program, which must succeed. Returns the JSON object on its stdout.
pub(crate) fn json(folder: &Path, line: &str) -> serde_json::Value {
    serde_json::from_str(&succeeds(folder, line)).unwrap()
}

/// Options of a training that takes seconds.
pub(crate) const SHORT: &str = "--preset tiny --set optimiser.warmup=0.1 --set validation.every=20";

/// Trains the model `out` on the capture tube. Returns the summary.
pub(crate) fn train(folder: &Path, out: &str, more: &str) -> serde_json::Value {
    json(folder, &format!("train tube {SHORT} --out {out} --json {more}"))
}

/// Names and bytes of the tensors of a model, sorted by name.
pub(crate) fn tensors(path: &Path) -> Vec<(String, Vec<u8>)> {
    let bytes = std::fs::read(path).unwrap();
    let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    let mut all: Vec<_> = file
        .tensors()
        .into_iter()
        .map(|(name, t)| (name, t.data().to_vec()))
        .collect();
    all.sort();
    assert!(all.len() > 8);
    all
}

/// Metadata of a model file.
pub(crate) fn metadata(path: &Path) -> serde_json::Value {
    let bytes = std::fs::read(path).unwrap();
    let (_, header) = safetensors::SafeTensors::read_metadata(&bytes).unwrap();
    serde_json::from_str(&header.metadata().as_ref().unwrap()["unic"]).unwrap()
}
