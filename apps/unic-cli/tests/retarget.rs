//! Contract: `unic retarget` writes a motion that moves the character as the source moves its own
//! body, and a second transfer onto the same character changes nothing.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use unic_builtin::{
    human::{HumanParameters, human},
    motion::control_set,
};
use unic_core::transform::Rigid;
use unic_io::{MotionOptions, import_motion, read_character, write_character, write_motion};

#[test]
fn a_transferred_motion_is_read_back_from_both_formats() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let human = human(&HumanParameters::default()).unwrap();
    write_character(&folder.join("human.npz"), &human).unwrap();
    let clip = control_set(&human, 0, 30.0).unwrap().swap_remove(0).part(0..40);
    write_motion(&folder.join("walk.npz"), &clip, human.skeleton.names()).unwrap();
    let source = "walk.npz --to human.npz --feet keep";
    let summary = json(folder, &format!("retarget {source} --out a.npz --json"));
    assert_eq!(
        (summary["joints"].as_u64(), summary["fps"].as_f64()),
        (Some(24), Some(30.0))
    );
    let feet = &summary["feet"];
    assert_eq!(feet["slide_before_m_per_s"], feet["slide_after_m_per_s"]);
    let text = succeeds(folder, &format!("retarget {source} --out a.bvh"));
    assert!(text.contains("standing feet"), "{text}");
    // A model has the character that it was trained on: here the same one.
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/garments/tshirt.unic");
    succeeds(
        folder,
        &format!("retarget walk.npz --to {model} --feet keep --out c.npz"),
    );
    let character = read_character(&folder.join("human.npz")).unwrap();
    let read = |name: &str| {
        let options = MotionOptions {
            ground: unic_io::GroundPlacement::Keep,
            low_pass: unic_io::LowPass::Off,
            feet: unic_io::FootLock::Keep,
            ..MotionOptions::default()
        };
        import_motion(&folder.join(name), &character, &options)
            .unwrap()
            .clip
    };
    let expected = read("walk.npz");
    let (mut a, mut b): (Vec<Rigid>, Vec<Rigid>) = Default::default();
    for (name, tolerance) in [("a.npz", 1e-6), ("a.bvh", 1e-5), ("c.npz", 1e-6)] {
        let found = read(name);
        assert_eq!(found.len(), expected.len());
        for (x, y) in found.poses.iter().zip(&expected.poses) {
            character.skeleton.forward_kinematics(x, &mut a);
            character.skeleton.forward_kinematics(y, &mut b);
            for (a, b) in a.iter().zip(&b) {
                let off = a.translation.distance(b.translation);
                assert!(off < tolerance, "{name}: {off}");
            }
        }
    }
}

#[test]
fn refusals_are_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("a.bvh"), "HIERARCHY").unwrap();
    for (line, words) in [
        (
            "retarget a.bvh --out b.fbx",
            "expected the ending .npz or .bvh, found .fbx",
        ),
        ("retarget a.bvh --out a.bvh --overwrite", "found the input"),
        (
            "retarget a.bvh --to none.npz --out b.npz",
            "none.npz: cannot open",
        ),
        ("retarget a.bvh --out b.npz", "a.bvh: expected"),
    ] {
        let output = unic(folder, line);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(
            !output.status.success() && stderr.contains(words),
            "{line}: {stderr}"
        );
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
    }
}
