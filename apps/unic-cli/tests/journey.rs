//! Contract: the commands of a user's work, inspect, train, evaluate and animate, write their files
//! and print the JSON keys that programs rely on.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use serde_json::Value;
use std::{path::Path, process::Stdio, sync::LazyLock};
use tempfile::TempDir;

/// A capture and a model trained on it, shared by the tests of this file.
static TRAINED: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    train(folder.path(), "tube.unic", "--steps 120");
    folder
});

const METRICS: [&str; 12] = [
    "rmse_mm",
    "mean_vertex_error_mm",
    "hausdorff_mm",
    "intersecting_vertices_percent_paper",
    "intersecting_vertices_percent_closest",
    "intersecting_frames_percent",
    "jitter_ratio",
    "rmse_mm_at_1s",
    "rmse_mm_at_5s",
    "rmse_mm_at_10s",
    "rmse_mm_at_60s",
    "drift_mm",
];

const BASELINES: [(&str, &str); 7] = [
    ("hold", "one_step"),
    ("mean_shape", "free_running"),
    ("skinning", "free_running"),
    ("skinning_mean", "free_running"),
    ("skinning_first", "free_running"),
    ("ridge", "free_running"),
    ("linear_dynamics", "free_running"),
];

fn assert_metrics(value: &Value) {
    for key in METRICS {
        assert!(value.get(key).is_some(), "{key} in {value}");
    }
    assert!(value["rmse_mm"].as_f64().unwrap() >= 0.0);
}

fn assert_baselines(scores: &Value) {
    for (name, mode) in BASELINES {
        assert_metrics(&scores["baselines"][name][mode]);
    }
}

#[test]
fn training_writes_a_model_and_its_run_folder() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let summary = train(folder.path(), "m.unic", "--steps 60");
    for key in [
        "model",
        "run",
        "bytes",
        "parameters",
        "fit",
        "training_clips",
        "steps",
        "seconds",
        "prior_seconds",
        "validation_fit",
        "validation_motion",
        "validation_clips",
        "validation_rmse_mm",
    ] {
        assert!(summary.get(key).is_some(), "{key} in {summary}");
    }
    assert_eq!(summary["validation_motion"], "unseen");
    assert_eq!(
        (&summary["steps"], &summary["validation_clips"][0]),
        (&60.into(), &"three".into())
    );
    let run = folder.path().join("m.run");
    let metrics = std::fs::read_to_string(run.join("metrics.jsonl")).unwrap();
    let lines: Vec<Value> = metrics
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let steps = |key: &str| -> Vec<u64> {
        lines
            .iter()
            .filter(|l| l.get(key).is_some())
            .map(|l| l["step"].as_u64().unwrap())
            .collect()
    };
    assert_eq!(steps("validation_rmse_mm"), [20, 40, 60]);
    assert_eq!(steps("loss"), [50]);
    assert!(
        std::fs::read_to_string(run.join("config.toml"))
            .unwrap()
            .contains("steps = 60")
    );
    let log = std::fs::read_to_string(run.join("log.txt")).unwrap();
    assert!(
        log.contains("threads") && log.contains("shown cloth: bending "),
        "{log}"
    );
    assert!(
        run.join("checkpoints/held_out/step-00000060.safetensors")
            .exists()
    );
    // The capture names its validation clip, which stays held out: there is one fit.
    assert_eq!(
        (&summary["fit"], &summary["validation_fit"]),
        (&"held_out".into(), &"held_out".into())
    );
    assert!(!run.join("checkpoints/all_clips").exists());
}

