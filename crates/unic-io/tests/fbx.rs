//! Contract: a rigged character and its motion are read from FBX as other programs show them.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{data, largest_distance, posed};
use unic_io::{
    Assumed, Capture, MotionOptions, import_motion,
    rigged::{RiggedFormat, read_rigged_character},
};

/// Largest distance of a posed vertex from the truth, metres.
const EXACT_M: f32 = 1e-4;

#[test]
fn the_walk_of_blender_is_that_of_the_capture() {
    let (Some(fbx), Some(root)) = (data("interop/body_walk.fbx"), data("captures/tshirt_blender")) else {
        return;
    };
    let capture = Capture::open(&root).unwrap();
    let truth = capture.load_clip("walk_02_01").unwrap().clip;
    let read = read_rigged_character(&fbx, RiggedFormat::Fbx, &Assumed::default()).unwrap();
    println!("{:?}", read.notes);
    let body = &read.character.body;
    println!("rest {:.4} mm", 1e3 * largest_distance(&body.vertices, &capture.character.body.vertices));
    assert!(largest_distance(&body.vertices, &capture.character.body.vertices) < 1e-5);
    assert_eq!(body.faces, capture.character.body.faces);
    assert_eq!(read.vertex_of_file, (0..3738).collect::<Vec<u32>>());
    assert_eq!(read.character.skeleton.len(), 24);
    // On its own rig, and on the capture's character, whose zero pose is another one.
    for character in [&read.character, &capture.character] {
        let import = import_motion(&fbx, character, &MotionOptions::default()).unwrap();
        println!("{:?}", import.notes);
        assert_eq!((import.clip.len(), import.clip.fps), (150, 30.0));
        assert!(import.findings.is_empty());
        let far = (import.clip.poses.iter().zip(&truth.poses))
            .map(|(pose, truth)| largest_distance(&posed(character, pose), &posed(&capture.character, truth)))
            .fold(0.0, f32::max);
        println!("{:.4} mm", 1e3 * far);
        let rows: Vec<_> = (0..3738).map(|v| (read.character.weights.row(v).collect::<Vec<_>>(), capture.character.weights.row(v).collect::<Vec<_>>())).collect();
        let most = rows.iter().map(|r| (r.0.len(), r.1.len())).max();
        println!("{most:?} {:?}", &rows[..3]);
    }
}
