//! Contract of `unic-lab lasting`: every number is printed beside its target, and a model that
//! cannot be read is refused.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;

#[test]
fn numbers_are_printed_beside_their_targets() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture(folder);
    write_tiny_row(folder);
    // The accuracy benchmark trains the model, since this program has no other command that does.
    succeeds(
        folder,
        "accuracy tube --out results --rows mine.toml --seeds 1 --steps 2",
    );
    let model = "results/tube/mine/seed-1.unic";
    let results = json(folder, &format!("lasting {model} tube --frames 60 --json"));
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
        &format!("lasting {model} tube --frames 0 --intersection off"),
    );
    assert!(table.contains("| measure | found | target | met |"), "{table}");
}

#[test]
fn a_model_that_cannot_be_read_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_capture(folder);
    let output = lab(folder, "lasting none.unic tube");
    let stderr = text(&output.stderr);
    assert!(!output.status.success());
    assert!(
        stderr.starts_with("unic-lab: none.unic: cannot read the model"),
        "{stderr}"
    );
}