#[test]
fn a_second_fit_trains_on_the_clip_that_was_held_out() {
    let folder = tempfile::tempdir().unwrap();
    write_capture_without_validation(folder.path());
    let folder = folder.path();
    let summary = train(folder, "m.unic", "--steps 60");
    assert_eq!(
        (&summary["fit"], &summary["validation_fit"], &summary["steps"]),
        (&"all_clips".into(), &"held_out".into(), &60.into())
    );
    // The model file and the summary have the same times: those of the prior and of both fits.
    let about = metadata(&folder.join("m.unic"));
    let recorded = &about["about"]["training"];
    for key in ["seconds", "prior_seconds"] {
        let [in_file, in_summary] = [recorded, &summary].map(|time| time[key].as_f64().unwrap());
        assert!(
            in_file > 0.0 && (in_file - in_summary).abs() < 1e-9,
            "{key}: {in_file}, {in_summary}"
        );
    }
    assert!(recorded["prior_seconds"].as_f64() < recorded["seconds"].as_f64());
    assert_eq!(summary["training_clips"].as_array().unwrap().len(), 3);
    assert_eq!(summary["validation_clips"].as_array().unwrap().len(), 1);
    // Without a second fit the same clip is held out, also of the prior's principal components.
    let once = train(folder, "once.unic", "--steps 60 --set validation.refit=never");
    assert_eq!(once["fit"], "held_out");
    assert_eq!(once["training_clips"].as_array().unwrap().len(), 2);
    assert_eq!(once["validation_clips"], summary["validation_clips"]);
    // The model is that of a second fit alone, but for `field_share`, which scales the last layer.
    train(folder, "only.unic", "--steps 60 --set validation.refit=only");
    let [both, only] = ["m", "only"].map(|name| tensors(&folder.join(format!("{name}.unic"))));
    let differ: Vec<&str> = both
        .iter()
        .zip(&only)
        .filter(|(a, b)| a != b)
        .map(|(a, _)| a.0.as_str())
        .collect();
    let expected = if summary["field_share"] == 1.0 { 0 } else { 2 };
    assert_eq!(differ.len(), expected, "{differ:?}, {summary}");
    // The second fit validates nothing and counts its steps from its own beginning.
    let metrics = std::fs::read_to_string(folder.join("m.run/metrics.jsonl")).unwrap();
    let lines = metrics
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap());
    let places: Vec<(String, u64)> = lines
        .map(|l| (l["fit"].as_str().unwrap().to_owned(), l["step"].as_u64().unwrap()))
        .collect();
    // Steps 20, 40 and 60 have the error of one step, in the first fit also that of free running.
    // Step 50 has the mean loss.
    let held_out = [20, 20, 40, 40, 50, 60, 60].map(|step| ("held_out".to_owned(), step));
    assert_eq!(places[..7], held_out);
    let all_clips = [20, 40, 50, 60].map(|step| ("all_clips".to_owned(), step));
    assert_eq!(places[7..], all_clips);
    let training = &metadata(&folder.join("m.unic"))["about"]["training"];
    assert_eq!(training["fit"], "all_clips");
    assert_eq!(training["validation"]["fit"], "held_out");
    assert_eq!(training["validation"]["rmse_mm"], summary["validation_rmse_mm"]);
}

#[test]
fn a_budget_determines_the_number_of_steps() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let summary = train(
        folder.path(),
        "m.unic",
        "--budget 2s --set optimiser.steps=1000000",
    );
    let steps = summary["steps"].as_u64().unwrap();
    assert!(1 < steps && steps < 1_000_000, "{steps}");
    let config = std::fs::read_to_string(folder.path().join("m.run/config.toml")).unwrap();
    assert!(config.contains(&format!("steps = {steps}\n")), "{config}");
}

#[test]
fn with_a_prior_a_budget_makes_at_most_the_steps_of_the_settings() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let summary = train(folder.path(), "m.unic", "--budget 1h --set optimiser.steps=3");
    assert_eq!(summary["steps"], 3);
}

