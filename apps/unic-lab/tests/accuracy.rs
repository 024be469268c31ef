//! Contract of `unic-lab accuracy`: every row is trained once for each seed and measured beside the
//! baselines; results that are there are read again, and only for the settings that made them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use serde_json::Value;
use std::{fs, path::Path, process::Output};

fn accuracy(folder: &Path, rest: &str) -> Output {
    lab(folder, &format!("accuracy tube --out results {rest}"))
}

#[test]
fn rows_are_trained_once_and_measured_beside_the_baselines() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture(folder);
    write_tiny_row(folder);
    let all = "--rows mine.toml --seeds 1,2 --steps 4";
    let first = accuracy(folder, &format!("{all} --json"));
    assert!(first.status.success(), "{}", text(&first.stderr));
    let results: Value = serde_json::from_slice(&first.stdout).unwrap();
    let capture = &results["captures"][0];
    assert!(
        capture["baselines"]["baselines"]["ridge"]["free_running"]["rmse_mm"]
            .as_f64()
            .unwrap()
            > 0.0
    );
    let seeds = capture["rows"][0]["seeds"].as_array().unwrap();
    assert_eq!(seeds.len(), 2);
    for (i, seed) in seeds.iter().enumerate() {
        assert_eq!((&seed["seed"], &seed["steps"]), (&(i + 1).into(), &4.into()));
        assert!(seed["frame_ms"].as_f64().unwrap() > 0.0);
        assert!(
            seed["evaluation"]["model"]["free_running"]["rmse_mm"]
                .as_f64()
                .unwrap()
                > 0.0
        );
    }

    // The second run trains nothing. Training again would give the same bytes, but a later file
    // time.
    let model = folder.join("results/tube/mine/seed-1.unic");
    let written = fs::metadata(&model).unwrap().modified().unwrap();
    let again = accuracy(folder, all);
    assert!(again.status.success(), "{}", text(&again.stderr));
    assert_eq!(fs::metadata(&model).unwrap().modified().unwrap(), written);
    let table = text(&again.stdout);
    assert!(
        table.contains("| mine | ")
            && table.contains("| ridge | ")
            && table.contains("| ridge_handled | ")
            && table.contains(" ± "),
        "{table}"
    );

    // Results of another budget are refused, finished or not.
    let refused = || {
        let other = accuracy(folder, "--rows mine.toml --seeds 1 --steps 5");
        assert!(!other.status.success() && text(&other.stderr).contains("choose another --out"));
    };
    refused();
    fs::remove_file(folder.join("results/tube/mine/seed-1.json")).unwrap();
    refused();
}

#[test]
fn networks_of_other_methods_can_be_rows() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture(folder);
    let own = "kind = 'virtual_bones'\nhidden = [8]\n[space]\nvirtual_bones = 2\n";
    fs::write(folder.join("bones.toml"), own).unwrap();
    let all = "--rows pose_only,bones.toml,global_feature --seeds 1 --steps 3";
    let first = accuracy(folder, &format!("{all} --json"));
    assert!(first.status.success(), "{}", text(&first.stderr));
    let results: Value = serde_json::from_slice(&first.stdout).unwrap();
    for (row, has_one_step) in [(0, false), (1, false), (2, true)] {
        let trained = &results["captures"][0]["rows"][row]["seeds"][0];
        assert_eq!(trained["steps"], 3);
        let parameters = trained["parameters"].as_u64().unwrap();
        assert_eq!(trained["bytes"].as_u64(), Some(4 * parameters));
        assert!(trained["frame_ms"].as_f64().unwrap() > 0.0);
        let model = &trained["evaluation"]["model"];
        assert!(model["free_running"]["rmse_mm"].as_f64().unwrap() > 0.0);
        assert_eq!(model["one_step"].is_object(), has_one_step, "row {row}");
    }

    // The second run trains nothing, so that the file keeps its time.
    let kept = folder.join("results/tube/pose_only/seed-1.json");
    let written = fs::metadata(&kept).unwrap().modified().unwrap();
    let again = accuracy(folder, all);
    assert!(text(&again.stdout).contains("| pose only | "));
    assert_eq!(fs::metadata(&kept).unwrap().modified().unwrap(), written);
}

#[test]
fn unknown_rows_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let output = accuracy(folder.path(), "--rows standart");
    let stderr = text(&output.stderr);
    assert!(
        !output.status.success() && stderr.contains("standart") && stderr.contains("standard_no_field"),
        "{stderr}"
    );
    assert!(!folder.path().join("results").exists());
}
