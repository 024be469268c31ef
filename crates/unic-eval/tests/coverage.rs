//! Contract: on recorded motion, frames that resemble the capture are covered, and the report names
//! what is new in the others.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use std::{path::PathBuf, time::Instant};
use unic_core::{
    clip::Clip,
    motion::{MotionLayout, MotionSpec, VelocityScheme},
};
use unic_eval::{Coverage, CoverageReport, capture_clips};
use unic_io::{Capture, MotionOptions, Split, import_motion, read_character};

fn data(below: &str) -> Option<PathBuf> {
    let data = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let path = data.join(below);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

fn say(report: &CoverageReport) {
    eprintln!("{report}");
}

#[test]
fn walks_cover_walks_and_not_jumps() {
    let Some(body) = data("body/character.npz") else {
        return;
    };
    let Some(folder) = data("motion/locomotion") else {
        return;
    };
    let character = read_character(&body).unwrap();
    let read = |name: &str| -> Clip {
        let path = folder.join(format!("{name}.npz"));
        import_motion(&path, &character, &MotionOptions::default())
            .unwrap()
            .clip
    };
    let train = ["Walk1", "WalkTurns1", "WalkStopTurn1", "Circles1"].map(read);
    let spec = MotionSpec::new(
        MotionLayout::Heading,
        VelocityScheme::Backward,
        [7, 10, 8, 11],
        &character,
    );
    let start = Instant::now();
    let coverage = Coverage::fit(spec.unwrap(), &character, &train).unwrap();
    let fitted = start.elapsed();
    let [walk, jumps, strafing] =
        ["Walk2", "JumpsFreeRoam1", "FreeRoaming2"].map(|name| coverage.assess(&read(name)));
    eprintln!(
        "fitted in {fitted:.1?}, three clips compared in {:.1?}",
        start.elapsed() - fitted
    );
    [&walk, &jumps, &strafing].into_iter().for_each(say);
    assert!(!coverage.is_sparse(), "{}", coverage.seen_distance());
    assert!(walk.covered_percent > 85.0);
    assert!(jumps.covered_percent < walk.covered_percent - 10.0);
    // The README of the clips: soles above 8 cm at 21.5-22.7, 39.0-39.7, 56.9-58.2 s and more.
    let jumped = jumps.worst.iter().any(|s| {
        [
            (16.0, 16.3),
            (21.5, 22.7),
            (39.0, 39.7),
            (42.9, 43.3),
            (56.9, 58.2),
        ]
        .iter()
        .any(|&(from, to)| s.from_seconds < to && s.to_seconds > from)
    });
    assert!(jumped);
    let backwards = strafing
        .kinds
        .iter()
        .find(|k| k.kind == "moving backwards")
        .unwrap();
    assert!(
        backwards.seconds > 20.0 && backwards.capture_seconds < 3.0,
        "{backwards}"
    );
}

#[test]
fn a_captures_test_clips_are_compared_with_its_training_clips() {
    let Some(folder) = data("captures/tshirt_blender") else {
        return;
    };
    let capture = Capture::open(&folder).unwrap();
    let coverage = Coverage::of(&capture).unwrap();
    eprintln!("seen up to {:.3}", coverage.seen_distance());
    // Eight different motions of five seconds.
    assert!(coverage.is_sparse());
    for clip in capture_clips(&capture, Split::Train).unwrap() {
        let report = coverage.assess(&clip);
        assert_eq!(report.covered_percent, 100.0, "{report}");
    }
    for clip in capture_clips(&capture, Split::Test).unwrap() {
        let report = coverage.assess(&clip);
        say(&report);
        // One run was shown, and this is another's.
        let running = report.kinds.iter().find(|k| k.kind == "running").unwrap();
        assert!(
            running.capture_seconds > 3.0 && running.seconds > 3.0,
            "{running}"
        );
        assert!(report.median_distance > 0.1, "{report}");
    }
}