#[test]
fn a_budget_leads_to_both_fits() {
    let folder = tempfile::tempdir().unwrap();
    write_capture_without_validation(folder.path());
    let line = "--budget 4s --set optimiser.steps=1000000";
    let summary = train(folder.path(), "m.unic", line);
    assert_eq!(summary["fit"], "all_clips");
    assert!(summary["steps"].as_u64().unwrap() > 1);
    let share = summary["field_share"].as_f64().unwrap();
    assert!((0.0..=1.0).contains(&share), "{summary}");
}

#[test]
fn evaluation_prints_all_json_keys() {
    let folder = TRAINED.path();
    let scores = json(folder, "eval tube.unic tube --json");
    for mode in ["one_step", "free_running"] {
        assert_metrics(&scores["model"][mode]);
        assert_metrics(&scores["clips"]["four"]["model"][mode]);
    }
    assert_baselines(&scores);
    assert_baselines(&scores["clips"]["five"]);
    assert_metrics(&scores["baselines"]["prior"]["free_running"]);
    assert_metrics(&scores["baselines"]["ridge_handled"]["free_running"]);
    assert!(scores.get("caveats").is_none());
    assert!(scores["timing"]["frame_ms"].as_f64().unwrap() > 0.0);
    // Three seconds of training must give a smaller error than skinning.
    let rmse = |row: &Value| row["free_running"]["rmse_mm"].as_f64().unwrap();
    assert!(
        rmse(&scores["model"]) < rmse(&scores["baselines"]["skinning"]),
        "{scores}"
    );
}

#[test]
fn baselines_are_measured_without_a_model() {
    let folder = TRAINED.path();
    let scores = json(folder, "eval --baselines tube --json --split validation");
    assert_baselines(&scores);
    for row in ["prior", "ridge_handled"] {
        assert!(scores["baselines"].get(row).is_none(), "{row}");
    }
    let handled = json(folder, "eval --baselines tube --intersection robust --json");
    assert_metrics(&handled["baselines"]["ridge_handled"]["free_running"]);
    assert!(scores.get("model").is_none() && scores["clips"].get("three").is_some());
    let table = succeeds(folder, "eval --baselines tube --clips four");
    assert!(
        table.contains("linear_dynamics") && table.contains("rmse"),
        "{table}"
    );
}

#[test]
fn evaluation_writes_positions_and_pictures() {
    let folder = TRAINED.path();
    let table = succeeds(
        folder,
        "eval tube.unic tube --dump dump --pictures worst --intersection off",
    );
    assert!(table.contains("model") && table.contains("ms (median"), "{table}");
    for clip in ["four", "five"] {
        let dump = unic_io::Npz::open(&folder.join(format!("dump/{clip}.npz"))).unwrap();
        assert!(
            dump.contains("model.free_running") && dump.contains("truth"),
            "{:?}",
            dump.names()
        );
        assert_png(&folder.join(format!("worst/{clip}.png")));
    }
}

fn assert_png(path: &Path) {
    let bytes = std::fs::read(path).unwrap();
    assert!(
        bytes.starts_with(b"\x89PNG") && bytes.len() > 10_000,
        "{}",
        path.display()
    );
}

#[test]
fn animations_of_every_format_have_a_body_and_a_picture() {
    let folder = TRAINED.path();
    for (out, body) in [
        ("a.pc2", "a.body.pc2"),
        ("b.npz", "b.body.npz"),
        ("frames", "frames_body"),
    ] {
        let line = format!("animate tube.unic --motion tube/clips/four.npz --out {out} --json");
        let summary = json(folder, &line);
        assert_eq!(summary["frames"], FRAMES);
        let cache = |name: &str| unic_io::read_vertex_cache(&folder.join(name)).unwrap().frames;
        assert_eq!((cache(out).len(), cache(out).vertex_count()), (FRAMES, VERTICES));
        assert_eq!(
            (cache(body).len(), cache(body).vertex_count()),
            (FRAMES, BODY_VERTICES)
        );
        assert_png(&folder.join(out).with_extension("png"));
        let written = summary["written"]
            .as_array()
            .unwrap()
            .iter()
            .map(|path| path.as_str().unwrap());
        for path in written.filter(|path| !path.ends_with(".png")) {
            succeeds(folder, &format!("inspect {path}"));
        }
    }
    assert_eq!(
        unic_io::read_obj(&folder.join("a.obj")).unwrap().vertices.len(),
        VERTICES
    );
    assert_eq!(
        unic_io::read_obj(&folder.join("a.body.obj"))
            .unwrap()
            .vertices
            .len(),
        BODY_VERTICES
    );
}

