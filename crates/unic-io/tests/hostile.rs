//! Contract: no damaged file makes a reader panic, loop endlessly or allocate memory out of
//! proportion to it.
//!
//! Small files of every kind are truncated at every byte and have bits flipped. The global
//! allocator records the largest allocation.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{small_character, small_clip, small_frame, small_garment};
use glam::Vec3;
use proptest::prelude::*;
use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    path::{Path, PathBuf},
};
use unic_io::{
    Capture, CaptureWriter, Manifest, MotionOptions, NpzWriter, Split, VertexCacheWriter,
    capture::{JointReference, VertexAttributes},
    import_motion,
    inspect::inspect,
    npy::write_npy,
    parse_obj, read_character, read_vertex_cache, write_character, write_motion, write_obj,
};

/// Allocator that records the largest allocation of each thread.
struct Recording;

thread_local! {
    static LARGEST: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is passed to the system's allocator unchanged. The record is a thread-local
// cell that needs no allocation.
unsafe impl GlobalAlloc for Recording {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.with(|largest| largest.set(largest.get().max(layout.size())));
        // SAFETY: the caller guarantees the layout that the system's allocator demands.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from `alloc`, which took it from the system's allocator.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Recording = Recording;

/// Largest allocation allowed while reading files of a few kilobytes: buffers of fixed size (64
/// KiB), the window and tables of deflate, and a clip that a flipped bit in its rate lengthens.
const LARGEST_ALLOWED: usize = 4 << 20;

fn largest_allocation(read: impl FnOnce()) -> usize {
    LARGEST.with(|largest| largest.set(0));
    read();
    LARGEST.with(Cell::get)
}

/// Reads a file with every reader; only panics and memory matter.
fn read_every_way(path: &Path) {
    let largest = largest_allocation(|| {
        let _ = read_character(path);
        let options = MotionOptions {
            fps: Some(30.0),
            ..MotionOptions::default()
        };
        let _ = import_motion(path, &small_character(), &options);
        let _ = read_vertex_cache(path);
        let _ = inspect(path);
    });
    assert!(
        largest <= LARGEST_ALLOWED,
        "{}: {largest} bytes at once",
        path.display()
    );
}

fn small_files(folder: &Path) -> Vec<PathBuf> {
    let at = |name: &str| folder.join(name);
    let garment = small_garment();
    write_character(&at("character.npz"), &small_character()).unwrap();
    write_motion(&at("motion.npz"), &small_clip("motion", 4), &[]).unwrap();
    write_obj(&at("garment.obj"), &garment.rest).unwrap();
    write_npy(&at("frames.npy"), &[2, 4, 3], &[0.5; 24]).unwrap();
    for name in ["cache.pc2", "cache.npz"] {
        let mut cache = VertexCacheWriter::create(&at(name), &garment.rest, 30.0).unwrap();
        (0..3).for_each(|t| cache.push(&small_frame(t)).unwrap());
        cache.finish().unwrap();
    }
    let mut model = 64_u64.to_le_bytes().to_vec();
    let header = r#"{"__metadata__":{"unic":"{\"version\":1}"},"a":{"dtype":"F32"}}"#;
    model.extend(format!("{header:64}").bytes());
    std::fs::write(at("model.unic"), model).unwrap();
    let bvh = "HIERARCHY\nROOT a\n{\nOFFSET 0 1 0\nCHANNELS 4 Yposition Zrotation Xrotation Yrotation\nEnd Site\n\
               {\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 3\nFrame Time: .01\n1 2 3 4\n1 3 4 5\n1 4 5 6\n";
    std::fs::write(at("walk.bvh"), bvh).unwrap();
    let names = [
        "character.npz",
        "motion.npz",
        "walk.bvh",
        "garment.obj",
        "frames.npy",
        "cache.pc2",
        "cache.npz",
        "model.unic",
    ];
    names.map(at).to_vec()
}

#[test]
fn truncated_files_are_refused_within_the_memory_limit() {
    let folder = tempfile::tempdir().unwrap();
    for path in small_files(folder.path()) {
        let whole = std::fs::read(&path).unwrap();
        read_every_way(&path);
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            read_every_way(&path);
        }
        std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        let report = inspect(&path).unwrap();
        let is_text = path.extension().is_some_and(|e| e == "obj");
        assert!(is_text || !report.problems.is_empty(), "{report}");
    }
}

#[test]
fn damaged_captures_are_refused_within_the_memory_limit() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    let mut manifest = Manifest::new("small", 30.0);
    manifest.contact_joints = Some([0, 1, 0, 1].map(JointReference::Index));
    let (character, garment) = (small_character(), small_garment());
    let attributes = VertexAttributes::default();
    let mut writer = CaptureWriter::create(root, manifest, &character, &garment, &attributes).unwrap();
    let mut clip = writer.begin_clip(&small_clip("walk", 3), Split::Train).unwrap();
    (0..3).for_each(|t| clip.push(&small_frame(t)).unwrap());
    clip.finish().unwrap();
    writer.finish().unwrap();
    let load = || Capture::open(root).and_then(|c| c.load_clip("walk"));
    assert!(load().is_ok());
    for file in [
        "capture.toml",
        "character.npz",
        "garment.npz",
        "clips/walk.npz",
        "clips/walk.garment.npy",
    ] {
        let path = root.join(file);
        let whole = std::fs::read(&path).unwrap();
        for length in (0..whole.len()).step_by(3) {
            std::fs::write(&path, &whole[..length]).unwrap();
            let largest = largest_allocation(|| drop(load()));
            assert!(
                largest <= LARGEST_ALLOWED,
                "{file} cut to {length}: {largest} bytes"
            );
            // A manifest without its last lines may still be valid.
            assert!(
                file == "capture.toml" || load().is_err(),
                "{file} cut to {length} was read"
            );
        }
        std::fs::write(&path, whole).unwrap();
    }
}

