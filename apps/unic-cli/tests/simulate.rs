//! Contract: `unic simulate` makes captures that all other commands read. Its bytes depend neither
//! on the number of threads nor on interruptions, and it overwrites nothing without `--overwrite`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::{
    fs,
    path::Path,
    process::{Output, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};
use unic_builtin::motion::STANDARD_CLIPS;
use unic_io::{Capture, NpzWriter, Split, write_character, write_motion, write_obj};

const INPUTS: &str = "--character body.npz --garment tube --contacts 4,4,5,5";

/// Writes a character, a garment and three motions, the last of them short.
fn inputs(folder: &Path) {
    write_character(&folder.join("body.npz"), &character()).unwrap();
    let rest = garment().rest;
    write_obj(&folder.join("tube.obj"), &rest).unwrap();
    // The same garment as a folder, with the topmost ring pinned: a tube without shoulders falls
    // down.
    fs::create_dir(folder.join("tube")).unwrap();
    write_obj(&folder.join("tube/garment.obj"), &rest).unwrap();
    let top = rest.vertices.iter().map(|v| v.y).fold(0.0, f32::max);
    let pinned: Vec<bool> = rest.vertices.iter().map(|v| v.y > top - 1e-3).collect();
    let mut arrays = NpzWriter::create(&folder.join("tube/garment.npz")).unwrap();
    arrays.bools("pinned", &pinned).unwrap();
    arrays.finish().unwrap();
    for (seed, (name, frames)) in [("one", 60), ("two", 50), ("three", 20)].into_iter().enumerate() {
        let clip = unic_testdata::clip(name, seed, frames);
        write_motion(&folder.join(format!("{name}.npz")), &clip, &[]).unwrap();
    }
}

fn simulate(folder: &Path, more: &str) -> Output {
    let line = format!("simulate {INPUTS} --motion one.npz two.npz three.npz {more}");
    command(folder, &line).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Names and bytes of the files of a capture, without `simulation.json`, which holds times.
fn bytes(root: &Path) -> Vec<(String, Vec<u8>)> {
    let list =
        |folder: &Path| -> Vec<_> { fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect() };
    let mut files: Vec<_> = [list(root), list(&root.join("clips"))].concat();
    files.retain(|path| path.is_file() && !path.ends_with("simulation.json"));
    files.sort();
    let named = |path: std::path::PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (name, fs::read(path).unwrap())
    };
    files.into_iter().map(named).collect()
}

#[test]
fn feet_are_found_by_joint_name() {
    let folder = tempfile::tempdir().unwrap();
    inputs(folder.path());
    let line = "simulate --character body.npz --garment tube --motion one.npz --seconds 0.1 --out feet";
    let output = command(folder.path(), line).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let capture = Capture::open(&folder.path().join("feet")).unwrap();
    assert_eq!(capture.contact_joints, [4, 4, 5, 5]);
}

#[test]
fn breeze_adds_training_clips_in_wind_of_different_directions() {
    let folder = tempfile::tempdir().unwrap();
    inputs(folder.path());
    let output = simulate(folder.path(), "--out windy --seconds 0.5 --breeze 2.5");
    assert!(output.status.success(), "{}", stderr(&output));
    let capture = Capture::open(&folder.path().join("windy")).unwrap();
    let names = ["one", "two", "one_breeze", "two_breeze"];
    assert_eq!(capture.clip_names(Split::Train), names);
    assert_eq!(capture.clip_names(Split::Test), ["three"]);
    let [still, other, windy, turned] = names.map(|name| capture.load_clip(name).unwrap());
    assert!(still.clip.wind.is_empty() && windy.clip.has_motion_of(&still.clip));
    let speeds = (windy.clip.wind.iter()).map(|wind| (wind.length() - 2.5).abs());
    assert!(speeds.fold(0.0, f32::max) < 1e-5 && windy.clip.wind.len() == windy.clip.len());
    assert!(windy.clip.wind_at(0).distance(turned.clip.wind_at(0)) > 1.0);
    let blown = |a: &unic_io::CapturedClip, b: &unic_io::CapturedClip| {
        let last = a.clip.len() - 1;
        let apart = a.garment.frame(last).iter().zip(b.garment.frame(last));
        apart.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
    };
    assert!(blown(&still, &windy) > 0.002 && blown(&other, &turned) > 0.002);
}

