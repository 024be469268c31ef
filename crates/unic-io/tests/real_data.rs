//! Contract: the real captures and the files of other programs are read exactly.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::data;
use glam::Vec3;
use unic_io::{
    Capture, Split, VertexFrames,
    capture::WeightsSource,
    inspect::{FileKind, inspect},
    read_obj, read_vertex_cache,
};

fn capture() -> Option<Capture> {
    let root = data("captures/tshirt_blender")?;
    Some(Capture::open(&root).unwrap())
}

/// Largest distance between a position of the capture, rounded to 2e-5 m a coordinate, and the
/// exact one of the interop files: √3 · 1e-5 m and a margin.
const ROUNDED: f32 = 1.8e-5;

/// The clip that the interop files hold.
fn walk() -> Option<VertexFrames> {
    Some(capture()?.load_clip("walk_02_01").unwrap().garment)
}

fn largest_distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

#[test]
fn missing_parts_of_the_capture_have_defaults() {
    let Some(capture) = capture() else { return };
    assert_eq!(capture.character.body.vertices.len(), 3738);
    assert_eq!(capture.character.body.faces.len(), 7472);
    assert_eq!(capture.character.skeleton.names()[15], "head");
    assert_eq!(capture.garment.rest.vertices.len(), 3019);
    assert_eq!(capture.garment.rest.uvs, None);
    assert_eq!(capture.weights_source, WeightsSource::Diffused);
    assert_eq!(capture.contact_joints, [7, 10, 8, 11]);
    assert_eq!(capture.clip_names(Split::Train).len(), 7);
    assert_eq!(capture.clip_names(Split::Test), ["run_02_03"]);
    assert!(capture.clip_names(Split::Validation).is_empty());
}

#[test]
fn clips_are_near_the_skinned_garment() {
    let Some(capture) = capture() else { return };
    let (mut joints, mut transforms, mut skinned) = (vec![], vec![], vec![]);
    let names = capture.clips_on_disk().unwrap();
    assert_eq!(names.len(), 8);
    for name in names {
        let clip = capture.load_clip(&name).unwrap();
        let frames = if name == "jump_02_04" { 115 } else { 150 };
        assert_eq!((clip.clip.len(), clip.clip.fps), (frames, 30.0));
        let summary = capture.summarise_clip(&name).unwrap();
        assert_eq!(summary.garment_shape, [frames, 3019, 3]);
        for (pose, garment) in clip.clip.poses.iter().zip(clip.garment.iter()).step_by(20) {
            capture.character.skeleton.forward_kinematics(pose, &mut joints);
            capture
                .character
                .skeleton
                .world_from_rest(&joints, &mut transforms);
            capture
                .garment
                .weights
                .skin(&capture.garment.rest.vertices, &transforms, &mut skinned);
            let sum: f32 = garment
                .iter()
                .zip(&skinned)
                .map(|(a, b)| a.distance_squared(*b))
                .sum();
            let rms = (sum / 3019.0).sqrt();
            // The skinned rest shape of this T-shirt is 45-75 mm (RMS) off.
            assert!(rms < 0.15, "{name}: {rms}");
        }
    }
}

#[test]
fn skinning_in_the_bind_pose_returns_the_vertices() {
    let Some(capture) = capture() else { return };
    let character = &capture.character;
    let (mut joints, mut transforms, mut skinned) = (vec![], vec![], vec![]);
    character
        .skeleton
        .forward_kinematics(&character.skeleton.bind_pose(), &mut joints);
    character.skeleton.world_from_rest(&joints, &mut transforms);
    character
        .weights
        .skin(&character.body.vertices, &transforms, &mut skinned);
    assert!(largest_distance(&skinned, &character.body.vertices) < 2e-6);
    let Some(path) = data("interop/body_rest.obj") else {
        return;
    };
    let body = read_obj(&path).unwrap();
    assert!(largest_distance(&body.vertices, &character.body.vertices) < 1e-5);
    assert_eq!(body.faces, character.body.faces);
}

#[test]
fn blender_point_cache_equals_the_clip() {
    let (Some(walk), Some(path)) = (walk(), data("interop/tshirt_walk.pc2")) else {
        return;
    };
    let cache = read_vertex_cache(&path).unwrap().frames;
    assert!(cache.is_mapped());
    assert_eq!(cache.len(), walk.len());
    for (found, expected) in cache.iter().zip(walk.iter()) {
        assert!(largest_distance(found, expected) < ROUNDED);
    }
}

#[test]
fn blender_obj_sequence_equals_the_clip() {
    let (Some(walk), Some(folder)) = (walk(), data("interop/obj_sequence")) else {
        return;
    };
    let cache = read_vertex_cache(&folder).unwrap();
    assert_eq!(cache.frames.len(), 10);
    for (found, expected) in cache.frames.iter().zip(walk.iter()) {
        assert!(largest_distance(found, expected) < ROUNDED);
    }
    let Some(rest) = data("interop/tshirt_rest.obj") else {
        return;
    };
    assert_eq!(cache.mesh.unwrap().faces, read_obj(&rest).unwrap().faces);
}

#[test]
fn inspection_agrees_with_the_readme() {
    let Some(root) = data("captures/tshirt_blender") else {
        return;
    };
    let report = inspect(&root).unwrap();
    println!("{report}");
    assert_eq!(report.kind, FileKind::Capture);
    assert_eq!(report.problems, Vec::<String>::new());
    // The README has 7.5 %, by another test for points inside, and the same depth.
    let inside = report.get("garment inside the body at rest").unwrap();
    assert!(
        inside.starts_with("6.8 %") && inside.contains("at most 21.0"),
        "{inside}"
    );
    assert!(
        report
            .get("clip walk_02_01")
            .unwrap()
            .contains("150 frames, 4.97 s, train")
    );
}

#[test]
fn inspection_recognises_every_kind() {
    let Some(_) = data("body") else { return };
    for (file, kind) in [
        ("body/character.npz", FileKind::Character),
        ("motion/locomotion/Walk1.npz", FileKind::Motion),
        ("motion/style100/Neutral_FW.npz", FileKind::Motion),
        ("interop/tshirt_walk.pc2", FileKind::PointCache),
        ("interop/tshirt_rest.obj", FileKind::Mesh),
        ("interop/obj_sequence", FileKind::MeshSequence),
        ("captures/tshirt_blender/capture.toml", FileKind::Capture),
        ("interop/tshirt_walk.abc", FileKind::Alembic),
        ("interop/body_walk.fbx", FileKind::Character),
    ] {
        let Some(path) = data(file) else { return };
        let report = inspect(&path).unwrap();
        println!("{report}");
        assert_eq!(report.kind, kind, "{file}");
        assert_eq!(report.problems.is_empty(), kind != FileKind::Unknown, "{report}");
        assert_eq!(report.facts.is_empty(), kind == FileKind::Unknown, "{report}");
    }
}
