//! Contract: `unic eval` measures the life of free running: wrinkles by wavelength, strain,
//! bending, popping and a judge. `--control` adds a second simulation of the same motions as a row,
//! and refuses captures that are none.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use glam::Vec3;
use std::{path::Path, sync::LazyLock};
use tempfile::TempDir;
use unic_io::Split;
use unic_testdata::{Figure, Take, take};

/// Number of frames of a clip: four seconds.
const LONG: usize = 121;

/// Folder with the capture `tube`, a control, and captures that are no control.
static CAPTURES: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let takes = |seed: usize, frames: usize| -> Vec<Take> {
        let names = ["one", "two", "four", "five"].into_iter().enumerate();
        names.map(|(k, name)| take(name, seed + k, frames)).collect()
    };
    let write = |name: &str, takes: Vec<Take>| {
        let splits = [Split::Train, Split::Train, Split::Test, Split::Test];
        let takes: Vec<_> = takes.into_iter().zip(splits).collect();
        unic_testdata::write_capture(&folder.path().join(name), &Figure::tube(), &takes);
    };
    write("tube", takes(0, LONG));
    let mut swayed = takes(0, LONG);
    swayed.iter_mut().for_each(sway);
    write("control", swayed);
    write("other_motion", takes(7, LONG));
    write("short", takes(0, 60));
    let mut renamed = takes(0, LONG);
    renamed[3].clip.name = "six".into();
    write("renamed", renamed);
    let splits = [("four", Split::Test), ("five", Split::Train)];
    let mut cut = Figure::tube();
    cut.garment.rest.faces.pop();
    let fewer = splits.map(|(name, split)| (take(name, 0, LONG), split));
    unic_testdata::write_capture(&folder.path().join("other_garment"), &cut, &fewer);
    folder
});

/// Moves the lower part of a garment by a centimetre to and fro.
fn sway(take: &mut Take) {
    for (t, frame) in take.garment.iter_mut().enumerate() {
        let lowest = frame.iter().map(|v| v.y).fold(f32::INFINITY, f32::min);
        let sway = Vec3::X * 0.01 * (0.5 * t as f32).sin();
        frame.iter_mut().for_each(|v| *v += sway * (1.0 - (v.y - lowest)));
    }
}

fn fails(folder: &Path, line: &str) -> String {
    let output = unic(folder, line);
    assert_eq!(output.status.code(), Some(1), "{line}");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn free_running_has_measures_of_life_and_one_step_has_none() {
    let folder = CAPTURES.path();
    train(folder, "tube.unic", "--steps 10");
    let scores = json(folder, "eval tube.unic tube --control control --json");
    for row in [
        &scores["model"],
        &scores["baselines"]["ridge"],
        &scores["baselines"]["control"],
    ] {
        let metrics = &row["free_running"];
        let wavelengths = |key: &str| -> Vec<Option<u64>> {
            let bands = metrics["bands"].as_array().unwrap();
            bands.iter().map(|band| band[key].as_u64()).collect()
        };
        assert_eq!(wavelengths("from_cm"), [0, 3, 6, 12, 24].map(Some));
        assert_eq!(wavelengths("to_cm"), [Some(3), Some(6), Some(12), Some(24), None]);
        for band in metrics["bands"].as_array().unwrap() {
            for key in ["amplitude_ratio", "living_ratio", "correlation"] {
                assert!(band[key].is_f64(), "{key}: {band}");
            }
            assert!(band["autocorrelation_1s_truth"].is_f64(), "{band}");
        }
        for key in [
            "strain_p01_percent",
            "strain_p99_percent_truth",
            "bending_ratio",
            "popping_ratio",
            "self_crossing_edges_percent",
            "self_crossing_edges_percent_truth",
        ] {
            assert!(metrics[key].is_f64(), "{key}: {metrics}");
        }
    }
    let one_step = scores["model"]["one_step"].as_object().unwrap();
    assert!(!one_step.contains_key("bands") && !one_step.contains_key("popping_ratio"));
    for key in ["judge_control_percent", "judge_ridge_percent"] {
        let percent = scores[key].as_f64().unwrap();
        assert!((0.0..=100.0).contains(&percent), "{key}: {percent}");
    }
    let counts = scores["judge_ridge_percent"].as_f64().unwrap() >= 80.0;
    assert_eq!(scores["judge_accuracy_percent"].is_f64(), counts);

    let text = succeeds(folder, "eval tube.unic tube");
    let life = text.split("\nlife: ").nth(3).unwrap();
    assert!(life.contains("\nmodel ") && life.contains("\ntruth "), "{text}");
    assert!(life.contains("\njudge: "), "{text}");
}

#[test]
fn a_capture_is_its_own_control() {
    let folder = CAPTURES.path();
    let scores = json(folder, "eval --baselines tube --control tube --json");
    let control = &scores["baselines"]["control"]["free_running"];
    assert_eq!(control["rmse_mm"], 0.0);
    for band in control["bands"].as_array().unwrap() {
        assert_eq!(band["living_ratio"], 1.0);
        assert_eq!(band["autocorrelation_1s"], band["autocorrelation_1s_truth"]);
    }
    assert_eq!(scores["judge_control_percent"], 50.0);
    assert!(scores["judge_accuracy_percent"].is_null());
    let without = json(folder, "eval --baselines tube --json");
    assert!(without["judge_control_percent"].is_null());
    assert!(without["baselines"]["control"].is_null());
}

#[test]
fn captures_that_are_no_control_are_refused() {
    let folder = CAPTURES.path();
    for (control, words) in [
        ("nothing", "nothing"),
        ("other_motion", "clip four: expected the motion of"),
        ("short", "clip four: expected 121 frames or more, found 60"),
        ("renamed", "five"),
        (
            "other_garment",
            "other_garment: expected the garment mesh of tube",
        ),
    ] {
        let line = format!("eval --baselines tube --control {control}");
        let error = fails(folder, &line);
        assert!(error.contains(control) && error.contains(words), "{error}");
    }
    // Results never overwrite the control.
    let output = unic(
        folder,
        "eval --baselines tube --control control --dump control --overwrite",
    );
    assert_eq!(output.status.code(), Some(2));
}
