//! Scenes that the writer refuses: each yields a typed error and no file.

use crate::scene::{FRAMES, Scene};
use glam::{Quat, Vec3};
use unic_core::skinning::SkinningWeights;
use unic_io::{Error, glb::MAX_FRAMES};

fn error(change: impl FnOnce(&mut Scene)) -> Error {
    let mut scene = Scene::new();
    change(&mut scene);
    scene.try_bytes().unwrap_err()
}

#[test]
fn wrong_numbers_of_frames_are_refused() {
    for announced in [0, MAX_FRAMES + 1, usize::MAX] {
        let message = error(|scene| scene.announced = announced).to_string();
        assert!(message.contains(&announced.to_string()), "{message}");
        for other in [".pc2", ".npz", "OBJ"] {
            assert!(message.contains(other), "{message}");
        }
    }
    // A frame too many is refused at once, a frame too few at the end.
    for (announced, found) in [(FRAMES - 1, "a further one"), (FRAMES + 1, "12")] {
        let message = error(|scene| scene.announced = announced).to_string();
        let expected = format!("expected {announced} frames, found {found}");
        assert!(message.ends_with(&expected), "{message}");
    }
}

#[test]
fn the_maximum_number_of_frames_is_written() {
    let mut scene = Scene::new();
    scene.announced = MAX_FRAMES;
    scene.poses = scene.poses.iter().cloned().cycle().take(MAX_FRAMES).collect();
    scene.frames = scene.frames.iter().cloned().cycle().take(MAX_FRAMES).collect();
    assert!(scene.try_bytes().is_ok());
}

#[test]
fn extreme_frame_rates_are_refused() {
    for fps in [0.0, -30.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE] {
        let found = error(|scene| scene.fps = fps);
        assert!(matches!(found, Error::Content { .. }), "{found}");
    }
}

#[test]
fn wrong_vertex_and_joint_counts_are_refused() {
    type Change = fn(&mut Scene);
    let changes: [Change; 6] = [
        |scene| _ = scene.frames[3].pop(),
        |scene| scene.frames[0].push(Vec3::ZERO),
        |scene| _ = scene.poses[2].local.pop(),
        |scene| scene.poses[0].local.push(Quat::IDENTITY),
        |scene| _ = scene.character.body.vertices.pop(),
        |scene| {
            let rows = scene.character.body.vertices.len();
            scene.character.weights = SkinningWeights::from_dense(&vec![1.0; rows], rows, 1).unwrap();
        },
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let found = error(change);
        assert!(matches!(found, Error::Content { .. }), "{number}: {found}");
    }
}

#[test]
fn non_finite_numbers_are_refused() {
    type Change = fn(&mut Scene);
    let changes: [Change; 4] = [
        |scene| scene.frames[5][7].y = f32::NAN,
        |scene| scene.poses[5].trans.x = f32::INFINITY,
        |scene| scene.poses[0].local[1] = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0),
        |scene| scene.poses[1].local[0].w = f32::NAN,
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let found = error(change);
        assert!(matches!(found, Error::Content { .. }), "{number}: {found}");
    }
}

#[test]
fn invalid_meshes_are_refused() {
    let found = error(|scene| scene.garment.faces[0][0] = u32::MAX);
    assert!(matches!(found, Error::Mesh { .. }), "{found}");
    let found = error(|scene| scene.character.body.vertices[0] = Vec3::NAN);
    assert!(matches!(found, Error::Mesh { .. }), "{found}");
    let found = error(|scene| scene.garment.faces.clear());
    assert!(matches!(found, Error::Content { .. }), "{found}");
    let found = error(|scene| scene.character.body.faces.clear());
    assert!(matches!(found, Error::Content { .. }), "{found}");
}

#[test]
fn garments_above_4_gib_are_refused_before_writing() {
    let found = error(|scene| {
        scene.announced = MAX_FRAMES;
        scene.garment.vertices = vec![Vec3::ZERO; 500_000];
        scene.garment.uvs = None;
    });
    assert!(found.to_string().contains("3600000000"), "{found}");
}
