//! Contract: a training depends on its settings alone. Another number of threads or an interruption
//! leads to the same tensors, bit for bit.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::{fs, path::Path};

#[test]
fn the_same_seed_gives_the_same_tensors_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let trained = |out: &str, more: &str| {
        train(folder.path(), out, &format!("--steps 30 {more}"));
        tensors(&folder.path().join(out))
    };
    let first = trained("a.unic", "--threads 2");
    assert!(
        first == trained("b.unic", "--threads 2"),
        "the same command twice"
    );
    assert!(first == trained("c.unic", "--threads 1"), "two threads and one");
    assert!(first != trained("d.unic", "--threads 2 --seed 9"), "another seed");
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_continues_to_the_same_model() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let folder = folder.path();
    train(folder, "whole.unic", "--steps 150");
    let line = format!("train tube {SHORT} --steps 150 --out cut.unic");
    let stderr = interrupted(folder, &line, "cut.run/metrics.jsonl", "held_out");
    assert!(
        stderr.contains("unic train tube --out cut.unic --resume"),
        "{stderr}"
    );
    assert!(!folder.join("cut.unic").exists());

    let refused = unic(folder, "train tube --preset tiny --out cut.unic");
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--resume"));

    succeeds(folder, "train tube --out cut.unic --resume");
    assert!(tensors(&folder.join("whole.unic")) == tensors(&folder.join("cut.unic")));
    assert_eq!(curve(folder, "whole"), curve(folder, "cut"));
}

#[cfg(unix)]
#[test]
fn an_interrupted_prior_continues_to_the_same_model() {
    const LONG_PRIOR: &str = "--steps 10 --set model.state.displacement.recurrence.steps=1500 --set \
                              model.state.displacement.recurrence.epochs=100000";
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let folder = folder.path();
    train(folder, "whole.unic", LONG_PRIOR);
    let line = format!("train tube {SHORT} {LONG_PRIOR} --out cut.unic");
    let child = command(folder, &line)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // The settings are written after the first step of the recurrence.
    wait_for(&folder.join("cut.run/config.toml"));
    interrupt(&child);
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(
        stderr.contains("while the prior was trained, which is saved"),
        "{stderr}"
    );
    assert!(folder.join("cut.run/checkpoints/prior").exists());
    succeeds(folder, "train tube --out cut.unic --resume");
    assert!(tensors(&folder.join("whole.unic")) == tensors(&folder.join("cut.unic")));
}

#[cfg(unix)]
#[test]
fn an_early_stop_says_that_something_is_saved_only_if_it_is() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let folder = folder.path();
    for delay_ms in [0, 60, 120, 180] {
        let out = format!("stopped{delay_ms}");
        let line = format!("train tube {SHORT} --steps 100000 --out {out}.unic");
        let child = command(folder, &line)
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(100 + delay_ms));
        interrupt(&child);
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        // On a busy machine the signal may come before its handler, and ends the program.
        assert!(matches!(output.status.code(), Some(130) | None), "{stderr}");
        let run = folder.join(format!("{out}.run"));
        assert_eq!(
            stderr.contains("is saved"),
            run.join("config.toml").exists(),
            "{stderr}"
        );
    }
}

#[cfg(unix)]
#[test]
fn a_run_of_two_fits_can_be_interrupted_in_either() {
    let folder = tempfile::tempdir().unwrap();
    write_capture_without_validation(folder.path());
    let folder = folder.path();
    let whole = train(folder, "whole.unic", "--steps 150");
    let line = format!("train tube {SHORT} --steps 150 --out cut.unic");
    let metrics = "cut.run/metrics.jsonl";
    interrupted(folder, &line, metrics, "held_out");
    let resume = "train tube --out cut.unic --resume";
    let stderr = interrupted(folder, resume, metrics, "all_clips");
    assert!(stderr.contains("of the fit on all clips"), "{stderr}");
    assert!(!folder.join("cut.unic").exists());
    let cut = json(folder, &format!("{resume} --json"));
    assert!(tensors(&folder.join("whole.unic")) == tensors(&folder.join("cut.unic")));
    assert_eq!(curve(folder, "whole"), curve(folder, "cut"));
    for key in [
        "fit",
        "training_clips",
        "steps",
        "validation_clips",
        "validation_rmse_mm",
    ] {
        assert_eq!(whole[key], cut[key], "{key}");
    }
    // A finished run that is resumed prints the same result again.
    assert_eq!(
        json(folder, &format!("{resume} --json"))["validation_rmse_mm"],
        whole["validation_rmse_mm"]
    );
}

/// Steps and validation errors of a run.
fn curve(folder: &Path, run: &str) -> Vec<(u64, f64)> {
    let text = fs::read_to_string(folder.join(format!("{run}.run/metrics.jsonl"))).unwrap();
    let lines = text
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    lines
        .filter_map(|l| Some((l["step"].as_u64()?, l["validation_rmse_mm"].as_f64()?)))
        .collect()
}

#[test]
fn a_finished_run_is_replaced_only_with_overwrite() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let folder = folder.path();
    train(folder, "m.unic", "--steps 20");
    let before = fs::read(folder.join("m.unic")).unwrap();
    for (line, code) in [
        ("train tube --preset tiny --out m.unic", 2),
        ("train tube --preset paper --out m.unic --resume", 2),
        ("train tube --steps 21 --out m.unic --resume", 2),
        ("train tube --out other.unic --resume", 1),
    ] {
        assert_eq!(unic(folder, line).status.code(), Some(code), "{line}");
        assert_eq!(fs::read(folder.join("m.unic")).unwrap(), before, "{line}");
    }
    succeeds(
        folder,
        "train tube --preset tiny --steps 20 --out m.unic --resume",
    );
    train(folder, "m.unic", "--steps 10 --overwrite");
    assert_ne!(fs::read(folder.join("m.unic")).unwrap(), before);
}

#[test]
fn an_overwritten_run_trains_its_prior_again() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let folder = folder.path();
    train(folder, "new.unic", "--steps 10 --seed 9");
    train(folder, "old.unic", "--steps 10");
    // Neither refused for another seed nor continued from the old prior's checkpoints.
    train(folder, "old.unic", "--steps 10 --seed 9 --overwrite");
    assert!(tensors(&folder.join("old.unic")) == tensors(&folder.join("new.unic")));
}

#[test]
fn a_run_is_not_resumed_with_other_splits() {
    let folder = tempfile::tempdir().unwrap();
    let root = write_capture_without_validation(folder.path());
    train(folder.path(), "m.unic", "--steps 10");
    fs::remove_dir_all(root).unwrap();
    write_capture(folder.path());
    let refused = unic(folder.path(), "train tube --out m.unic --resume");
    let stderr = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("training clips"), "{stderr}");
}
