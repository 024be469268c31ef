//! Contract: every reader of archives refuses a zip bomb before it is unpacked, in time and memory
//! of the order of the file.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::small_character;
use std::{
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
};
use unic_io::{
    MotionOptions, Npz, capture::read_garment, import_motion, inspect, npy::Dim, read_character,
    read_vertex_cache, write_obj,
};
use unic_mutation::{CountingAllocator, measure};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Size that each bomb would unpack to, bytes.
const UNPACKED: usize = 192 << 20;

/// Memory for refusing one, bytes: buffers of fixed size.
const ALLOWED: usize = 2 << 20;

/// An array of zeros.
struct Zeros {
    name: &'static str,
    /// Shape in the header.
    shape: String,
    /// Number of bytes behind the header.
    length: usize,
}

impl Zeros {
    /// An array of f32 with as many bytes as its shape holds.
    fn floats(name: &'static str, shape: &[usize]) -> Self {
        let extents: String = shape.iter().map(|n| format!("{n}, ")).collect();
        Self {
            name,
            shape: format!("({extents})"),
            length: 4 * shape.iter().product::<usize>(),
        }
    }

    fn header(&self) -> Vec<u8> {
        let text = format!(
            "{{'descr': '<f4', 'fortran_order': False, 'shape': {}}}",
            self.shape
        );
        let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        bytes.extend(format!("{text:117}\n").bytes());
        bytes
    }
}

fn write_archive(path: &Path, method: CompressionMethod, arrays: &[Zeros]) {
    let mut zip = ZipWriter::new(File::create(path).unwrap());
    let options = SimpleFileOptions::default().compression_method(method);
    for array in arrays {
        zip.start_file(format!("{}.npy", array.name), options).unwrap();
        zip.write_all(&array.header()).unwrap();
        let zeros = vec![0; 1 << 20];
        let mut left = array.length;
        while left > 0 {
            let count = left.min(zeros.len());
            zip.write_all(&zeros[..count]).unwrap();
            left -= count;
        }
    }
    zip.finish().unwrap();
}

/// Writes an archive of one deflated array.
fn bomb(folder: &Path, array: Zeros) -> PathBuf {
    let path = folder.join("bomb.npz");
    write_archive(&path, CompressionMethod::Deflated, &[array]);
    path
}

/// Changes a number in the first entry of the archive's directory, at offset `at` of the entry
/// (APPNOTE.TXT of PKWARE, 4.3.12).
fn patch_directory(path: &Path, at: usize, number: u32) {
    let mut bytes = fs::read(path).unwrap();
    let entry = (bytes.windows(4).position(|w| w == b"PK\x01\x02")).unwrap();
    bytes[entry + at..entry + at + 4].copy_from_slice(&number.to_le_bytes());
    fs::write(path, bytes).unwrap();
}

/// Offset of the packed size in an entry.
const PACKED_SIZE: usize = 20;
/// Offset of the unpacked size in an entry.
const UNPACKED_SIZE: usize = 24;

