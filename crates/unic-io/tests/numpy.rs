//! Contract: numpy reads the files of this crate, and this crate reads the files of numpy. The
//! script `numpy_interop.py` is the other side; without Python and numpy the tests are skipped.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{small_character, small_clip, small_frame, small_garment};
use glam::Vec3;
use std::{
    path::Path,
    process::{Command, Output},
};
use unic_core::mesh::TriMesh;
use unic_io::{
    CaptureWriter, Error, Manifest, Npz, NpzWriter, Split, VertexCacheWriter, VertexFrames,
    capture::{JointReference, VertexAttributes},
    frames::VertexFramesWriter,
    npy::{Array, Dim, write_npy},
};

fn python(arguments: &[&str]) -> Option<Output> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/numpy_interop.py");
    let has_numpy = Command::new("python3")
        .args(["-c", "import numpy, tomllib"])
        .output();
    if !has_numpy.is_ok_and(|o| o.status.success()) {
        eprintln!("skipped: python3 with numpy is not there");
        return None;
    }
    Some(
        Command::new("python3")
            .arg(script)
            .args(arguments)
            .output()
            .unwrap(),
    )
}

fn run(verb: &str, folder: &Path) -> Option<()> {
    let output = python(&[verb, folder.to_str().unwrap()])?;
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    Some(())
}

const BLOCK: [Dim; 3] = [Dim::Is(2), Dim::Any("N"), Dim::Is(4)];

fn counting_numbers(count: usize) -> Vec<f32> {
    (0..count).map(|i| i as f32 - 3.0).collect()
}

#[test]
fn all_number_types_and_orders_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let Some(()) = run("write", folder.path()) else {
        return;
    };
    for file in ["stored.npz", "deflated.npz"] {
        let mut npz = Npz::open(&folder.path().join(file)).unwrap();
        let names = npz.names().to_vec();
        let blocks = names.iter().filter(|n| n.ends_with("_C") || n.ends_with("_F"));
        let mut count = 0;
        for name in blocks {
            let array = npz.finite::<f32>(name, &BLOCK).unwrap();
            assert_eq!(
                (array.shape, array.data),
                (vec![2, 3, 4], counting_numbers(24)),
                "{name}"
            );
            let integers = npz.array::<i64>(name, &BLOCK);
            assert_eq!(integers.is_ok(), name.starts_with('i'), "{name}");
            count += 1;
        }
        assert_eq!(count, 7 * 2 * 2);
        for code in ["u1", "u2", "u4", "u8"] {
            let array: Array<u32> = npz.array(&format!("{code}_plus_3"), &[Dim::Is(5)]).unwrap();
            assert_eq!(array.data, [0, 1, 2, 3, 4]);
        }
        assert_eq!(
            npz.array::<bool>("bool", &[Dim::Any("V")]).unwrap().data,
            [true, false, true]
        );
        assert_eq!(npz.number("scalar").unwrap(), 29.97);
        assert_eq!(
            npz.array::<f32>("empty", &[Dim::Any("T"), Dim::Is(3)])
                .unwrap()
                .shape,
            [0, 3]
        );
        assert_eq!(npz.text("text").unwrap(), ["pelvis", "L_hüft", ""]);
        assert_eq!(npz.text("bytes").unwrap(), ["ab", "c"]);
    }
}

#[test]
fn other_types_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let Some(()) = run("write", folder.path()) else {
        return;
    };
    let mut npz = Npz::open(&folder.path().join("deflated.npz")).unwrap();
    for (name, words) in [
        ("objects", "expected numbers, found pickled Python objects"),
        ("structure", "found a structured or complex type"),
        ("complex", "found a structured or complex type"),
        ("text", "expected numbers, found text"),
        ("bool", "expected shape (2), found shape (3,)"),
        ("nan", "expected finite numbers, found NaN at element 1"),
        ("absent", "expected an array `absent`, found only"),
    ] {
        let message = npz.finite::<f64>(name, &[Dim::Is(2)]).unwrap_err().to_string();
        assert!(
            message.contains(words) && message.contains("deflated.npz"),
            "{message}"
        );
    }
}