#[test]
fn start_gives_the_first_frame_and_frames_cuts_the_motion() {
    let folder = TRAINED.path();
    let start = "--start tube/clips/five.npz --picture p.png --intersection off";
    succeeds(
        folder,
        &format!("animate tube.unic --motion tube/clips/five.npz --out s.npz {start} --frames 0..12"),
    );
    let found = unic_io::read_vertex_cache(&folder.join("s.npz")).unwrap().frames;
    let truth = unic_io::frames::VertexFrames::open_npy(&folder.join("tube/clips/five.garment.npy")).unwrap();
    assert_eq!(found.len(), 12);
    let largest = found
        .frame(0)
        .iter()
        .zip(truth.frame(0))
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f32::max);
    assert!(largest < 1e-5, "{largest} m");
    assert_png(&folder.join("p.png"));
    assert!(!folder.join("s.png").exists());
}

#[test]
fn another_mesh_of_the_garment_can_be_animated() {
    let folder = TRAINED.path();
    let mut mesh = garment().rest;
    mesh.vertices.truncate(48);
    mesh.faces.retain(|face| face.iter().all(|&v| v < 48));
    unic_io::write_obj(&folder.join("short.obj"), &mesh).unwrap();
    // Intersection handling and strain projection use neighbours, of which a cut mesh has fewer.
    train(
        folder,
        "plain.unic",
        "--steps 10 --set projection.at_inference=false",
    );
    let motion = "--motion tube/clips/four.npz --intersection off";
    succeeds(
        folder,
        &format!("animate plain.unic {motion} --out short.npz --mesh short.obj"),
    );
    succeeds(folder, &format!("animate plain.unic {motion} --out whole.npz"));
    let positions = |name: &str| unic_io::read_vertex_cache(&folder.join(name)).unwrap().frames;
    let (short, whole) = (positions("short.npz"), positions("whole.npz"));
    for t in 0..FRAMES {
        let pairs = short.frame(t).iter().zip(whole.frame(t));
        assert!(
            pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max) < 1e-3,
            "frame {t}"
        );
    }
    // A model with both takes another mesh, too.
    succeeds(
        folder,
        "animate tube.unic --motion tube/clips/four.npz --out cut.npz --mesh short.obj",
    );
    assert_eq!(positions("cut.npz").frame(0).len(), 48);
}

#[test]
fn files_of_every_kind_can_be_inspected() {
    let folder = TRAINED.path();
    for (path, kind) in [
        ("tube", "capture"),
        ("tube/character.npz", "character"),
        ("tube/garment.obj", "mesh"),
        ("tube/clips/one.npz", "motion"),
        ("tube.unic", "model"),
    ] {
        let report = json(folder, &format!("inspect {path} --json"));
        assert_eq!(
            (
                report["kind"].as_str(),
                report["problems"].as_array().unwrap().len()
            ),
            (Some(kind), 0),
            "{report}"
        );
    }
    assert!(succeeds(folder, "inspect tube.unic").contains("parameters"));
}

#[test]
fn completions_and_help_are_printed() {
    let folder = tempfile::tempdir().unwrap();
    assert!(succeeds(folder.path(), "completions bash").contains("--baselines"));
    assert!(succeeds(folder.path(), "train --help").contains("--resume"));
}

#[test]
fn a_closed_stdout_is_no_error() {
    let mut child = command(TRAINED.path(), "inspect tube.unic");
    let mut child = child
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
