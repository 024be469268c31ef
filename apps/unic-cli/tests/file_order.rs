//! Contract: the body of a glTF file, which repeats vertices along the seams of its texture, is
//! welded, and comes back from `unic animate` with the vertices of the file.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use glam::Vec2;
use std::path::Path;
use unic_core::{character::Character, clip::Clip, mesh::Uvs};
use unic_io::{
    Split,
    glb::{GlbScene, GlbWriter},
    read_character, read_obj, read_vertex_cache,
};
use unic_testdata::{Figure, mixamo_clip, write_capture as write_takes};

/// Writes a figure whose texture has a seam along its left half, as an exporter does.
fn write_rig(path: &Path, mut figure: Figure, clip: &Clip) {
    let body = &mut figure.character.body;
    let count = body.vertices.len() as u32;
    let is_left = |face: &&[u32; 3]| face.iter().all(|&v| body.vertices[v as usize].x > -1e-3);
    let seamed = |face: &[u32; 3]| face.map(|v| v + count * u32::from(is_left(&face)));
    body.uvs = Some(Uvs {
        coordinates: (0..2 * count).map(|i| Vec2::splat(i as f32)).collect(),
        faces: body.faces.iter().map(seamed).collect(),
    });
    let scene = GlbScene {
        name: "take",
        character: &figure.character,
        garment: &figure.garment.rest,
        fps: clip.fps,
        frames: 1,
    };
    let mut writer = GlbWriter::create(path, &scene).unwrap();
    writer
        .push(&clip.poses[0], &figure.garment.rest.vertices)
        .unwrap();
    writer.finish().unwrap();
}

/// Trains a model for a character for a moment, in `folder`.
fn train_for(folder: &Path, character: Character) {
    let figure = Figure {
        character,
        ..Figure::mixamo()
    };
    let splits = [Split::Train, Split::Train, Split::Train, Split::Test];
    let names = ["one", "two", "three", "four"];
    let takes: Vec<_> = (names.into_iter().zip(splits).enumerate())
        .map(|(seed, (name, split))| (figure.swung(mixamo_clip(name, seed, FRAMES)), split))
        .collect();
    write_takes(&folder.join("tube"), &figure, &takes);
    train(folder, "tube.unic", "--steps 1");
}

#[test]
fn a_body_with_texture_seams_comes_back_in_the_order_of_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_rig(&path("rig.glb"), Figure::mixamo(), &mixamo_clip("one", 0, FRAMES));
    let character = read_character(&path("rig.glb")).unwrap();
    let (welded, count) = (
        character.body.vertices.len(),
        Figure::mixamo().character.body.vertices.len(),
    );
    let of_file = character.in_file_order().into_owned();
    assert_eq!(welded, count, "the seam is welded");
    assert!(
        of_file.body.vertices.len() > count + 10,
        "the file repeats vertices"
    );

    train_for(folder.path(), character.clone());
    let animate = |out: &str| {
        let line = format!("animate tube.unic --motion tube/clips/four.npz --overwrite --out {out}");
        succeeds(folder.path(), &line);
    };
    animate("a.pc2");
    animate("a.abc");
    animate("a.glb");
    assert_eq!(read_obj(&path("a.body.obj")).unwrap(), of_file.body);
    let cache = read_vertex_cache(&path("a.body.pc2")).unwrap().frames;
    let mut archive = ogawa::Archive::open(path("a.abc")).unwrap();
    let meshes = archive.meshes().unwrap();
    let mut positions = Vec::new();
    for (frame, expected) in (0..).zip(cache.iter()) {
        meshes[1]
            .world_positions(&mut archive, frame, &mut positions)
            .unwrap();
        assert!(positions.iter().eq(expected.iter().map(AsRef::as_ref)));
    }
    let normals = meshes[1].normals(&mut archive, 0).unwrap().unwrap().values;
    for (v, &of_body) in (character.file_mesh.iter()).flat_map(|m| m.body_vertices.iter().enumerate()) {
        // The seam does not show.
        assert_eq!(normals[v], normals[of_body as usize]);
    }
    // The rig of the GLB is that of the file.
    let again = read_character(&path("a.glb")).unwrap();
    assert_eq!(again.file_mesh, character.file_mesh);
}
