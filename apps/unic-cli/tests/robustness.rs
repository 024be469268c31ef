//! Contract: failures of disks and processes give one sentence and an exit code. Existing files
//! stay, no incomplete file gets a final name, and `--resume` leads to the bytes of an undisturbed
//! run.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;
#[path = "robustness/disk.rs"]
mod disk;
#[path = "robustness/process.rs"]
mod process;

use common::*;
use disk::{Disk, Left};
use process::{Running, Signal, stderr};
use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::Output,
    sync::LazyLock,
    time::{Duration, Instant},
};
use tempfile::TempDir;
use unic_io::{write_character, write_motion, write_obj};

/// A capture, a model trained on it, and the inputs of a simulation.
static INPUTS: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_capture(path);
    train(path, "tube.unic", "--steps 10");
    write_character(&path.join("body.npz"), &character()).unwrap();
    write_obj(&path.join("tube.obj"), &garment().rest).unwrap();
    for (seed, (name, frames)) in [("long", 40), ("short", 12), ("last", 16)]
        .into_iter()
        .enumerate()
    {
        write_motion(
            &path.join(format!("{name}.npz")),
            &unic_testdata::clip(name, seed, frames),
            &[],
        )
        .unwrap();
    }
    folder
});

/// Folder with a copy of the inputs.
fn fresh() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(INPUTS.path(), folder.path());
    folder
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &target),
            false => drop(fs::copy(entry.path(), target).unwrap()),
        }
    }
}

/// Bytes of all files below a folder by their paths, hidden files included.
fn files(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(root).into_iter().flatten().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        match entry.file_type().unwrap().is_dir() {
            true => found.extend(
                files(&entry.path())
                    .into_iter()
                    .map(|(below, bytes)| (format!("{name}/{below}"), bytes)),
            ),
            false => drop(found.insert(name, fs::read(entry.path()).unwrap())),
        }
    }
    found
}

/// Error message of a command that has failed, which must be the last line and the only one.
fn sentence(output: &Output) -> String {
    let text = stderr(output);
    let errors: Vec<&str> = text.lines().filter(|line| line.starts_with("unic: ")).collect();
    let ([error], Some(last)) = (&errors[..], text.lines().last()) else {
        panic!("expected one sentence, found: {text}")
    };
    assert_eq!(*error, last, "{text}");
    assert!(!error.contains("internal error"), "{text}");
    last.to_owned()
}

const TRAIN: &str = "train tube --preset tiny --steps 10 --out disk/m.unic --overwrite";
const SIMULATE: &str = "simulate --character body.npz --garment tube.obj --contacts 4,4,5,5 \
    --motion long.npz short.npz last.npz";
const ANIMATE: &str = "animate tube.unic --motion tube/clips/four.npz --out disk";
const EVAL: &str = "eval tube.unic tube";

/// Command lines of everything that writes files, with outputs in the folder `disk`.
fn writers() -> [String; 8] {
    [
        TRAIN.to_owned(),
        format!("{SIMULATE} --out disk/made"),
        format!("{ANIMATE}/walk.pc2"),
        format!("{ANIMATE}/walk.npz"),
        format!("{ANIMATE}/walk.glb"),
        format!("{ANIMATE}/walk"),
        format!("{EVAL} --dump disk/dump"),
        format!("{EVAL} --pictures disk/pictures"),
    ]
}

/// Does the file hold times, grow, or disappear at the end? Its bytes are not compared.
fn is_a_log(name: &str) -> bool {
    ["simulation.json", "simulation.toml", "metrics.jsonl", "log.txt"]
        .iter()
        .any(|log| name.ends_with(log))
}

/// Checks that a command on a small disk has left complete files only, and has lost no earlier
/// ones.
fn check_left(
    line: &str,
    left: &Left,
    earlier: &BTreeMap<String, Vec<u8>>,
    whole: &BTreeMap<String, Vec<u8>>,
) {
    for (name, bytes) in left.files.iter().filter(|(name, _)| !is_a_log(name)) {
        assert!(!name.ends_with(".tmp"), "unic {line} leaves {name}");
        let is_known = [earlier, whole]
            .iter()
            .any(|known| known.get(name) == Some(bytes));
        // A checkpoint holds times, so that no other run writes the same bytes.
        let is_checkpoint = || safetensors::SafeTensors::deserialize(bytes).is_ok();
        assert!(
            is_known || (name.ends_with(".safetensors") && is_checkpoint()),
            "unic {line} leaves a half-written {name}"
        );
    }
    for name in earlier.keys() {
        assert!(left.files.contains_key(name), "unic {line} loses {name}");
    }
}

