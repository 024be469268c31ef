//! Contract: `unic play --record` makes the same movie from nothing on every run, and windows that
//! cannot be opened end with exit code 2.
#![cfg(feature = "viewer")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::fs;

const MOVIE: &str = "--seconds 1.2 --fps 5 --size 96x64 --renderer software";

#[test]
fn a_movie_needs_no_files_no_window_and_no_adapter_and_is_the_same_on_every_run() {
    let folder = tempfile::tempdir().unwrap();
    let summary = json(folder.path(), &format!("play --record frames {MOVIE} --json"));
    assert_eq!(summary["frames"], 6);
    assert_eq!(summary["size"], serde_json::json!([96, 64]));
    assert_eq!(summary["renderer"], "drawn by the software rasteriser");
    let again = json(
        folder.path(),
        &format!("--threads 1 play --record again/ {MOVIE} --json"),
    );
    assert_eq!(again["frames"], 6);
    let bytes = |name: &str, i: usize| {
        let path = folder.path().join(format!("{name}/frame_{i:05}.png"));
        fs::read(path).unwrap()
    };
    for i in 0..6 {
        assert_eq!(bytes("frames", i), bytes("again", i), "picture {i}");
    }
    assert_ne!(bytes("frames", 0), bytes("frames", 5), "the character walks");
    // Frames of an earlier movie stay unless the user says so.
    let refused = unic(folder.path(), &format!("play --record frames {MOVIE}"));
    let text = String::from_utf8_lossy(&refused.stderr);
    assert!(!refused.status.success() && text.contains("frames"), "{text}");
    succeeds(
        folder.path(),
        &format!("play --record frames {MOVIE} --overwrite"),
    );
}

#[test]
fn several_characters_and_other_scripts_are_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let line = format!("play skirt --record walk.gif --characters 3 --script random_mouse {MOVIE} --json");
    let summary = json(folder.path(), &line);
    assert_eq!(summary["characters"], 3);
    assert!(summary["garment_ms"].as_f64().unwrap() > 0.0);
    let gif = fs::read(folder.path().join("walk.gif")).unwrap();
    assert_eq!(&gif[..6], b"GIF89a");
}

#[test]
fn a_machine_without_a_display_gets_one_sentence_and_exit_code_2() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = command(folder.path(), "play");
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command.env_remove("WAYLAND_SOCKET");
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("a window cannot be opened"), "{text}");
    assert!(text.contains("unic play --record"), "{text}");
    assert_eq!(text.trim_end().lines().count(), 1, "{text}");
}

#[test]
fn movies_of_other_formats_and_files_that_are_no_models_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = unic(folder.path(), "play --record walk.webm");
    let text = String::from_utf8_lossy(&refused.stderr);
    assert!(text.contains("walk.webm: expected a movie"), "{text}");
    fs::write(folder.path().join("no.unic"), b"no model").unwrap();
    let refused = unic(folder.path(), "play no.unic --record walk.gif");
    let text = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text.contains("no.unic"), "{text}");
    assert!(!folder.path().join("walk.gif").exists());
}
