//! Contract: what is written is read back bit by bit: frames, faces, texture coordinates, normals,
//! names and times.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use ogawa::{Archive, ArchiveWriter, Attribute, Faces, FrameTiming, MeshDescription, Scope};
use proptest::{collection::vec, prelude::*};
use std::io::Cursor;

const TIMING: FrameTiming = FrameTiming {
    fps: 30.0,
    start: 0.5,
};

type Writer = ArchiveWriter<Cursor<Vec<u8>>>;
type Points = Vec<[f32; 3]>;

fn writer() -> Writer {
    ArchiveWriter::new(Cursor::new(Vec::new()), TIMING).unwrap()
}

fn bytes(writer: Writer) -> Vec<u8> {
    writer.finish().unwrap().into_inner()
}

fn triangle() -> Faces {
    Faces::triangles(&[[0, 1, 2]])
}

fn description<'a>(name: &'a str, vertices: usize, faces: &'a Faces) -> MeshDescription<'a> {
    MeshDescription {
        name,
        vertices,
        faces,
        uvs: None,
    }
}

/// Reads all frames of a mesh.
fn frames(archive: &mut Archive<Cursor<&[u8]>>, mesh: usize) -> Vec<Points> {
    let mesh = archive.meshes().unwrap()[mesh].clone();
    let read = |frame| {
        let mut points = Vec::new();
        mesh.world_positions(archive, frame, &mut points).unwrap();
        points
    };
    (0..mesh.frames()).map(read).collect()
}

/// A mesh with frames, some of them repeated.
#[derive(Clone, Debug)]
struct Animation {
    faces: Faces,
    uvs: Option<Attribute<2>>,
    frames: Vec<Points>,
    has_normals: bool,
}

fn points(vertices: usize) -> impl Strategy<Value = Points> {
    vec(prop::array::uniform3(-1e3_f32..1e3), vertices)
}

fn frames_of(vertices: usize) -> impl Strategy<Value = Vec<Points>> {
    vec((points(vertices), 1_usize..4), 0..6).prop_map(|runs| {
        let repeat = |(frame, times)| std::iter::repeat_n(frame, times);
        runs.into_iter().flat_map(repeat).collect()
    })
}

fn uvs_of(scope: Scope, elements: usize) -> BoxedStrategy<Option<Attribute<2>>> {
    let pair = || prop::array::uniform2(0_f32..1.0);
    let plain = vec(pair(), elements).prop_map(move |values| Attribute {
        scope,
        values,
        indices: None,
    });
    let indexed = (vec(pair(), 1..5), vec(0_u32..1000, elements)).prop_map(move |(values, numbers)| {
        let count = values.len() as u32;
        Attribute {
            scope,
            values,
            indices: Some(numbers.into_iter().map(|n| n % count).collect()),
        }
    });
    prop_oneof![Just(None), plain.prop_map(Some), indexed.prop_map(Some)].boxed()
}

fn animation() -> impl Strategy<Value = Animation> {
    let mesh = (1_usize..9, vec(3_u32..6, 0..6), any::<bool>());
    mesh.prop_flat_map(|(vertices, counts, is_corner)| {
        let corners = counts.iter().sum::<u32>() as usize;
        let (scope, elements) = match is_corner {
            true => (Scope::Corner, corners),
            false => (Scope::Vertex, vertices),
        };
        let faces = vec(0..vertices as u32, corners)
            .prop_map(move |corners| Faces::new(counts.clone(), corners).unwrap());
        let parts = (faces, uvs_of(scope, elements), frames_of(vertices), any::<bool>());
        parts.prop_map(move |(faces, uvs, frames, has_normals)| Animation {
            faces,
            uvs,
            frames,
            has_normals,
        })
    })
}

