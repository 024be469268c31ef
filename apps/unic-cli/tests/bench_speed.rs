//! Contract of `unic bench`: every case has times, instances count only their own memory, and 0
//! instances measure none.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;

const SMALL: &str =
    "bench --vertices 300 --network standard --precision f32,bf16 --on-threads 1,2 --frames 5";

#[test]
fn every_case_has_times_and_the_memory_of_instances() {
    let folder = tempfile::tempdir().unwrap();
    let results = json(folder.path(), &format!("{SMALL} --instances 3 --json"));
    let cases = results["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 4, "two precisions on two numbers of threads");
    for case in cases {
        assert_eq!(case["vertices"], 300);
        assert_eq!(case["device"], "cpu");
        assert_eq!(case["sampling_percent"], 100.0);
        for time in ["frame_ms", "fps", "forward_only_ms"] {
            assert!(case[time].as_f64().unwrap() > 0.0, "{time}: {case}");
        }
        assert!(case["stages_ms"]["field"].as_f64().unwrap() > 0.0, "{case}");
        assert_eq!(case["instances"]["count"], 3);
        assert!(case["instances"]["frame_us"].as_f64().unwrap() > 0.0, "{case}");
        // At least a position, a normal and a displacement for each vertex. Weights are shared and
        // do not count.
        let bytes = case["instances"]["bytes"].as_f64().unwrap();
        assert!((300.0 * 36.0..1e6).contains(&bytes), "{bytes}");
    }
}

#[test]
fn memory_of_an_instance_grows_with_the_garment() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |vertices: usize| {
        let line = format!("bench --vertices {vertices} --network standard --precision f32 --on-threads 1");
        let results = json(folder.path(), &format!("{line} --frames 2 --instances 2 --json"));
        results["cases"][0]["instances"]["bytes"].as_f64().unwrap()
    };
    let (small, large) = (bytes(300), bytes(900));
    // The memory for the body is the same in both and cancels.
    let bytes_per_vertex = (large - small) / 600.0;
    assert!(
        (60.0..1000.0).contains(&bytes_per_vertex),
        "{bytes_per_vertex} bytes per vertex"
    );
}

#[test]
fn zero_instances_measure_none() {
    let folder = tempfile::tempdir().unwrap();
    let results = json(folder.path(), &format!("{SMALL} --instances 0 --json"));
    assert!(results["cases"][0]["instances"].is_null(), "{results}");
    let table = succeeds(folder.path(), &format!("{SMALL} --instances 0"));
    let row = table.lines().last().unwrap();
    assert!(row.split_whitespace().rev().take(2).eq(["-", "-"]), "{row}");
}