#[test]
fn a_simulated_capture_can_be_inspected_and_trained_on() {
    let folder = tempfile::tempdir().unwrap();
    inputs(folder.path());
    let output = simulate(folder.path(), "--out made/tube --pictures strips --json");
    assert!(output.status.success(), "{}", stderr(&output));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["clips"][2]["clip"], "three");
    assert!(summary["clips"][0]["cpu_s_per_frame"].as_f64().unwrap() > 0.0);

    let root = folder.path().join("made/tube");
    let capture = Capture::open(&root).unwrap();
    assert_eq!(capture.clip_names(Split::Train), ["one", "two"]);
    assert_eq!(capture.clip_names(Split::Test), ["three"], "the last is held out");
    let clip = capture.load_clip("one").unwrap();
    assert_eq!((clip.garment.len(), clip.garment.vertex_count()), (60, VERTICES));
    let moved = clip.garment.frame(0)[0].distance(clip.garment.frame(59)[0]);
    assert!(moved > 0.01, "the garment moves with the character: {moved} m");
    assert!(folder.path().join("strips/two.png").exists());

    let inspected = command(folder.path(), "inspect made/tube").output().unwrap();
    assert!(inspected.status.success(), "{}", stderr(&inspected));
    let trained = command(folder.path(), "train made/tube --preset tiny --steps 4")
        .output()
        .unwrap();
    assert!(trained.status.success(), "{}", stderr(&trained));
}

#[test]
fn built_in_motions_are_chosen_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let line = "simulate --garment skirt --motion dance idle --seconds 0.1 --out made";
    let output = command(folder.path(), line).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let capture = Capture::open(&folder.path().join("made")).unwrap();
    assert_eq!(capture.clip_names(Split::Train), ["dance"]);
    assert_eq!(capture.clip_names(Split::Test), ["idle"]);

    let line = "simulate --garment skirt --motion dence --seconds 0.1 --out other";
    let refused = command(folder.path(), line).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    let text = stderr(&refused);
    assert!(
        text.contains("dence: expected a motion file or one of idle"),
        "{text}"
    );
}

#[test]
fn built_in_motions_are_named_in_the_help_and_in_the_reference() {
    let folder = tempfile::tempdir().unwrap();
    let help = command(folder.path(), "simulate --help").output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    let words: Vec<&str> = help.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
    let reference = include_str!("../../../docs/reference/motion.md");
    for name in STANDARD_CLIPS {
        assert!(words.contains(&name), "{name}");
        assert!(reference.contains(&format!("`{name}`")), "{name}");
    }
}

#[test]
fn built_in_names_win_over_folders_and_files_of_the_same_name() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["human", "skirt", "dance"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    fs::write(folder.path().join("idle"), "no motion").unwrap();
    // The output folder may be called like an input that is no folder.
    let line = "simulate --character human --garment skirt --motion dance idle --seconds 0.1 --out skirt";
    let output = command(folder.path(), line).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(Capture::open(&folder.path().join("skirt")).is_ok());
    let line = "simulate --garment ./human --motion dance --out other";
    let output = command(folder.path(), line).output().unwrap();
    assert!(!output.status.success());
    let text = stderr(&output);
    assert!(
        text.contains("human/garment.obj"),
        "a path names a folder: {text}"
    );
}

