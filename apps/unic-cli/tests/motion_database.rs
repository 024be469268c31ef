//! Contract: a motion database that is written steers a character as the clips that it is made of,
//! and files that are no database of the character are refused in one sentence.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::{fs, path::Path};
use unic_io::write_character;
use unic_testdata::Figure;

/// Metrics of the scripts, which do not depend on the machine.
fn scripts(folder: &Path, more: &str) -> serde_json::Value {
    json(folder, &format!("bench control --json {more}"))["scripts"].take()
}

fn refusal(folder: &Path, line: &str) -> String {
    let output = unic(folder, line);
    assert!(matches!(output.status.code(), Some(1 | 2)), "unic {line}");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    stderr
}

#[test]
fn a_database_file_steers_like_its_clips() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Motion of the controller is itself a set of clips.
    json(folder, "bench control --write-motion steered --json");
    let clips = "--motion steered/circle_0.npz steered/reversals_0.npz steered/start_stop_0.npz \
                 steered/random_mouse_0.npz";
    let written = json(
        folder,
        &format!("motion-database {clips} --exclude stop --out my.unicmotn --json"),
    );
    assert_eq!(written["clips"], 8);
    let from_file = scripts(folder, "--database my.unicmotn");
    assert_eq!(from_file, scripts(folder, &format!("{clips} --exclude stop")));
    let line = "motion-database --motion dance walk_circles --out built_in.unicmotn --json";
    assert_eq!(
        json(folder, line)["clips"],
        4,
        "two built-in motions and their mirrors"
    );
    // The tag of excluded clips is in the file.
    assert_ne!(from_file, scripts(folder, clips));

    let inspected = json(folder, "inspect my.unicmotn --json");
    assert_eq!(inspected["kind"], "motion_database");
    assert_eq!(inspected["facts"]["frames"], written["frames"]);
    assert_eq!(inspected["facts"]["clip 2"]["name"], "start_stop_0");
    let excluded = inspected["facts"]["clip 2"]["frames"].as_u64().unwrap() * 2;
    assert_eq!(inspected["facts"]["tag excluded"]["frames"], excluded);
}

#[test]
fn motion_of_the_scripts_is_the_same_on_every_run_and_never_overwritten_by_chance() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for name in ["one", "two"] {
        succeeds(folder, &format!("bench control --seed 4 --write-motion {name}"));
    }
    let mut names: Vec<_> = (fs::read_dir(folder.join("one")).unwrap())
        .map(|file| file.unwrap().file_name())
        .collect();
    names.sort();
    assert_eq!(names.len(), 8);
    assert!(names.contains(&"random_stick_4.npz".into()));
    for name in names {
        let [one, two] = ["one", "two"].map(|run| fs::read(folder.join(run).join(&name)).unwrap());
        assert!(one == two, "{}", name.display());
    }
    let error = refusal(folder, "bench control --seed 4 --write-motion one");
    assert!(error.contains("--overwrite"), "{error}");
}

#[test]
fn files_that_do_not_fit_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "motion-database --out my.unicmotn");
    write_character(&folder.join("tube.npz"), &Figure::mixamo().character).unwrap();
    let error = refusal(
        folder,
        "bench control --database my.unicmotn --character tube.npz",
    );
    assert!(error.contains("my.unicmotn: expected 65 joints"), "{error}");

    let error = refusal(folder, "motion-database --out my.unicmotn");
    assert!(error.contains("--overwrite"), "{error}");

    let mut bytes = fs::read(folder.join("my.unicmotn")).unwrap();
    bytes.truncate(5000);
    fs::write(folder.join("cut.unicmotn"), bytes).unwrap();
    for command in ["bench control --database", "inspect"] {
        let error = refusal(folder, &format!("{command} cut.unicmotn"));
        assert!(
            error.contains("cut.unicmotn") && error.contains("damaged"),
            "{error}"
        );
    }
    fs::write(folder.join("not.unicmotn"), "walks").unwrap();
    let error = refusal(folder, "bench control --database not.unicmotn");
    assert!(error.contains("expected a motion database"), "{error}");
}