#[test]
fn false_sizes_in_headers_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lie.npy");
    write_npy(&path, &[2, 4, 3], &[0.5; 24]).unwrap();
    let whole = String::from_utf8_lossy(&std::fs::read(&path).unwrap()[10..]).to_string();
    for shape in [
        "(9999999999, 4, 3)",
        "(2, 99999999999999999999, 3)",
        "(0, 4, 3)",
        "(18446744073709551615, 0, 3)",
    ] {
        let header = whole.split('}').next().unwrap().replace("(2, 4, 3)", shape) + "}";
        let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        bytes.extend(format!("{header:117}\n").bytes());
        bytes.extend([0; 96]);
        std::fs::write(&path, bytes).unwrap();
        read_every_way(&path);
        assert!(read_vertex_cache(&path).is_err(), "{shape}");
    }
}

#[test]
fn arrays_without_extent_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty.npz");
    for shape in [&[4, 0][..], &[4, 0, 3], &[0, 6], &[0], &[], &[1 << 40, 0, 3]] {
        let mut npz = NpzWriter::create(&path).unwrap();
        let data = vec![0.0; shape.iter().product()];
        for name in [
            "poses", "trans", "fps", "vertices", "faces", "joints", "parents", "weights",
        ] {
            npz.f32s(name, shape, &data).unwrap();
        }
        npz.finish().unwrap();
        read_every_way(&path);
        assert!(read_character(&path).is_err());
        assert!(read_vertex_cache(&path).is_err());
    }
}

#[test]
fn wrong_shapes_are_refused_before_unpacking() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bomb.npz");
    let mut npz = NpzWriter::create(&path).unwrap();
    npz.f32s("vertices", &[16 << 20], &vec![0.0; 16 << 20]).unwrap();
    npz.f32s("poses", &[4 << 20, 4], &vec![0.0; 16 << 20]).unwrap();
    npz.finish().unwrap();
    read_every_way(&path);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 800, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bits_do_no_harm(which in 0_usize..7, flips in prop::collection::vec((0_usize..1 << 20, 0_u8..8), 1..6)) {
        thread_local! {
            static FILES: (tempfile::TempDir, Vec<(PathBuf, Vec<u8>)>) = {
                let folder = tempfile::tempdir().unwrap();
                let files = small_files(folder.path());
                let files = files.into_iter().map(|p| { let b = std::fs::read(&p).unwrap(); (p, b) });
                let files = files.collect();
                (folder, files)
            };
        }
        FILES.with(|(_, files)| {
            let (path, whole) = &files[which];
            let mut bytes = whole.clone();
            for (at, bit) in &flips {
                let at = at % bytes.len();
                bytes[at] ^= 1 << bit;
            }
            std::fs::write(path, bytes).unwrap();
            read_every_way(path);
        });
    }

    #[test]
    fn any_text_may_be_an_obj(text in "(v|vt|f|#|g|\\\\| |-|[0-9]|/|\\.|e|\n){0,80}") {
        let _ = parse_obj(Path::new("a.obj"), &text);
    }

}

proptest! {
    // Each case syncs a file to disk.
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn meshes_come_back_to_the_bit(positions in prop::collection::vec(prop::array::uniform3(prop::num::f32::NORMAL | prop::num::f32::ZERO | prop::num::f32::SUBNORMAL), 3..20)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        let mut mesh = small_garment().rest;
        mesh.vertices = positions.into_iter().map(Vec3::from_array).chain(mesh.vertices).collect();
        write_obj(&path, &mesh).unwrap();
        prop_assert_eq!(unic_io::read_obj(&path).unwrap(), mesh);
    }
}
