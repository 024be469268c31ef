//! Contract: `unic view` draws movies and pictures without a window, by the software rasteriser where
//! it is asked to, and refuses what it cannot show in one sentence.
#![cfg(feature = "viewer")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::{fs, path::Path, sync::LazyLock};
use tempfile::TempDir;

/// A capture and a model trained on it.
static TRAINED: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    train(folder.path(), "tube.unic", "--steps 10");
    folder
});

/// Runs `unic view` where the inputs are. Outputs go to a folder of their own.
fn view(line: &str, out: &TempDir) -> std::process::Output {
    let line = format!("view {}", line.replace("OUT", &out.path().display().to_string()));
    unic(TRAINED.path(), &line)
}

fn png_size(path: &Path) -> (u32, u32) {
    let bytes = fs::read(path).unwrap();
    assert!(bytes.starts_with(b"\x89PNG"), "{}", path.display());
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

/// Last line of stderr of a command that must fail with `code`.
fn refusal(line: &str, code: i32) -> String {
    let out = tempfile::tempdir().unwrap();
    let output = view(line, &out);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "unic view {line}: {stderr}");
    assert_eq!(
        fs::read_dir(out.path()).unwrap().count(),
        0,
        "unic view {line} leaves files"
    );
    stderr.lines().last().unwrap_or_default().to_owned()
}