#[test]
fn a_full_disk_gives_one_sentence_and_loses_no_files() {
    let Some(disk) = Disk::new() else { return };
    for line in writers() {
        let folder = fresh();
        let earlier = disk.seed(folder.path(), &[("m.unic", "tube.unic")]);
        let whole = disk.run(folder.path(), 64 << 10, &line);
        assert!(
            whole.output.status.success(),
            "unic {line}: {}",
            stderr(&whole.output)
        );
        let kilobytes = |files: &BTreeMap<_, Vec<u8>>| -> u64 {
            files
                .values()
                .map(|bytes| (bytes.len() as u64).div_ceil(4096) * 4)
                .sum()
        };
        let (before, after) = (kilobytes(&earlier), kilobytes(&whole.files));
        for percent in [2, 60, 97] {
            let left = disk.run(folder.path(), before + (after - before) * percent / 100, &line);
            let error = sentence(&left.output);
            assert_eq!(left.output.status.code(), Some(1), "unic {line}: {error}");
            assert!(
                error.contains("disk/") && error.contains("No space left") && !error.contains(".tmp"),
                "unic {line}: {error}"
            );
            check_left(&line, &left, &earlier, &whole.files);
        }
    }
}

#[test]
fn a_training_stopped_by_a_full_disk_can_be_resumed() {
    let Some(disk) = Disk::new() else { return };
    let folder = fresh();
    disk.seed(folder.path(), &[]);
    let whole = disk.run(folder.path(), 64 << 10, TRAIN);
    let model = whole.files["m.unic"].len() as u64 >> 10;
    let others: usize = whole.files.values().map(Vec::len).sum();
    // The disk has room for a checkpoint but not for the model.
    let left = disk.run(folder.path(), (others as u64 >> 10) - model / 2, TRAIN);
    assert_eq!(left.output.status.code(), Some(1));
    assert!(
        sentence(&left.output).contains("disk/m.unic: cannot write"),
        "{}",
        sentence(&left.output)
    );
    left.restore(&folder.path().join("disk"));
    succeeds(folder.path(), "train tube --out disk/m.unic --resume");
    let gone_on = tensors(&folder.path().join("disk/m.unic"));
    whole.restore(&folder.path().join("whole"));
    assert!(gone_on == tensors(&folder.path().join("whole/m.unic")));
}

#[test]
fn a_read_only_folder_gives_one_sentence() {
    let Some(disk) = Disk::new() else { return };
    let folder = fresh();
    let earlier = disk.seed(folder.path(), &[("m.unic", "tube.unic")]);
    for line in writers() {
        let left = disk.run_read_only(folder.path(), &line);
        let error = sentence(&left.output);
        assert_eq!(left.output.status.code(), Some(1), "unic {line}: {error}");
        assert!(
            error.contains("disk/") && error.contains("Read-only") && !error.contains(".tmp"),
            "unic {line}: {error}"
        );
        assert_eq!(left.files, earlier, "unic {line}");
    }
}

#[test]
fn a_full_standard_output_gives_one_sentence() {
    let Ok(full) = fs::File::options().write(true).open("/dev/full") else {
        eprintln!("skipped: there is no /dev/full");
        return;
    };
    let output = command(INPUTS.path(), "inspect tube")
        .stdout(full)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let error = sentence(&output);
    assert!(
        error.contains("stdout") && error.contains("No space left"),
        "{error}"
    );
}

/// Random numbers in 0..1 of a fixed seed (splitmix64).
struct RandomTimes(u64);

