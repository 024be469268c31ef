//! `unic bench lasting` as a user runs it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;

#[test]
fn numbers_stand_beside_their_targets() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture(folder);
    train(folder, "tube.unic", "--steps 2");
    let results = json(folder, "bench lasting tube.unic tube --frames 60 --json");
    assert_eq!(results["random_motion"]["frames"], 60);
    let verdicts = results["verdicts"].as_array().unwrap();
    let random = verdicts
        .iter()
        .find(|v| v["measure"].as_str().unwrap().starts_with("largest displacement"));
    let random = random.unwrap();
    assert_eq!(
        random["met"].as_bool().unwrap(),
        random["value"].as_f64().unwrap() <= random["target"]["at_most"].as_f64().unwrap()
    );
    let table = succeeds(
        folder,
        "bench lasting tube.unic tube --frames 0 --intersection off",
    );
    assert!(table.contains("| measure | found | target | met |"), "{table}");
}

#[test]
fn a_model_of_another_garment_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture(folder);
    let output = unic(folder, "bench lasting none.unic tube");
    assert!(!output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("none.unic: cannot read the model"));
}