#[test]
fn threads_and_interruptions_do_not_change_the_bytes() {
    let folder = tempfile::tempdir().unwrap();
    inputs(folder.path());
    assert!(simulate(folder.path(), "--out a --threads 1").status.success());
    let expected = bytes(&folder.path().join("a"));
    assert_eq!(
        expected.len(),
        4 + 2 * 3,
        "capture.toml, character, garment, clips"
    );

    let line = format!("simulate {INPUTS} --motion one.npz two.npz three.npz --threads 2 --out");
    let mut child = command(folder.path(), &format!("{line} b"))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let started = Instant::now();
    while !folder.path().join("b/clips/two.npz").exists() && child.try_wait().unwrap().is_none() {
        assert!(
            started.elapsed() < Duration::from_secs(120),
            "no clip is finished"
        );
        sleep(Duration::from_millis(2));
    }
    // The simulation may be finished before the signal arrives. The result is the same.
    let _ = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    let status = child.wait().unwrap();
    if !status.success() {
        assert_eq!(status.code(), Some(130));
        assert!(
            Capture::open(&folder.path().join("b")).is_err(),
            "no capture before the last clip"
        );
        let again = command(folder.path(), &format!("{line} b")).output().unwrap();
        assert!(stderr(&again).contains("--resume"), "{}", stderr(&again));
        let other = command(folder.path(), &format!("{line} b --resume --substeps 8"))
            .output()
            .unwrap();
        assert!(stderr(&other).contains("settings"), "{}", stderr(&other));
        let resumed = command(folder.path(), &format!("{line} b --resume"))
            .output()
            .unwrap();
        assert!(resumed.status.success(), "{}", stderr(&resumed));
    }
    let report = fs::read(folder.path().join("b/simulation.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    let clips: Vec<_> = report["clips"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| &c["clip"])
        .collect();
    assert_eq!(
        clips,
        ["one", "two", "three"],
        "clips of the first run are reported too"
    );
    let name_free = |files: Vec<(String, Vec<u8>)>| -> Vec<_> {
        files
            .into_iter()
            .filter(|(name, _)| name != "capture.toml")
            .collect()
    };
    assert!(name_free(bytes(&folder.path().join("b"))) == name_free(expected));
}

#[test]
fn the_unit_and_the_axis_of_a_garment_are_stated() {
    let folder = tempfile::tempdir().unwrap();
    inputs(folder.path());
    let mut mesh = garment().rest;
    // Powers of two, so that scaling back is exact.
    (mesh.vertices.iter_mut()).for_each(|v| *v = glam::Vec3::new(v.x, -v.z, v.y) * 128.0);
    write_obj(&folder.path().join("large.obj"), &mesh).unwrap();
    let rest = |garment: &str, out: &str| {
        let common = "simulate --character body.npz --motion one.npz --seconds 0.1 --force";
        let line = format!("{common} --garment {garment} --out {out}");
        let output = command(folder.path(), &line).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        let capture = Capture::open(&folder.path().join(out)).unwrap();
        (capture.garment.rest, stderr(&output))
    };
    let (expected, _) = rest("tube.obj", "plain");
    let (found, notes) = rest("large.obj --scale 0.0078125 --garment-up z", "scaled");
    assert_eq!(found, expected);
    assert!(
        notes.contains("large.obj: Z up converted to Y up") && notes.contains("scaled by 0.0078125"),
        "{notes}"
    );
}

#[test]
fn invalid_input_is_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    inputs(folder.path());
    let refused = |line: &str, words: &[&str]| {
        let output = command(folder.path(), &format!("simulate {line}"))
            .output()
            .unwrap();
        let text = stderr(&output);
        let last = text.lines().last().unwrap_or_default();
        assert!(!output.status.success(), "{line}");
        assert!(words.iter().all(|word| last.contains(word)), "{line}: {text}");
    };
    refused(
        "--garment tshirt --scale 0.01 --out a",
        &["--scale", ".obj", "tshirt"],
    );
    refused("--garment cape --out a", &["cape", "tshirt, skirt"]);
    refused(
        "--motion moonwalk --out a",
        &["moonwalk", "walk_circles", "dance"],
    );
    refused(
        &format!("{INPUTS} --motion one.npz --test four --out a"),
        &["four", "one"],
    );
    refused(&format!("{INPUTS} --motion one.npz one.npz --out a"), &["one"]);
    refused("--character nobody.npz --out a", &["nobody.npz"]);
    refused(
        "--character body.npz --garment tube.obj --motion none.npz --out a",
        &["none.npz"],
    );
    refused("--character body.npz --out a", &["24 joints"]);
    refused(
        "--character body.npz --garment tube.obj --motion one.npz --contacts 4,4,5,6 --out a",
        &["contact_joints", "6 joints"],
    );
    for wrong in [
        "--thickness nan",
        "--thickness=-5",
        "--substeps 4000000000",
        "--seconds 0",
        "--wind 1,2",
        "--breeze -1",
    ] {
        refused(&format!("{INPUTS} --motion one.npz --out a {wrong}"), &["help"]);
    }
    assert!(!folder.path().join("a/capture.toml").exists());

    assert!(simulate(folder.path(), "--out b --seconds 0.1").status.success());
    let before = bytes(&folder.path().join("b"));
    refused(
        &format!("{INPUTS} --motion one.npz --out b"),
        &["b", "--overwrite"],
    );
    assert!(bytes(&folder.path().join("b")) == before);
    fs::write(folder.path().join("b/notes.txt"), "mine").unwrap();
    assert!(
        simulate(folder.path(), "--out b --seconds 0.2 --overwrite")
            .status
            .success()
    );
    assert!(
        folder.path().join("b/notes.txt").exists(),
        "only files of the capture are removed"
    );
}

#[test]
fn inputs_and_foreign_clips_are_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    inputs(folder.path());
    let tube = folder.path().join("tube");
    let before = fs::read(tube.join("garment.obj")).unwrap();
    for more in ["", "--overwrite"] {
        let output = simulate(folder.path(), &format!("--out tube {more}"));
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(
            stderr(&output).contains("none of the inputs"),
            "{}",
            stderr(&output)
        );
    }
    assert!(fs::read(tube.join("garment.obj")).unwrap() == before);

    // Clips that no simulation has made belong to the user.
    fs::create_dir_all(folder.path().join("c/clips")).unwrap();
    fs::copy(
        folder.path().join("one.npz"),
        folder.path().join("c/clips/one.npz"),
    )
    .unwrap();
    let output = simulate(folder.path(), "--out c");
    assert!(stderr(&output).contains("clips/one.npz"), "{}", stderr(&output));
    assert!(!folder.path().join("c/capture.toml").exists());
}
