//! What happens to disks, processes and folders: every failure is one sentence and an exit code, what was
//! there stays, nothing half-written gets a final name, and `--resume` leads to the very bytes of a run
//! that nothing has disturbed.
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

/// A capture, a model trained on it, and what a simulation takes.
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

/// A copy of them.
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

/// Bytes of all files below a folder by their paths, hidden ones too.
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

/// The one sentence of a command that has failed.
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

/// Everything that writes, with what it writes to `disk`.
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

/// Files that tell the time or grow, and the one that goes at the end.
fn is_a_log(name: &str) -> bool {
    ["simulation.json", "simulation.toml", "metrics.jsonl", "log.txt"]
        .iter()
        .any(|log| name.ends_with(log))
}

/// What a command has left on a disk that was too small: whole files alone, and nothing of the earlier
/// ones has changed.
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
        // A checkpoint holds seconds: no other run writes the same bytes.
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
fn a_full_disk_is_one_sentence_and_loses_nothing() {
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
fn what_a_full_disk_has_stopped_goes_on_when_there_is_room() {
    let Some(disk) = Disk::new() else { return };
    let folder = fresh();
    disk.seed(folder.path(), &[]);
    let whole = disk.run(folder.path(), 64 << 10, TRAIN);
    let model = whole.files["m.unic"].len() as u64 >> 10;
    let others: usize = whole.files.values().map(Vec::len).sum();
    // Room for a checkpoint, not for the model.
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
fn a_read_only_folder_is_one_sentence() {
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
fn a_full_standard_output_is_one_sentence() {
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

/// Numbers in 0..1, the same in every run (splitmix64).
struct Moments(u64);

impl Moments {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let bits = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (bits >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Ends a command again and again at moments spread over `duration`, in every way in turn, and starts it
/// again as a user does: `line`, with --resume once `begun` exists. Times that it was caught at work.
fn end_again_and_again(folder: &Path, line: &str, begun: &str, duration: Duration, seed: u64) -> usize {
    let mut moments = Moments(seed);
    let ways = [
        Signal::Kill,
        Signal::Interrupt,
        Signal::TerminateThenKill,
        Signal::Terminate,
    ];
    let mut caught = 0;
    for signal in ways.into_iter().cycle().take(8) {
        let mut running = Running::start(folder, &again(folder, line, begun));
        running.sleep(duration.mul_f64(0.02 + 0.3 * moments.next()));
        let Some(output) = running.end(signal, duration.mul_f64(0.1 * moments.next())) else {
            continue;
        };
        caught += 1;
        let told = stderr(&output);
        let last = told.lines().last().unwrap_or_default();
        match output.status.code() {
            // Killed, or before it listens to signals.
            None => {}
            Some(130) => assert!(
                last.contains("--resume") || last.contains("interrupted"),
                "{told}"
            ),
            other => panic!("{signal:?} of unic {line}: {other:?} {told}"),
        }
    }
    caught
}

fn again(folder: &Path, line: &str, begun: &str) -> String {
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
    let caught = end_again_and_again(cut.path(), &line, begun, started.elapsed(), 1);
    assert!(caught >= 3, "caught at work {caught} times");
    succeeds(cut.path(), &again(cut.path(), &line, begun));
    let [(tensors_whole, told_whole), (tensors_cut, told_cut)] = [&whole, &cut].map(|folder| {
        let model = folder.path().join("m.unic");
        let mut told = metadata(&model);
        // Time is all that may differ, and with it the checksum of the file.
        told["checksum"].take();
        for time in ["seconds", "prior_seconds"] {
            told["about"]["training"][time].take();
        }
        (tensors(&model), told)
    });
    assert!(tensors_whole == tensors_cut && told_whole == told_cut);
    let [whole, cut] = [whole, cut].map(|folder| files(folder.path()));
    // An interrupted run leaves one checkpoint more.
    let names = |files: &BTreeMap<String, Vec<u8>>| -> Vec<String> {
        let is_checkpoint = |name: &&String| name.ends_with(".safetensors") && name.contains("/step-");
        let others = files.keys().filter(|name| !is_checkpoint(name));
        others.cloned().collect()
    };
    assert_eq!(names(&whole), names(&cut), "nothing is left of the killed ones");
}

#[test]
fn simulations_killed_at_any_moment_end_in_the_same_capture() {
    let (whole, cut) = (fresh(), fresh());
    let line = format!("{SIMULATE} --threads 2 --out made");
    let started = Instant::now();
    succeeds(whole.path(), &line);
    let caught = end_again_and_again(cut.path(), &line, "made", started.elapsed(), 2);
    assert!(caught >= 3, "caught at work {caught} times");
    // Whatever has been reached, asking once more is right.
    for _ in 0..2 {
        let told = json(cut.path(), &format!("{line} --resume --json"));
        assert_eq!(told["clips"].as_array().unwrap().len(), 3);
    }
    let [whole, cut] = [whole, cut].map(|folder| files(&folder.path().join("made")));
    let differing: Vec<&String> = (whole.keys().chain(cut.keys()))
        .filter(|name| !is_a_log(name) && whole.get(*name) != cut.get(*name))
        .collect();
    assert!(differing.is_empty(), "{differing:?}");
}

/// While one process stands still in the middle of its work, others are refused in one sentence and it
/// then goes on as if they had never been.
fn refused_while(folder: &Path, line: &str, begun: &str, place: &str) {
    let mut running = Running::start(folder, line);
    running.wait_for(&folder.join(begun));
    running.signal("STOP");
    let others = ["", "--resume", "--overwrite"].map(|more| unic(folder, &format!("{line} {more}")));
    running.signal("CONT");
    for other in others {
        let told = format!("unic: {place}: another unic is writing to this folder");
        assert_eq!((other.status.code(), sentence(&other)), (Some(1), told));
    }
    let output = running.finish();
    assert!(output.status.success(), "{}", stderr(&output));
}

#[test]
fn two_processes_never_train_into_one_folder() {
    let folder = fresh();
    let line = format!("train tube {SHORT} --steps 150 --out m.unic");
    refused_while(folder.path(), &line, "m.run/config.toml", "m.run");
    succeeds(folder.path(), "eval m.unic tube");
    assert!(!folder.path().join("m.run/.unic.lock").exists());
}

#[test]
fn two_processes_never_simulate_into_one_folder() {
    let folder = fresh();
    let line = format!("{SIMULATE} --out made");
    refused_while(folder.path(), &line, "made/simulation.toml", "made");
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
