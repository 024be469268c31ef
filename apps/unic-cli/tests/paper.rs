//! Contract: preset `paper` trains on all clips for a number of epochs, warns about a schedule in
//! too few steps, and can be made longer. The certainty of its code is measured, and `--gumbel`
//! adds noise.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use serde_json::Value;
use std::{fs, path::Path};
use unic_core::{Model, PrecisionErrors};

/// Options of networks that train in a second.
const SMALL: &str = "--preset paper --set model.encoder.hidden=[16] --set model.encoder.channels=6 \
                     --set model.field.width=16 --set batch.windows=16 --set batch.points=8";

/// Result of a training.
struct Training {
    summary: Value,
    stderr: String,
}

fn trained(folder: &Path, more: &str) -> Training {
    let output = unic(
        folder,
        &format!("train tube {SMALL} --out p.unic --overwrite --json {more}"),
    );
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    let summary = serde_json::from_slice(&output.stdout).unwrap();
    Training { summary, stderr }
}

#[test]
fn the_number_of_steps_follows_from_epochs_of_all_training_clips() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture(folder);
    let Training { summary, stderr } = trained(folder, "");
    // 300 epochs over the frame pairs of two clips of 30 frames, 16 pairs per step.
    let steps = (300 * 2 * (FRAMES as u64 - 1)).div_ceil(16);
    assert_eq!(summary["steps"], steps);
    assert_eq!(summary["training_clips"], serde_json::json!(["one", "two"]));
    assert!(summary.get("validation_rmse_mm").is_none(), "{summary}");
    assert!(
        stderr.contains(&format!("{steps} steps, which are 300 epochs")),
        "{stderr}"
    );
    assert!(stderr.contains("nothing is held out"), "{stderr}");
    assert!(!stderr.contains("squeezed"), "{stderr}");

    let Training { summary, stderr } = trained(folder, "--steps 24");
    assert_eq!(summary["steps"], 24);
    assert!(
        stderr.contains("squeezed into 6.6 epochs") && stderr.contains(&format!("{steps} steps")),
        "{stderr}"
    );
}

#[test]
fn a_run_can_be_made_longer_if_its_schedule_continues() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture(folder);
    let curve = |folder: &Path| -> Vec<(u64, f64)> {
        let text = fs::read_to_string(folder.join("p.run/metrics.jsonl")).unwrap();
        let lines = text.lines().map(|l| serde_json::from_str::<Value>(l).unwrap());
        lines
            .filter_map(|l| Some((l["step"].as_u64()?, l["one_step_rmse_mm"].as_f64()?)))
            .collect()
    };
    let every = "--set validation.every=50";
    let whole = trained(
        folder,
        &format!("--set optimiser.epochs=50 --set optimiser.half_periods=5.0 {every}"),
    );
    let expected = curve(folder);
    trained(
        folder,
        &format!("--set optimiser.epochs=30 --set optimiser.half_periods=3.0 {every}"),
    );
    let resume = "train tube --out p.unic --resume --json";
    let refused = unic(folder, &format!("{resume} --set optimiser.epochs=50"));
    assert_eq!(refused.status.code(), Some(2));
    let longer = json(
        folder,
        &format!("{resume} --set optimiser.epochs=50 --set optimiser.half_periods=5.0"),
    );
    assert_eq!(longer["steps"], whole.summary["steps"]);
    let mut found = curve(folder);
    // The end of the shorter run is an additional measurement.
    let ends = found.iter().position(|(step, _)| *step == 109).unwrap();
    found.remove(ends);
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    // Epochs are rounded up to whole steps, and so is the period: the learning rates differ a
    // little.
    for ((step, found), (expected_step, expected)) in found.iter().zip(&expected) {
        assert_eq!(step, expected_step);
        assert!(
            (found - expected).abs() < 0.02 * expected,
            "{step}: {found} {expected}"
        );
    }
    let config = fs::read_to_string(folder.join("p.run/config.toml")).unwrap();
    assert!(config.contains("epochs = 50\n"), "{config}");
}

#[test]
fn the_certainty_of_the_code_is_measured_and_gumbel_noise_is_reproducible() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture(folder);
    for code in ["picked_logit", "one_hot"] {
        trained(folder, &format!("--steps 40 --set model.encoder.code={code}"));
        let inspected = succeeds(folder, "inspect p.unic");
        assert!(
            inspected.contains("mean top probability") && inspected.contains("0.125 is undecided"),
            "{inspected}"
        );
        // The whole output of the field counts, so its precisions differ and are measured.
        let model = Model::from_bytes(&fs::read(folder.join("p.unic")).unwrap()).unwrap();
        let errors = PrecisionErrors::of(model.about()).unwrap();
        let differs = |mm: f64| mm > 0.0 && mm != errors.f32;
        assert!(errors.f32 > 0.0 && errors.int8.is_some_and(differs), "{errors:?}");
        let one_step = |precision: &str| {
            let scores = json(
                folder,
                &format!("eval p.unic tube --json --precision {precision}"),
            );
            assert!(
                precision == "auto" || scores["precision"] == precision,
                "{scores}"
            );
            scores["model"]["one_step"]["rmse_mm"].as_f64().unwrap()
        };
        assert_ne!(one_step("f32"), one_step("int8"));
        assert_eq!(one_step("auto"), one_step(model.precision().name()));
        let scores = json(folder, "eval p.unic tube --json");
        let top = scores["code"]["mean_top_probability"].as_f64().unwrap();
        assert!(0.125 < top && top <= 1.0, "{top}");
        let rmse = |line: &str| {
            let scores = json(folder, &format!("eval p.unic tube --json {line}"));
            scores["model"]["one_step"]["rmse_mm"].as_f64().unwrap()
        };
        let without_noise = scores["model"]["one_step"]["rmse_mm"].as_f64().unwrap();
        assert_eq!(rmse("--gumbel 0"), without_noise);
        assert_eq!(rmse("--gumbel 1"), rmse("--gumbel 1 --gumbel-seed 1"));
        assert_ne!(rmse("--gumbel 1"), without_noise);
        assert_ne!(rmse("--gumbel 1"), rmse("--gumbel 1 --gumbel-seed 2"));
    }
    let refused = unic(folder, "eval p.unic tube --gumbel 2");
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("expected a number from 0 to 1"));
}

/// Number of steps of preset tiny for a number of epochs of two clips.
fn steps_of_tiny(epochs: usize) -> usize {
    (epochs * 2 * (FRAMES - 1)).div_ceil(8 * 12)
}

#[test]
fn the_first_of_two_fits_determines_the_steps_of_both() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture_without_validation(folder);
    let summary = train(folder, "m.unic", "--set optimiser.epochs=30");
    assert_eq!(summary["fit"], "all_clips");
    assert_eq!(summary["steps"], steps_of_tiny(30));
    let again = json(folder, "train tube --out m.unic --resume --json");
    assert_eq!(again["steps"], summary["steps"]);
}

#[test]
fn with_a_prior_a_budget_makes_no_more_steps_than_the_epochs() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture(folder);
    let summary = train(folder, "m.unic", "--set optimiser.epochs=8 --budget 1h");
    assert_eq!(summary["steps"], steps_of_tiny(8));
}
