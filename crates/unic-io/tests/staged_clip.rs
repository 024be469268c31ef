//! Contract: a clip is added to a capture as a whole. A process that is killed at any moment leaves a
//! capture without the clip, and the next one completes or removes what it has left.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use std::{fs, path::Path};
use unic_io::{
    Capture, Manifest, Split,
    capture::{StagedClip, finish_moves},
};
use unic_testdata::{FPS, Figure, take, write_capture};

/// Files of a capture, without anything left over.
const FILES: [&str; 5] = [
    "capture.toml",
    "character.npz",
    "clips",
    "garment.npz",
    "garment.obj",
];

/// Stages the clip `name`, and adds it to `manifest`.
fn stage(root: &Path, name: &str, seed: usize, manifest: &mut Manifest) -> StagedClip {
    let staged = StagedClip::create_in(root).unwrap();
    let takes = [(take(name, seed, 5), Split::Train)];
    write_capture(staged.path(), &Figure::tube(), &takes);
    manifest.splits.train.push(name.to_owned());
    staged
}

fn manifest() -> Manifest {
    Manifest {
        contact_joints: Some([4, 4, 5, 5].map(unic_io::capture::JointReference::Index)),
        ..Manifest::new("tube", FPS)
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_kill_between_any_two_moves_is_completed_by_the_next_process() {
    let files = [
        "character.npz",
        "garment.obj",
        "garment.npz",
        "clips/a.garment.npy",
        "clips/a.npz",
    ];
    for moved in 0..=files.len() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let mut next = manifest();
        let staged = stage(root, "a", 0, &mut next);
        // The state in which `commit` leaves the folder if it is killed after `moved` moves.
        let kept = staged.path().to_path_buf();
        std::mem::forget(staged);
        let mut own = Manifest::read(&kept.join("capture.toml")).unwrap();
        own.name = "a".to_owned();
        own.write(&kept.join("capture.toml")).unwrap();
        next.write(&kept.join("next.toml")).unwrap();
        fs::create_dir_all(root.join("clips")).unwrap();
        for file in &files[..moved] {
            fs::rename(kept.join(file), root.join(file)).unwrap();
        }
        assert!(Capture::open(root).is_err());
        finish_moves(root).unwrap();
        assert_eq!(names(root), FILES, "after {moved} moves");
        assert_eq!(Capture::open(root).unwrap().load_clip("a").unwrap().clip.len(), 5);
    }
}

#[test]
fn clips_are_added_and_replaced_and_leftovers_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let mut next = manifest();
    stage(root, "a", 0, &mut next).commit("a", &next).unwrap();
    assert_eq!(names(root), FILES);
    // A process that is killed before it moves anything leaves its folder.
    std::mem::forget(stage(root, "b", 1, &mut next.clone()));
    assert_eq!(names(root).len(), FILES.len() + 1);
    finish_moves(root).unwrap();
    assert_eq!(names(root), FILES);
    assert_eq!(names(&root.join("clips")), ["a.garment.npy", "a.npz"]);

    stage(root, "b", 1, &mut next).commit("b", &next).unwrap();
    let first = Capture::open(root).unwrap().load_clip("a").unwrap();
    // Replaced by another motion.
    stage(root, "a", 2, &mut manifest()).commit("a", &next).unwrap();
    let capture = Capture::open(root).unwrap();
    assert_eq!(capture.clip_names(Split::Train), ["a", "b"]);
    assert!(!capture.load_clip("a").unwrap().clip.has_motion_of(&first.clip));
    drop(stage(root, "c", 3, &mut manifest()));
    assert_eq!(names(root), FILES);
}
