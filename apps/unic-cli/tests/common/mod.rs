//! A small synthetic capture, and the program driven as a user does.
#![allow(
    dead_code,
    unused_imports,
    reason = "every test file is a program of its own and uses a part of this"
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

/// Writes the capture `folder`/tube: two training clips, one to validate, two to test.
pub(crate) fn write_capture(folder: &Path) -> PathBuf {
    write_splits(folder, Split::Validation)
}

/// The same with the clip "three" to train on, so that the seed draws one to validate.
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
    let takes: Vec<_> = splits
        .into_iter()
        .enumerate()
        .map(|(seed, (name, split))| (take(name, seed, FRAMES), split))
        .collect();
    unic_testdata::write_capture(&root, &Figure::tube(), &takes);
    root
}

/// The program with these arguments, in `folder`.
pub(crate) fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_unic"));
    command.current_dir(folder).args(line.split_whitespace());
    command
}

pub(crate) fn unic(folder: &Path, line: &str) -> Output {
    command(folder, line).output().unwrap()
}

/// Stdout of a run that must succeed.
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

/// The one JSON object that a run prints.
pub(crate) fn json(folder: &Path, line: &str) -> serde_json::Value {
    serde_json::from_str(&succeeds(folder, line)).unwrap()
}

/// Settings that make a run of seconds.
pub(crate) const SHORT: &str = "--preset tiny --set optimiser.warmup_steps=5 --set validation.every=20";

/// Trains `out` on tube.
pub(crate) fn train(folder: &Path, out: &str, more: &str) -> serde_json::Value {
    json(folder, &format!("train tube {SHORT} --out {out} --json {more}"))
}

/// Name and bytes of each tensor of a model, in the order of names.
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

/// What a model tells about itself.
pub(crate) fn metadata(path: &Path) -> serde_json::Value {
    let bytes = std::fs::read(path).unwrap();
    let (_, header) = safetensors::SafeTensors::read_metadata(&bytes).unwrap();
    serde_json::from_str(&header.metadata().as_ref().unwrap()["unic"]).unwrap()
}
