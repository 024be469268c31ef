//! Contract: no damaged file makes the reader panic, loop endlessly or hold memory out of proportion
//! to it, and every refusal is one sentence.
//!
//! `UNIC_MUTATION_SECONDS` is the time for random damage, `UNIC_MUTATION_SEED` repeats one file; see
//! [`unic_mutation`].

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{file, nested, point, transform};
use ogawa::{
    Archive, ArchiveWriter, Attribute, Faces, FrameTiming, MeshDescription, Scope,
    archive::{ObjectTree, TimeSampling, write_archive},
    container::{Child, Container, ContainerWriter},
};
use std::{fs, io::Cursor, path::Path};
use unic_mutation::{CountingAllocator, FuzzTarget, fuzz, measure, scratch_folder};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Number of frames of a mesh that are used: a damaged file may claim billions.
const FRAMES: u32 = 8;

/// Two meshes in three frames, one of them with texture coordinates and normals.
fn small_archive() -> Vec<u8> {
    let timing = FrameTiming {
        fps: 24.0,
        start: 0.0,
    };
    let mut writer = ArchiveWriter::new(Cursor::new(Vec::new()), timing).unwrap();
    let faces = Faces::new(vec![3, 4], vec![0, 1, 2, 0, 2, 3, 1]).unwrap();
    let uvs = Attribute {
        scope: Scope::Corner,
        values: vec![[0.0, 1.0], [1.0, 0.0]],
        indices: Some(vec![0, 1, 0, 1, 0, 1, 0]),
    };
    let mut ids = Vec::new();
    for (name, uvs) in [("garment", Some(&uvs)), ("body", None)] {
        let mesh = MeshDescription {
            name,
            vertices: 4,
            faces: &faces,
            uvs,
        };
        ids.push(writer.add_mesh(&mesh).unwrap());
    }
    for frame in [0.0, 0.0, 1.0_f32] {
        let points = [[frame; 3], [1.0; 3], [2.0; 3], [3.0; 3]];
        writer
            .push_with_normals(ids[0], &points, &[[0.0, 1.0, frame]; 4])
            .unwrap();
        writer.push(ids[1], &points).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

/// Reads everything that a damaged archive offers.
fn use_archive(bytes: &[u8]) -> ogawa::Result<()> {
    let mut archive = Archive::from_bytes(bytes)?;
    let ids: Vec<_> = archive.objects().map(|(id, _)| id).collect();
    for id in ids {
        let name = archive.full_name(id);
        assert!(name.starts_with('/'));
        for child in archive.object(id).children() {
            assert_eq!(archive.object(child).parent(), Some(id));
        }
    }
    let mut points = Vec::new();
    for mesh in archive.meshes()? {
        for frame in 0..mesh.frames().min(FRAMES) {
            mesh.world_positions(&mut archive, frame, &mut points)?;
            let faces = mesh.faces(&mut archive, frame)?;
            assert!(
                faces
                    .corners()
                    .iter()
                    .all(|&vertex| (vertex as usize) < points.len())
            );
            assert_eq!(faces.iter().count(), faces.len());
            if let Some(uvs) = mesh.uvs(&mut archive, frame)? {
                assert!((0..uvs.len()).all(|i| uvs.get(i).is_some()));
            }
            mesh.normals(&mut archive, frame)?;
            mesh.velocities(&mut archive, frame)?;
        }
    }
    Ok(())
}

/// A mesh of three frames below moving transforms of three kinds, with times of another kind.
fn moving_archive() -> Vec<u8> {
    let mut file = file();
    let matrix: [f64; 16] = std::array::from_fn(|i| f64::from(u8::from(i % 5 == 0)));
    let transforms = vec![
        transform(&mut file, "a", true, 0x30, &[&matrix]),
        transform(
            &mut file,
            "b",
            true,
            0x20,
            &[&[0.0, 1.0, 0.0, 90.0], &[0.0, 1.0, 0.0, 45.0]],
        ),
        transform(&mut file, "c", true, 0x10, &[&[1.0; 3], &[1.0; 3], &[2.0; 3]]),
    ];
    let point = point(&mut file);
    nested(
        file,
        point,
        transforms,
        TimeSampling::Acyclic(vec![0.0, 0.5, 2.0]),
    )
}

#[test]
fn truncated_and_mutated_meshes_are_refused_or_read() {
    refused_or_read("mesh", &small_archive());
}

#[test]
fn truncated_and_mutated_transforms_are_refused_or_read() {
    refused_or_read("transforms", &moving_archive());
}

fn refused_or_read(name: &str, valid: &[u8]) {
    let path = scratch_folder(Path::new(env!("CARGO_TARGET_TMPDIR")), name).join("a.abc");
    fs::write(&path, valid).unwrap();
    let target = FuzzTarget {
        name,
        path: &path,
        container: unic_mutation::Container::Plain,
    };
    let tally = fuzz(&target, |path| {
        let bytes = fs::read(path).map_err(|e| e.to_string())?;
        use_archive(&bytes).map_err(|e| e.to_string())
    });
    assert!(tally.refused > 100 && tally.read > 100, "{tally}");
}

#[test]
fn every_flipped_bit_is_refused_or_read_within_bounds() {
    for valid in [small_archive(), moving_archive()] {
        flip_every_bit(&valid);
    }
}

fn flip_every_bit(valid: &[u8]) {
    for at in 0..valid.len() {
        for bit in 0..8 {
            let mut bytes = valid.to_vec();
            bytes[at] ^= 1 << bit;
            let (_, cost) = measure(|| use_archive(&bytes).map_err(|e| assert!(!e.to_string().is_empty())));
            assert!(cost.peak < 1 << 20, "bit {bit} of byte {at}: {cost}");
        }
    }
}

#[test]
fn every_truncation_is_refused() {
    let valid = small_archive();
    for end in 0..valid.len() {
        assert!(Archive::from_bytes(&valid[..end]).is_err(), "{end} bytes");
    }
}

#[test]
fn an_unfinished_file_is_refused() {
    let mut bytes = small_archive();
    bytes[5] = 0;
    let error = Archive::from_bytes(&bytes).unwrap_err().to_string();
    assert_eq!(
        error,
        "byte 5: expected the mark of a finished file, 255, found 0"
    );
}

/// Writes an archive whose top object is `top`.
fn archive_around(mut file: ContainerWriter<Cursor<Vec<u8>>>, top: Child) -> Vec<u8> {
    let sampling = [
        &0_u32.to_le_bytes()[..],
        &1_f64.to_le_bytes(),
        &1_u32.to_le_bytes(),
        &[0; 8],
    ];
    let parts = [
        file.data(&[&0_i32.to_le_bytes()]).unwrap(),
        file.data(&[&10800_i32.to_le_bytes()]).unwrap(),
        top,
        file.data(&[b"a=b"]).unwrap(),
        file.data(&sampling).unwrap(),
        Child::EMPTY_DATA,
    ];
    let root = file.group(parts.into_iter()).unwrap();
    file.finish(root).unwrap().into_inner()
}

/// Headers of child objects that are called a, b, c, ... without metadata.
fn object_headers(count: u8) -> Vec<u8> {
    let header = |i| [1, 0, 0, 0, b'a' + i, 0];
    (0..count).flat_map(header).chain([0; 32]).collect()
}

#[test]
fn an_object_that_contains_itself_is_refused() {
    let mut file = file();
    let headers = object_headers(1);
    let data = file.data(&[&headers]).unwrap();
    // The group comes behind the header of 16 bytes and the data with their length.
    let own = Child::Group(16 + 8 + headers.len() as u64);
    let group = file.group([Child::EMPTY_GROUP, own, data].into_iter()).unwrap();
    assert_eq!(group, own);
    let bytes = archive_around(file, group);
    let error = Archive::from_bytes(&bytes).unwrap_err().to_string();
    assert!(
        error.ends_with("expected a tree of groups, found a group with two parents"),
        "{error}"
    );
}

#[test]
fn a_compound_that_contains_itself_is_refused() {
    let mut file = file();
    // A compound without metadata, whose name has one letter.
    let header = [0, 0, 0, 0, 1, b'a'];
    let data = file.data(&[&header]).unwrap();
    let own = Child::Group(16 + 8 + header.len() as u64);
    assert_eq!(file.group([own, data].into_iter()).unwrap(), own);
    let top = file.group([own, Child::EMPTY_DATA].into_iter()).unwrap();
    let error = Archive::from_bytes(&archive_around(file, top))
        .unwrap_err()
        .to_string();
    assert!(error.contains("a tree of groups"), "{error}");
}

#[test]
fn objects_that_share_their_headers_take_no_more_memory_than_the_file_has() {
    // Each of 26 objects has 26 children, and so on: the headers are shared, the groups are not.
    let mut file = file();
    let headers = file.data(&[&object_headers(26)]).unwrap();
    let mut level = vec![Child::EMPTY_GROUP; 26];
    for _ in 0..40 {
        let children = [&[Child::EMPTY_GROUP][..], &level, &[headers]].concat();
        let group = file.group(children.into_iter()).unwrap();
        level = vec![Child::EMPTY_GROUP; 26];
        level[0] = group;
    }
    let bytes = archive_around(file, level[0]);
    let (read, cost) = measure(|| Archive::from_bytes(&bytes).map(drop));
    assert!(read.is_ok() && cost.is_bounded(bytes.len()), "{cost}");
    // Many small groups with one large header.
    let mut file = common::file();
    let mut long = vec![0, 0, 1, 0];
    long.extend([b'a'; 0x1_0000]);
    long.push(0);
    long.extend([0; 32]);
    let headers = file.data(&[&long]).unwrap();
    let mut child = Child::EMPTY_GROUP;
    for _ in 0..900 {
        child = file
            .group([Child::EMPTY_GROUP, child, headers].into_iter())
            .unwrap();
    }
    let bytes = archive_around(file, child);
    let (read, cost) = measure(|| Archive::from_bytes(&bytes).map(drop));
    let error = read.unwrap_err().to_string();
    assert!(error.contains("headers that are read once"), "{error}");
    assert!(cost.is_bounded(bytes.len()) && cost.peak < 1 << 20, "{cost}");
}

#[test]
fn deep_trees_are_refused() {
    let nested = |depth: usize| {
        let mut tree = ObjectTree {
            name: "a".into(),
            ..ObjectTree::default()
        };
        for _ in 0..depth {
            tree = ObjectTree {
                name: "a".into(),
                children: vec![tree],
                ..ObjectTree::default()
            };
        }
        let sampling = TimeSampling::default();
        let bytes = write_archive(file(), tree, &[sampling]).unwrap().into_inner();
        Archive::from_bytes(&bytes).map(|archive| archive.objects().count())
    };
    assert_eq!(nested(1000).unwrap(), 1001);
    let error = nested(1001).unwrap_err().to_string();
    assert!(
        error.contains("at most 1000 objects inside each other"),
        "{error}"
    );
}

#[test]
fn offsets_and_counts_beyond_the_file_are_refused() {
    let mut bytes = small_archive();
    for (offset, expected) in [
        (0_u64, "an Alembic archive of 6 parts"),
        (1, "an offset from 16 to"),
        (u64::MAX >> 1, "an offset from 16 to"),
        (1 << 63, "the offset of a group"),
    ] {
        bytes[8..16].copy_from_slice(&offset.to_le_bytes());
        let error = Archive::from_bytes(&bytes).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let end = bytes.len() as u64 - 8;
    bytes[8..16].copy_from_slice(&end.to_le_bytes());
    bytes.truncate(end as usize);
    bytes.extend(u64::MAX.to_le_bytes());
    let mut container = Container::new(Cursor::new(&bytes)).unwrap();
    let error = container.root().unwrap_err().to_string();
    assert!(
        error.contains("a count of children that end within the file"),
        "{error}"
    );
}
