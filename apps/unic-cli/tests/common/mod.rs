//! Small synthetic captures, and the program run as a user runs it.
#![allow(
    dead_code,
    unused_imports,
    reason = "every test file is a program of its own and uses only some of these items"
)]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    thread::sleep,
    time::{Duration, Instant},
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
    let bytes = fs::read(path).unwrap();
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
    let bytes = fs::read(path).unwrap();
    let (_, header) = safetensors::SafeTensors::read_metadata(&bytes).unwrap();
    serde_json::from_str(&header.metadata().as_ref().unwrap()["unic"]).unwrap()
}

/// Sends the signal of Ctrl-C.
pub(crate) fn interrupt(child: &Child) {
    let killed = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
}

/// Waits until a path exists.
pub(crate) fn wait_for(path: &Path) {
    wait_until(|| path.exists(), &format!("{}", path.display()));
}

/// Waits until a file has a line that contains `word`.
pub(crate) fn wait_for_line(path: &Path, word: &str) {
    let is_there = |text: String| text.lines().any(|line| line.contains(word));
    let what = format!("{word} in {}", path.display());
    wait_until(|| fs::read_to_string(path).is_ok_and(is_there), &what);
}

fn wait_until(is_there: impl Fn() -> bool, what: &str) {
    let started = Instant::now();
    while !is_there() {
        assert!(started.elapsed() < Duration::from_secs(120), "no {what}");
        sleep(Duration::from_millis(5));
    }
}

/// Runs `line` until the file `watched` has a line with `word`, then interrupts it. Returns stderr.
pub(crate) fn interrupted(folder: &Path, line: &str, watched: &str, word: &str) -> String {
    let mut command = command(folder, line);
    let child = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_line(&folder.join(watched), word);
    interrupt(&child);
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    stderr
}