impl RandomTimes {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let bits = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (bits >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Ends and restarts a command eight times, at random times within `duration` and by all signals in
/// turn. It is restarted with --resume once the file `begun` exists.
///
/// Returns the number of times that it was still running when it was ended.
fn end_repeatedly(folder: &Path, line: &str, begun: &str, duration: Duration, seed: u64) -> usize {
    let mut times = RandomTimes(seed);
    let ways = [
        Signal::Kill,
        Signal::Interrupt,
        Signal::TerminateThenKill,
        Signal::Terminate,
    ];
    let mut caught = 0;
    for signal in ways.into_iter().cycle().take(8) {
        let mut running = Running::start(folder, &restart_line(folder, line, begun));
        running.sleep(duration.mul_f64(0.02 + 0.3 * times.next()));
        let Some(output) = running.end(signal, duration.mul_f64(0.1 * times.next())) else {
            continue;
        };
        caught += 1;
        let stderr = stderr(&output);
        let last = stderr.lines().last().unwrap_or_default();
        match output.status.code() {
            // Killed, or ended before it has installed its signal handler.
            None => {}
            Some(130) => assert!(
                last.contains("--resume") || last.contains("interrupted"),
                "{stderr}"
            ),
            other => panic!("{signal:?} of unic {line}: {other:?} {stderr}"),
        }
    }
    caught
}

/// Command line that starts or resumes the command.
fn restart_line(folder: &Path, line: &str, begun: &str) -> String {
    match folder.join(begun).exists() {
        true => format!("{line} --resume"),
        false => line.to_owned(),
    }
}

#[test]
fn training_killed_at_any_moment_ends_in_the_same_model() {
    let (whole, cut) = (fresh(), fresh());
    let line = format!("train tube {SHORT} --steps 120 --out m.unic");
    let started = Instant::now();
    succeeds(whole.path(), &line);
    let begun = "m.run/config.toml";
    let caught = end_repeatedly(cut.path(), &line, begun, started.elapsed(), 1);
    assert!(caught >= 3, "caught at work {caught} times");
    succeeds(cut.path(), &restart_line(cut.path(), &line, begun));
    let [(whole_tensors, whole_metadata), (cut_tensors, cut_metadata)] = [&whole, &cut].map(|folder| {
        let model = folder.path().join("m.unic");
        let mut metadata = metadata(&model);
        // Only times may differ, and with them the checksum of the file.
        metadata["checksum"].take();
        for time in ["seconds", "prior_seconds"] {
            metadata["about"]["training"][time].take();
        }
        (tensors(&model), metadata)
    });
    assert!(whole_tensors == cut_tensors && whole_metadata == cut_metadata);
    let [whole, cut] = [whole, cut].map(|folder| files(folder.path()));
    // An interrupted run may keep one checkpoint more.
    let names = |files: &BTreeMap<String, Vec<u8>>| -> Vec<String> {
        let is_checkpoint = |name: &&String| name.ends_with(".safetensors") && name.contains("/step-");
        let others = files.keys().filter(|name| !is_checkpoint(name));
        others.cloned().collect()
    };
    assert_eq!(names(&whole), names(&cut), "killed processes leave no files");
}

#[test]
fn simulations_killed_at_any_moment_end_in_the_same_capture() {
    let (whole, cut) = (fresh(), fresh());
    let line = format!("{SIMULATE} --threads 2 --out made");
    let started = Instant::now();
    succeeds(whole.path(), &line);
    let caught = end_repeatedly(cut.path(), &line, "made", started.elapsed(), 2);
    assert!(caught >= 3, "caught at work {caught} times");
    // A finished simulation may be resumed again.
    for _ in 0..2 {
        let summary = json(cut.path(), &format!("{line} --resume --json"));
        assert_eq!(summary["clips"].as_array().unwrap().len(), 3);
    }
    let [whole, cut] = [whole, cut].map(|folder| files(&folder.path().join("made")));
    let differing: Vec<&String> = (whole.keys().chain(cut.keys()))
        .filter(|name| !is_a_log(name) && whole.get(*name) != cut.get(*name))
        .collect();
    assert!(differing.is_empty(), "{differing:?}");
}

/// Pauses a command in the middle of its work, checks that other processes are refused with one
/// sentence, and that the command then finishes undisturbed.
fn refused_while_running(folder: &Path, line: &str, begun: &str, place: &str) {
    let mut running = Running::start(folder, line);
    running.wait_for(&folder.join(begun));
    running.signal("STOP");
    let others = ["", "--resume", "--overwrite"].map(|more| unic(folder, &format!("{line} {more}")));
    running.signal("CONT");
    for other in others {
        let message = format!("unic: {place}: another unic is writing to this folder");
        assert_eq!((other.status.code(), sentence(&other)), (Some(1), message));
    }
    let output = running.finish();
    assert!(output.status.success(), "{}", stderr(&output));
}

#[test]
fn two_processes_never_train_into_one_folder() {
    let folder = fresh();
    let line = format!("train tube {SHORT} --steps 150 --out m.unic");
    refused_while_running(folder.path(), &line, "m.run/config.toml", "m.run");
    succeeds(folder.path(), "eval m.unic tube");
    assert!(!folder.path().join("m.run/.unic.lock").exists());
}

#[test]
fn two_processes_never_simulate_into_one_folder() {
    let folder = fresh();
    let line = format!("{SIMULATE} --out made");
    refused_while_running(folder.path(), &line, "made/simulation.toml", "made");
    let made = unic_io::Capture::open(&folder.path().join("made")).unwrap();
    assert_eq!(made.clips_on_disk().unwrap().len(), 3);
    assert!(!folder.path().join("made/.unic.lock").exists());
}

#[test]
fn two_demos_never_share_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("demo")).unwrap();
    let held = fs::File::create(folder.path().join("demo/.unic.lock")).unwrap();
    held.lock().unwrap();
    let other = unic(folder.path(), "demo --quick --out demo");
    assert_eq!(other.status.code(), Some(1));
    assert_eq!(
        sentence(&other),
        "unic: demo: another unic is writing to this folder"
    );
}
