//! A small synthetic capture, and the program run as a user runs it.
#![allow(
    dead_code,
    reason = "every test file is a program of its own and uses a part of this"
)]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};
use unic_io::Split;
use unic_testdata::{Figure, take};

const FRAMES: usize = 30;

/// Settings of a row whose training takes seconds.
const TINY_ROW: &str = "title = 'mine'\npreset = 'tiny'\nremove = ['model.state.displacement.recurrence']\n\
                        [model.state.displacement]\nprior_shapes = 4\n";

/// Writes the capture `folder`/tube: two training clips, one to validate, two to test.
pub(crate) fn write_capture(folder: &Path) {
    let splits = [
        ("one", Split::Train),
        ("two", Split::Train),
        ("three", Split::Validation),
        ("four", Split::Test),
        ("five", Split::Test),
    ];
    let takes: Vec<_> = (splits.into_iter().enumerate())
        .map(|(seed, (name, split))| (take(name, seed, FRAMES), split))
        .collect();
    unic_testdata::write_capture(&folder.join("tube"), &Figure::tube(), &takes);
}

/// Writes the settings of a row that trains in seconds, `folder`/mine.toml.
pub(crate) fn write_tiny_row(folder: &Path) {
    fs::write(folder.join("mine.toml"), TINY_ROW).unwrap();
}

/// Runs `unic-lab` with these arguments in `folder`.
pub(crate) fn lab(folder: &Path, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_unic-lab"));
    command.current_dir(folder).args(line.split_whitespace());
    command.output().unwrap()
}

/// Runs `unic-lab` and returns its standard output. Panics where the run fails.
pub(crate) fn succeeds(folder: &Path, line: &str) -> String {
    let output = lab(folder, line);
    assert!(
        output.status.success(),
        "unic-lab {line}: {:?}\n{}",
        output.status,
        text(&output.stderr)
    );
    text(&output.stdout)
}

/// Runs `unic-lab` and returns the JSON object that it prints.
pub(crate) fn json(folder: &Path, line: &str) -> serde_json::Value {
    serde_json::from_str(&succeeds(folder, line)).unwrap()
}

/// Returns the bytes of a stream as text.
pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