#[test]
fn a_capture_and_a_model_become_a_movie_of_frames_by_the_rasteriser() {
    let out = tempfile::tempdir().unwrap();
    let line =
        "tube tube.unic --show error --record OUT/frames/ --seconds 0.2 --size 320x200 --renderer software";
    let output = view(line, &out);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    assert!(stderr.contains("drawn by the software rasteriser"), "{stderr}");
    let mut frames: Vec<_> = fs::read_dir(out.path().join("frames"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    frames.sort();
    let expected = (0.2 * FPS).round() as usize;
    assert_eq!(frames.len(), expected);
    assert!(frames.iter().all(|frame| png_size(frame) == (320, 200)));
    // The garment moves.
    assert!(fs::read(&frames[0]).unwrap() != fs::read(&frames[expected - 1]).unwrap());
}

#[test]
fn every_quantity_of_every_kind_of_source_has_a_picture() {
    let out = tempfile::tempdir().unwrap();
    let animation = out.path().join("four.pc2");
    succeeds(
        TRAINED.path(),
        &format!(
            "animate tube.unic --motion tube/clips/four.npz --out {}",
            animation.display()
        ),
    );
    let mut pictures = Vec::new();
    for (i, show) in ["lit", "wireframe", "normals", "error", "weights", "intersections"]
        .iter()
        .enumerate()
    {
        let name = format!("{i}.png");
        let line = format!(
            "tube tube.unic OUT/four.pc2 --clip four --show {show} --at 0.3 --screenshot OUT/{name} --size 480x300 \
             --renderer software"
        );
        let output = view(&line, &out);
        assert!(
            output.status.success(),
            "{show}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        let path = out.path().join(name);
        assert_eq!(png_size(&path), (480, 300));
        pictures.push(fs::read(path).unwrap());
    }
    for (i, picture) in pictures.iter().enumerate() {
        // The rasteriser draws no edges.
        let is_drawn_alike = |j: usize| (i, j) == (1, 0);
        assert!(
            (0..i).all(|j| is_drawn_alike(j) || pictures[j] != *picture),
            "{i}"
        );
    }
}

#[test]
fn a_picture_shows_the_side_and_the_subject_that_are_asked_for() {
    let out = tempfile::tempdir().unwrap();
    let options = [
        "",
        "--close",
        "--from front",
        "--from back",
        "--from left",
        "--from right",
        "--from back --close",
    ];
    let mut pictures: Vec<Vec<u8>> = Vec::new();
    for (i, option) in options.iter().enumerate() {
        let name = format!("{i}.png");
        let line = format!(
            "tube --clip four --at 0.3 {option} --screenshot OUT/{name} --size 200x150 --renderer software"
        );
        let output = view(&line, &out);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let picture = fs::read(out.path().join(name)).unwrap();
        assert!(!pictures.contains(&picture), "{option}");
        pictures.push(picture);
    }
}

#[test]
fn an_animation_is_shown_and_continued_from_every_format() {
    let out = tempfile::tempdir().unwrap();
    for ending in ["npz", "mdd", "abc", "usdc", "usda"] {
        let file = out.path().join(format!("four.{ending}"));
        let line = format!(
            "animate tube.unic --motion tube/clips/four.npz --out {}",
            file.display()
        );
        succeeds(TRAINED.path(), &format!("{line} --overwrite"));
        let line = format!(
            "OUT/four.{ending} --at 0.3 --screenshot OUT/{ending}.png --size 320x200 --renderer software"
        );
        let output = view(&line, &out);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        assert_eq!(png_size(&out.path().join(format!("{ending}.png"))), (320, 200));
    }
    // The first frame of each starts the same animation.
    let start = |ending: &str| {
        let (first, file) = (
            out.path().join(format!("four.{ending}")),
            out.path().join("again.pc2"),
        );
        let line = format!(
            "animate tube.unic --motion tube/clips/four.npz --start {} --out {} --overwrite",
            first.display(),
            file.display()
        );
        succeeds(TRAINED.path(), &line);
        fs::read(file).unwrap()
    };
    let expected = start("npz");
    for ending in ["mdd", "abc", "usdc", "usda"] {
        assert!(start(ending) == expected, "{ending}");
    }
}

#[test]
fn a_picture_by_the_adapter_if_there_is_one() {
    let out = tempfile::tempdir().unwrap();
    let output = view("tube --screenshot OUT/a.png --size 320x240 --renderer gpu", &out);
    let stderr = String::from_utf8(output.stderr).unwrap();
    if !output.status.success() {
        assert!(stderr.contains("adapter"), "{stderr}");
        println!("skipped, because there is no graphics adapter: {stderr}");
        return;
    }
    assert_eq!(png_size(&out.path().join("a.png")), (320, 240));
}

#[test]
fn a_model_without_a_motion_is_refused_and_one_with_a_motion_is_not() {
    let message = refusal("tube.unic --screenshot OUT/a.png --renderer software", 1);
    assert!(message.contains("expected a motion of"), "{message}");
    let out = tempfile::tempdir().unwrap();
    let line =
        "tube.unic --motion tube/clips/four.npz --screenshot OUT/a.png --size 200x200 --renderer software";
    let output = view(line, &out);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn wrong_inputs_are_refused_in_one_sentence() {
    for (line, code, part) in [
        ("nothing --screenshot OUT/a.png", 1, "nothing: expected a model"),
        (
            "tube --clip nine --screenshot OUT/a.png",
            1,
            "expected a clip of the capture (",
        ),
        (
            "tube.unic --clip four --screenshot OUT/a.png",
            2,
            "--clip: expected a capture",
        ),
        (
            "tube tube --screenshot OUT/a.png",
            2,
            "expected one capture at most, found 2",
        ),
        ("tube --record OUT/a.webm", 1, "found .webm"),
        (
            "tube --screenshot tube/capture.toml --overwrite",
            2,
            "tube/capture.toml: ",
        ),
        ("tube/capture.toml --screenshot OUT/a.png", 1, "capture.toml"),
    ] {
        let message = refusal(line, code);
        assert!(message.contains(part), "unic view {line}: {message}");
    }
}

#[test]
fn without_a_display_a_window_is_a_misuse() {
    let mut command = command(TRAINED.path(), "view tube");
    for display in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(display);
    }
    if !cfg!(target_os = "linux") {
        println!("skipped, because other systems always have a display");
        return;
    }
    let output = command.output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("--screenshot FILE.png"), "{stderr}");
}

#[test]
fn a_training_goes_on_without_a_window_for_its_preview() {
    if !cfg!(target_os = "linux") {
        println!("skipped, because other systems always have a display");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path());
    let line = format!("train tube {SHORT} --out a.unic --steps 10 --view");
    let mut command = command(folder.path(), &line);
    for display in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(display);
    }
    let output = command.output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    assert!(
        stderr.contains("no preview: ") && stderr.contains("the training goes on"),
        "{stderr}"
    );
    assert!(folder.path().join("a.unic").exists());
}
