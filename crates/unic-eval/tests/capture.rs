//! Contract: on a real capture (the T-shirt in the shared data) the errors of baselines lie in
//! known ranges and order, JSON gives the same table again, and a dump holds every frame.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use std::{path::PathBuf, time::Instant};
use unic_eval::{Dump, Evaluation, Event, Metrics, baselines, evaluate, training_set};
use unic_io::{Capture, Npz, Split};

fn tshirt() -> Option<PathBuf> {
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let path = here.join("../../../shared/data/captures/tshirt_blender");
    if !path.is_dir() {
        eprintln!("skipped: no capture at {}", path.display());
        return None;
    }
    Some(path)
}

fn free_running<'a>(evaluation: &'a Evaluation, row: &str) -> &'a Metrics {
    evaluation.pooled.baselines[row].free_running.as_ref().unwrap()
}

#[test]
fn baselines_have_the_known_order() {
    let Some(path) = tshirt() else { return };
    let capture = Capture::open(&path).unwrap();
    let start = Instant::now();
    let mut predictors = baselines::fit(&training_set(&capture).unwrap());
    println!("fitted in {:.2} s", start.elapsed().as_secs_f64());
    let clips = capture.clip_names(Split::Test).to_vec();
    let folder = tempfile::tempdir().unwrap();
    let mut dump = Dump::create(folder.path()).unwrap();
    let start = Instant::now();
    let evaluation = evaluate(&capture, &mut predictors, &clips, &mut |_| Ok(())).unwrap();
    println!("evaluated in {:.2} s", start.elapsed().as_secs_f64());
    println!("{evaluation}");

    let rmse = |row| free_running(&evaluation, row).rmse_mm;
    assert!(rmse("ridge") < rmse("skinning_mean") && rmse("skinning_mean") < rmse("skinning"));
    assert!(rmse("linear_dynamics") < rmse("skinning_mean"));
    let hold = evaluation.pooled.baselines["hold"].one_step.as_ref().unwrap();
    assert!((10.0..40.0).contains(&hold.rmse_mm), "{}", hold.rmse_mm);
    assert!((30.0..60.0).contains(&rmse("skinning_mean")));
    assert!((0.0..1.0).contains(&free_running(&evaluation, "skinning").jitter_ratio));
    let json = serde_json::to_string(&evaluation).unwrap();
    let back: Evaluation = serde_json::from_str(&json).unwrap();
    assert_eq!(back.to_string(), evaluation.to_string());

    let mut observe = |event: &Event| dump.observe(event);
    evaluate(&capture, &mut predictors[..1], &clips, &mut observe).unwrap();
    let mut npz = Npz::open(&folder.path().join("run_02_03.npz")).unwrap();
    assert_eq!(npz.names(), ["truth", "hold.one_step"]);
    assert_eq!(npz.header("hold.one_step").unwrap().shape, [150, 3019, 3]);
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        1,
        "temporary files stay"
    );
}