fn check(archive: &mut Archive<Cursor<&[u8]>>, index: usize, expected: &Animation) {
    assert_eq!(frames(archive, index), expected.frames);
    let mesh = archive.meshes().unwrap()[index].clone();
    for frame in 0..mesh.frames() {
        assert_eq!(mesh.faces(archive, frame).unwrap(), expected.faces);
        assert_eq!(mesh.uvs(archive, frame).unwrap(), expected.uvs);
        let normals = mesh.normals(archive, frame).unwrap();
        assert_eq!(normals.is_some(), expected.has_normals);
        if let Some(normals) = normals {
            assert_eq!(normals.scope, Scope::Vertex);
            assert_eq!(normals.values, expected.frames[frame as usize]);
        }
        let time = 0.5 + f64::from(frame) / 30.0;
        assert!((mesh.time(archive, frame) - time).abs() < 1e-9);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn animations_are_read_back(animations in vec(animation(), 0..4)) {
        let mut writer = writer();
        let mut ids = Vec::new();
        for (i, animation) in animations.iter().enumerate() {
            let vertices = animation.frames.first().map_or(8, Vec::len);
            let name = format!("mesh {i}");
            let uvs = animation.uvs.as_ref().filter(|uvs| uvs.scope == Scope::Corner || uvs.len() == vertices);
            let mesh = MeshDescription { name: &name, vertices, faces: &animation.faces, uvs };
            ids.push(writer.add_mesh(&mesh).unwrap());
        }
        let longest = animations.iter().map(|a| a.frames.len()).max().unwrap_or(0);
        for t in 0..longest {
            for (id, animation) in ids.iter().zip(&animations) {
                match animation.frames.get(t) {
                    None => {}
                    Some(frame) if animation.has_normals => writer.push_with_normals(*id, frame, frame).unwrap(),
                    Some(frame) => writer.push(*id, frame).unwrap(),
                }
            }
        }
        let bytes = bytes(writer);
        let mut archive = Archive::from_bytes(&bytes).unwrap();
        prop_assert_eq!(archive.meshes().unwrap().len(), animations.len());
        for (i, animation) in animations.iter().enumerate() {
            check(&mut archive, i, animation);
            let mesh = archive.meshes().unwrap()[i].clone();
            prop_assert_eq!(archive.full_name(mesh.object()), format!("/mesh {i}/mesh {i}Shape"));
        }
    }
}

#[test]
fn an_archive_without_meshes_or_frames_is_read() {
    let empty = bytes(writer());
    assert!(Archive::from_bytes(&empty).unwrap().meshes().unwrap().is_empty());
    let mut writer = writer();
    writer.add_mesh(&description("a", 3, &triangle())).unwrap();
    let without_frames = bytes(writer);
    let mut archive = Archive::from_bytes(&without_frames).unwrap();
    let mesh = archive.meshes().unwrap()[0].clone();
    assert_eq!(mesh.frames(), 0);
    let error = mesh.faces(&mut archive, 0).unwrap_err().to_string();
    assert_eq!(error, "frame: expected one of 0 frames, found 0");
}

#[test]
fn a_mesh_without_vertices_is_read() {
    let mut writer = writer();
    let id = writer.add_mesh(&description("a", 0, &Faces::default())).unwrap();
    (0..3).for_each(|_| writer.push(id, &[]).unwrap());
    let bytes = bytes(writer);
    let mut archive = Archive::from_bytes(&bytes).unwrap();
    assert_eq!(frames(&mut archive, 0), vec![Points::new(); 3]);
    let mesh = archive.meshes().unwrap()[0].clone();
    assert!(mesh.faces(&mut archive, 2).unwrap().is_empty());
}

#[test]
fn a_mesh_that_does_not_move_is_stored_once() {
    let frame = vec![[0.25; 3]; 1000];
    let of_length = |frames: usize| {
        let mut writer = writer();
        let id = writer.add_mesh(&description("a", 1000, &triangle())).unwrap();
        (0..frames).for_each(|_| writer.push(id, &frame).unwrap());
        bytes(writer)
    };
    let (short, long) = (of_length(1), of_length(500));
    assert!(
        long.len() <= short.len() + 64,
        "{} and {} bytes",
        short.len(),
        long.len()
    );
    let mut archive = Archive::from_bytes(&long).unwrap();
    assert!(archive.meshes().unwrap()[0].has_constant_positions());
    assert!(archive.meshes().unwrap()[0].has_constant_faces());
    assert!(frames(&mut archive, 0).iter().all(|read| *read == frame));
}

#[test]
fn equal_inputs_give_equal_files() {
    let file = |second: f32| {
        let mut writer = writer();
        for (name, x) in [("a", 1.0), ("b", second)] {
            let id = writer.add_mesh(&description(name, 3, &triangle())).unwrap();
            writer.push(id, &[[x; 3]; 3]).unwrap();
        }
        bytes(writer)
    };
    assert_eq!(file(2.0), file(2.0));
    assert_ne!(file(2.0), file(3.0));
}

#[test]
fn unusable_arguments_are_refused() {
    for fps in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-320] {
        let timing = FrameTiming { fps, start: 0.0 };
        assert!(ArchiveWriter::new(Cursor::new(Vec::new()), timing).is_err());
    }
    let mut writer = writer();
    let faces = triangle();
    for name in ["", "a/b", "a\0"] {
        assert!(
            writer.add_mesh(&description(name, 3, &faces)).is_err(),
            "{name:?}"
        );
    }
    assert!(writer.add_mesh(&description("a", 2, &faces)).is_err());
    let uvs = |scope, values: usize, indices| Attribute {
        scope,
        values: vec![[0.0; 2]; values],
        indices,
    };
    for uvs in [
        uvs(Scope::Corner, 2, None),
        uvs(Scope::Face, 1, None),
        uvs(Scope::Vertex, 1, Some(vec![0, 0, 1])),
    ] {
        let mesh = MeshDescription {
            uvs: Some(&uvs),
            ..description("a", 3, &faces)
        };
        assert!(writer.add_mesh(&mesh).is_err(), "{uvs:?}");
    }
    let id = writer.add_mesh(&description("a", 3, &faces)).unwrap();
    assert!(writer.add_mesh(&description("a", 3, &faces)).is_err());
    assert!(writer.push(id, &[[0.0; 3]; 2]).is_err());
    assert!(writer.push(id, &[[f32::NAN; 3]; 3]).is_err());
    writer.push(id, &[[0.0; 3]; 3]).unwrap();
    let normals = [[0.0, 1.0, 0.0]; 3];
    assert!(writer.push_with_normals(id, &[[0.0; 3]; 3], &normals).is_err());
}

#[test]
fn a_file_appears_when_it_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.abc");
    let entries = || std::fs::read_dir(folder.path()).unwrap().count();
    drop(ArchiveWriter::create(&path, TIMING).unwrap());
    assert_eq!(entries(), 0);
    let mut writer = ArchiveWriter::create(&path, TIMING).unwrap();
    let id = writer.add_mesh(&description("a", 3, &triangle())).unwrap();
    writer.push(id, &[[1.0; 3]; 3]).unwrap();
    assert!(!path.exists());
    writer.save().unwrap();
    assert_eq!(entries(), 1);
    let archive = Archive::open(&path).unwrap();
    assert_eq!(archive.meshes().unwrap()[0].frames(), 1);
}