/// Returns the message of a refusal that takes little memory.
fn refusal<T>(what: &str, read: impl FnOnce() -> unic_io::Result<T>) -> String {
    let (outcome, cost) = measure(read);
    assert!(cost.peak < ALLOWED, "{what}: {cost}");
    match outcome {
        Ok(_) => panic!("{what}: a bomb is read"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn zip_bombs_are_refused_by_every_reader() {
    let folder = tempfile::tempdir().unwrap();
    let character = small_character();
    let rows = UNPACKED / 12;
    let assert_ratio = |sentence: String| {
        assert!(sentence.contains("bytes for each packed byte"), "{sentence}");
    };

    let path = bomb(folder.path(), Zeros::floats("vertices", &[rows / 1024, 1024, 3]));
    assert_ratio(refusal("cache", || read_vertex_cache(&path)));
    let path = bomb(folder.path(), Zeros::floats("vertices", &[rows, 3]));
    assert_ratio(refusal("character", || read_character(&path)));
    let path = bomb(folder.path(), Zeros::floats("poses", &[rows / 1024, 3 * 1024]));
    let joints = 1024;
    assert_ratio(refusal("array", || {
        Npz::open(&path)?.array::<f32>("poses", &[Dim::Any("T"), Dim::Is(3 * joints)])
    }));
    let count = character.skeleton.len();
    let path = bomb(folder.path(), Zeros::floats("poses", &[rows / count, 3 * count]));
    let sentence = refusal("motion", || {
        import_motion(&path, &character, &MotionOptions::default())
    });
    assert!(
        sentence.contains("poses") || sentence.contains("frame rate"),
        "{sentence}"
    );

    write_obj(&folder.path().join("garment.obj"), &character.body).unwrap();
    let path = folder.path().join("garment.npz");
    let array = Zeros::floats("weights", &[rows, 3]);
    write_archive(&path, CompressionMethod::Deflated, &[array]);
    refusal("garment", || read_garment(folder.path(), &character));
}

#[test]
fn inspection_reports_a_zip_bomb_without_unpacking_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = bomb(
        folder.path(),
        Zeros::floats("vertices", &[UNPACKED / 12 / 1024, 1024, 3]),
    );
    let (report, cost) = measure(|| inspect(&path).unwrap());
    assert!(cost.peak < ALLOWED, "{cost}");
    assert!(
        report.problems.iter().any(|p| p.contains("packed into")),
        "{report}"
    );
}

#[test]
fn archive_sizes_that_contradict_the_shape_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut array = Zeros::floats("vertices", &[2, 2, 3]);
    array.length = UNPACKED / 6;
    let path = bomb(folder.path(), array);
    let sentence = refusal("small shape", || read_vertex_cache(&path));
    assert!(
        sentence.contains("expected 48 bytes for shape (2, 2, 3)"),
        "{sentence}"
    );
}

#[test]
fn false_sizes_in_the_directory_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let header = Zeros::floats("vertices", &[2, 2, 3]).header().len();
    let mut array = Zeros::floats("vertices", &[2, 2, 3]);
    array.length = UNPACKED;
    let path = bomb(folder.path(), array);
    patch_directory(&path, UNPACKED_SIZE, (header + 48) as u32);
    let sentence = refusal("unpacked size", || read_vertex_cache(&path));
    assert!(
        sentence.contains("array `vertices`: expected the end of the array"),
        "{sentence}"
    );

    // A declared packed size larger than the file must not raise the limit.
    let path = bomb(
        folder.path(),
        Zeros::floats("vertices", &[UNPACKED / 12 / 1024, 1024, 3]),
    );
    patch_directory(&path, PACKED_SIZE, 1 << 30);
    refusal("packed size", || read_vertex_cache(&path));
}

#[test]
fn text_longer_than_its_shape_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("text.npz");
    let mut zip = ZipWriter::new(File::create(&path).unwrap());
    zip.start_file("names.npy", SimpleFileOptions::default()).unwrap();
    let header = Zeros::floats("names", &[2]).header();
    let header = String::from_utf8_lossy(&header).replace("<f4", "|S4");
    // The magic's first byte is not UTF-8.
    zip.write_all(b"\x93").unwrap();
    zip.write_all(&header.as_bytes()[header.find("NUMPY").unwrap()..])
        .unwrap();
    zip.write_all(&vec![b'a'; UNPACKED]).unwrap();
    zip.finish().unwrap();
    let length = header.len() - header.find("NUMPY").unwrap() + 1 + 8;
    patch_directory(&path, UNPACKED_SIZE, length as u32);
    let sentence = refusal("text", || Npz::open(&path)?.text("names"));
    assert!(sentence.contains("expected the end of the array"), "{sentence}");
}

#[test]
fn constant_and_uncompressed_arrays_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sound.npz");
    // Small with a ratio of a thousand, as constant masks have; and large, but uncompressed.
    for (method, length) in [
        (CompressionMethod::Deflated, 2 << 20),
        (CompressionMethod::Stored, 20 << 20),
    ] {
        write_archive(&path, method, &[Zeros::floats("mask", &[length])]);
        let mask = Npz::open(&path)
            .unwrap()
            .array::<f32>("mask", &[Dim::Any("V")])
            .unwrap();
        assert_eq!(mask.data.len(), length);
    }
}