#[test]
fn npy_files_of_any_order_are_read_as_frames() {
    let folder = tempfile::tempdir().unwrap();
    let Some(()) = run("write", folder.path()) else {
        return;
    };
    for (file, mapped) in [
        ("plain.npy", true),
        ("fortran.npy", false),
        ("version2.npy", true),
    ] {
        let frames = VertexFrames::open_npy(&folder.path().join(file)).unwrap();
        assert_eq!(
            (frames.len(), frames.vertex_count(), frames.is_mapped()),
            (4, 5, mapped)
        );
        let all: Vec<f32> = frames.iter().flatten().flat_map(|v| v.to_array()).collect();
        assert_eq!(all, counting_numbers(60), "{file}");
    }
}

#[test]
fn numpy_reads_all_written_files() {
    let folder = tempfile::tempdir().unwrap();
    write_arrays(folder.path()).unwrap();
    write_animations(folder.path()).unwrap();
    write_capture(&folder.path().join("capture")).unwrap();
    run("check", folder.path());
}

fn write_arrays(folder: &Path) -> Result<(), Error> {
    let mut npz = NpzWriter::create(&folder.join("ours.npz"))?;
    npz.f32s("f32", &[2, 3, 4], &counting_numbers(24))?;
    npz.f64s("f64", &[6], &[-3.0, -2.0, -1.0, 0.0, 1.0, 2.0])?;
    npz.i32s("i32", &[3, 2], &[-3, -2, -1, 0, 1, 2])?;
    npz.u32s("u32", &[0, u32::MAX])?;
    npz.bools("bools", &[true, false])?;
    npz.f64s("scalar", &[], &[29.97])?;
    npz.text("text", &["pelvis".into(), "knée".into(), String::new()])?;
    assert!(npz.f32s("wrong", &[2, 2], &[0.0; 3]).is_err());
    npz.finish()
}

fn write_animations(folder: &Path) -> Result<(), Error> {
    let mesh = TriMesh {
        vertices: vec![Vec3::ZERO; 5],
        faces: vec![[0, 1, 2], [2, 3, 4]],
        uvs: None,
    };
    let frames: Vec<Vec3> = counting_numbers(60).chunks(3).map(Vec3::from_slice).collect();
    for name in ["animation.pc2", "animation.npz", "animation"] {
        let mut cache = VertexCacheWriter::create(&folder.join(name), &mesh, 24.0)?;
        frames.chunks(5).try_for_each(|frame| cache.push(frame))?;
        assert!(cache.push(&frames[..4]).is_err());
        assert!(!folder.join(name).exists());
        cache.finish()?;
    }
    assert!(VertexCacheWriter::create(&folder.join("animation.abc"), &mesh, 24.0).is_err());
    let mut streamed = VertexFramesWriter::create(&folder.join("streamed.npy"), 5)?;
    frames.chunks(5).try_for_each(|frame| streamed.push(frame))?;
    streamed.finish()?;
    write_npy(&folder.join("whole.npy"), &[4, 5, 3], &counting_numbers(60))
}

fn write_capture(root: &Path) -> Result<(), Error> {
    let (character, garment) = (small_character(), small_garment());
    let mut manifest = Manifest::new("small", 30.0);
    manifest.contact_joints = Some([0, 1, 0, 1].map(JointReference::Index));
    let attributes = VertexAttributes::default();
    let mut capture = CaptureWriter::create(root, manifest, &character, &garment, &attributes)?;
    let mut clip = capture.begin_clip(&small_clip("walk", 3), Split::Train)?;
    (0..3).try_for_each(|t| clip.push(&small_frame(t)))?;
    clip.finish()?;
    capture.finish()
}
