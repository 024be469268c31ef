//! Contract: data sets are converted to captures with the same motion and garment, in metres, Y up.
//! Files of another layout are refused in one sentence.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{Quat, Vec3};
use proptest::prelude::*;
use std::{fs, path::Path, process::Command};
use unic_core::{character::Character, clip::Clip, mesh::TriMesh};
use unic_io::{
    Capture, NpzWriter, Split,
    datasets::{Dataset, convert},
    write_obj,
};
use unic_testdata::{Figure, clip};

/// Number of SMPL's joints.
const JOINTS: usize = 24;
const FRAMES: usize = 12;

/// The test figure with 24 joints: its own six and others without weights.
fn figure() -> Figure {
    use unic_core::{
        skeleton::{Skeleton, SkeletonParts},
        skinning::SkinningWeights,
    };
    let mut figure = Figure::tube();
    let mut parts: SkeletonParts = figure.character.skeleton.to_parts();
    for j in parts.joints.len()..JOINTS {
        parts.names.push(format!("extra{j}"));
        parts.parents.push(0);
        parts.joints.push(Vec3::Y);
        parts.rest_pose.push(Vec3::ZERO);
    }
    let wider = |weights: &SkinningWeights| {
        let rows = (0..weights.len()).map(|v| weights.row(v).collect::<Vec<_>>().into_iter());
        SkinningWeights::from_rows(JOINTS, rows).unwrap()
    };
    figure.character.weights = wider(&figure.character.weights);
    figure.garment.weights = wider(&figure.garment.weights);
    figure.character.skeleton = Skeleton::new(parts).unwrap();
    figure
}

/// A motion of the figure that starts in the bind pose, so that one frame shows the rest shape.
fn motion(seed: usize) -> Clip {
    let mut clip = clip("motion", seed, FRAMES);
    for pose in &mut clip.poses {
        pose.local.resize(JOINTS, Quat::IDENTITY);
    }
    clip.poses[0].local.fill(Quat::IDENTITY);
    clip
}

/// Rotation vectors of every frame.
fn rotations(clip: &Clip) -> Vec<Vec<Vec3>> {
    let frame = |pose: &unic_core::Pose| pose.local.iter().map(|q| q.to_scaled_axis()).collect();
    clip.poses.iter().map(frame).collect()
}

/// Writer of a pickle of protocol 4 with a dictionary of numpy arrays in the layout of numpy 1.
#[derive(Default)]
struct Pickler(Vec<u8>);

impl Pickler {
    fn text(&mut self, text: &str) -> &mut Self {
        self.0.extend([0x8c, text.len() as u8]);
        self.0.extend(text.as_bytes());
        self
    }

    fn int(&mut self, value: usize) -> &mut Self {
        self.0.push(b'J');
        self.0.extend((value as u32).to_le_bytes());
        self
    }

    fn global(&mut self, module: &str, name: &str) -> &mut Self {
        self.text(module).text(name);
        self.0.push(0x93);
        self
    }

    fn array(&mut self, shape: &[usize], dtype: &str, bytes: &[u8]) -> &mut Self {
        self.global("numpy.core.multiarray", "_reconstruct")
            .global("numpy", "ndarray")
            .int(0);
        self.0.extend([0x85]);
        self.0.extend([b'C', 1, b'b', 0x87, b'R', b'(']);
        self.int(1).0.push(b'(');
        for &extent in shape {
            self.int(extent);
        }
        self.0.push(b't');
        self.global("numpy", "dtype")
            .text(dtype)
            .0
            .extend([0x89, 0x88, 0x87, b'R', b'(']);
        self.int(3)
            .text("<")
            .0
            .extend([b'N', b'N', b'N', b't', b'b', 0x89]);
        self.0.push(0x8e);
        self.0.extend((bytes.len() as u64).to_le_bytes());
        self.0.extend(bytes);
        self.0.extend(*b"tb");
        self
    }

    /// Returns the bytes of a file with a dictionary of arrays.
    fn dict(entries: &[(&str, Vec<usize>, &str, Vec<u8>)]) -> Vec<u8> {
        let mut pickler = Self(vec![0x80, 4, b'}', b'(']);
        for (name, shape, dtype, bytes) in entries {
            pickler.text(name).array(shape, dtype, bytes);
        }
        pickler.0.extend(*b"u.");
        pickler.0
    }
}

fn bytes(numbers: impl Iterator<Item = f32>) -> Vec<u8> {
    numbers.flat_map(f32::to_le_bytes).collect()
}

fn point_bytes(frames: &[Vec<Vec3>]) -> Vec<u8> {
    bytes(frames.iter().flatten().flat_map(|p| p.to_array()))
}

/// Returns a file of the VTO data set with poses of 75 numbers.
fn vto(figure: &Figure, clip: &Clip) -> Vec<u8> {
    let garment = figure.skinned(clip);
    let frames = rotations(clip).into_iter().zip(&clip.poses);
    let poses = frames.flat_map(|(r, pose)| r.into_iter().chain([pose.trans]).flat_map(|v| v.to_array()));
    let faces = &figure.garment.rest.faces;
    let indices: Vec<u8> = faces
        .iter()
        .flatten()
        .flat_map(|&i| i64::from(i).to_le_bytes())
        .collect();
    Pickler::dict(&[
        (
            "shapes",
            vec![FRAMES, 10],
            "f4",
            bytes((0..10 * FRAMES).map(|_| 0.0)),
        ),
        ("poses", vec![FRAMES, 75], "f4", bytes(poses)),
        (
            "vertices",
            vec![FRAMES, garment[0].len(), 3],
            "f4",
            point_bytes(&garment),
        ),
        ("faces", vec![faces.len(), 3], "i8", indices),
    ])
}

fn largest_distance(capture: &Capture, name: &str, expected: &[Vec<Vec3>]) -> f32 {
    let clip = capture.load_clip(name).unwrap();
    assert_eq!(clip.garment.len(), expected.len());
    let pairs = (0..expected.len()).flat_map(|t| clip.garment.frame(t).iter().zip(&expected[t]));
    pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

#[test]
fn vto_sequences_become_a_capture() {
    let (folder, figure) = (tempfile::tempdir().unwrap(), figure());
    let data = folder.path().join("tshirt");
    fs::create_dir_all(data.join("simulations")).unwrap();
    for (seed, motion_name) in ["01_01", "02_04", "07_02"].iter().enumerate() {
        let path = data.join(format!("simulations/tshirt_shape00_{motion_name}.pkl"));
        fs::write(path, vto(&figure, &motion(seed))).unwrap();
    }
    fs::write(
        data.join("simulations/tshirt_shape01_01_01.pkl"),
        b"of another body",
    )
    .unwrap();
    let out = folder.path().join("capture");
    let converted = convert(Dataset::Vto, &data, &figure.character, &out).unwrap();
    assert_eq!(converted.clips, 3);
    assert!(
        converted
            .notes
            .iter()
            .any(|note| note.contains("1 of other shapes")),
        "{:?}",
        converted.notes
    );
    let capture = Capture::open(&out).unwrap();
    assert_eq!(capture.manifest.fps, 30.0);
    assert_eq!(capture.clip_names(Split::Test), ["tshirt_shape00_07_02"]);
    assert_eq!(capture.clip_names(Split::Train).len(), 2);
    let expected = figure.skinned(&motion(1));
    assert!(largest_distance(&capture, "tshirt_shape00_02_04", &expected) < 1e-6);
    // The first frame is in the bind pose.
    let pairs = capture
        .garment
        .rest
        .vertices
        .iter()
        .zip(&figure.garment.rest.vertices);
    let off = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(off < 1e-5, "the rest shape is {off} m off");
    assert_eq!(capture.garment.rest.faces, figure.garment.rest.faces);
}

/// Z up: (x, y, z) to (x, −z, y).
fn z_up(v: Vec3) -> Vec3 {
    Vec3::new(v.x, -v.z, v.y)
}

/// Position of the template's pelvis, metres, Z up.
const PELVIS: Vec3 = Vec3::new(0.0, -0.0215, 0.9048);

/// Writes a folder of the VirtualBones data set whose positions have the unit `unit` in metres, in
/// world space or in the frame of the root joint.
fn virtual_bones(folder: &Path, figure: &Figure, unit: f32, from_root: bool) {
    let skeleton = &figure.character.skeleton;
    let pelvis = skeleton.joints()[0];
    let rest = &figure.garment.rest;
    let template: Vec<Vec3> = rest
        .vertices
        .iter()
        .map(|v| (z_up(*v - pelvis) + PELVIS) * 10.0)
        .collect();
    fs::create_dir_all(folder).unwrap();
    let mesh = TriMesh::new(template, rest.faces.clone()).unwrap();
    write_obj(&folder.join("template.obj"), &mesh).unwrap();
    for seed in 0..2 {
        let clip = motion(seed);
        let garment = figure.skinned(&clip);
        let (mut pose, mut trans, mut sim_res) = (Vec::new(), Vec::new(), Vec::new());
        for (t, rotations) in rotations(&clip).into_iter().enumerate() {
            let mut joints = Vec::new();
            skeleton.forward_kinematics(&clip.poses[t], &mut joints);
            let upright = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2) * clip.poses[t].local[0];
            let rotations = std::iter::once(upright.to_scaled_axis()).chain(rotations[1..22].iter().copied());
            pose.extend(rotations.chain([Vec3::ONE; 30]).flat_map(|v| v.to_array()));
            trans.extend((z_up(joints[0].translation) - PELVIS).to_array());
            for x in &garment[t] {
                let x = match from_root {
                    true => joints[0].inverse().point(*x),
                    false => z_up(*x),
                };
                sim_res.extend((x / unit).to_array());
            }
        }
        let mut npz = NpzWriter::create(&folder.join(format!("{seed}.npz"))).unwrap();
        npz.f32s("pose", &[FRAMES, 52, 3], &pose).unwrap();
        npz.f32s("trans", &[FRAMES, 3], &trans).unwrap();
        npz.f32s("sim_res", &[FRAMES, rest.vertices.len(), 3], &sim_res)
            .unwrap();
        npz.finish().unwrap();
    }
}

#[test]
fn virtual_bones_sequences_of_any_coordinate_frame_become_a_capture() {
    let (folder, figure) = (tempfile::tempdir().unwrap(), figure());
    for (i, (unit, from_root)) in [(0.1, false), (1.0, false), (0.1, true), (1.0, true)]
        .into_iter()
        .enumerate()
    {
        let data = folder.path().join(format!("dress{i}"));
        virtual_bones(&data, &figure, unit, from_root);
        let out = folder.path().join(format!("capture{i}"));
        let converted = convert(Dataset::VirtualBones, &data, &figure.character, &out).unwrap();
        let capture = Capture::open(&out).unwrap();
        let off = largest_distance(&capture, "1", &figure.skinned(&motion(1)));
        assert!(off < 1e-5, "{unit} {from_root}: {off} m, {:?}", converted.notes);
        let poses = &capture.load_clip("1").unwrap().clip.poses;
        for (found, expected) in poses.iter().zip(&motion(1).poses) {
            assert!(found.trans.distance(expected.trans) < 1e-5);
            assert!(found.local[0].angle_between(expected.local[0]) < 1e-3);
        }
    }
}

/// Prints a pickle of every protocol as numpy and Python write it, for the arrays that the reader
/// needs.
const PYTHON: &str = "
import pickle, sys, numpy as np
folder = sys.argv[1]
poses = np.zeros((5, 75)); poses[:, 0] = np.arange(5) * 0.01; poses[:, 72] = np.arange(5)
data = {'poses': poses, 'shapes': np.zeros((5, 10)), 'sequence': '01_01', 'conf': {'a': [1.5, None, (True, 'b')]},
    'vertices': (np.arange(4 * 3).reshape(4, 3) * 0.01 + np.arange(5)[:, None, None] * [1, 0, 0]).astype('>f8'), 'faces': np.array([[0, 1, 2], [0, 2, 3]], dtype='i4')}
for protocol in [2, 3, 4, 5]:
    with open(f'{folder}/p{protocol}_s_1.pkl', 'wb') as file:
        pickle.dump(data, file, protocol=protocol)
";

#[test]
fn pickles_of_every_protocol_are_read() {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let has = Command::new(&python).args(["-c", "import numpy"]).output();
    if !has.is_ok_and(|o| o.status.success()) {
        eprintln!("skipped: {python} has no package numpy");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let status = Command::new(&python)
        .args(["-c", PYTHON])
        .arg(folder.path())
        .status()
        .unwrap();
    assert!(status.success());
    for protocol in 2..=5 {
        let data = folder.path().join(format!("only{protocol}"));
        fs::create_dir(&data).unwrap();
        let name = format!("p{protocol}_s_1");
        fs::rename(
            folder.path().join(format!("{name}.pkl")),
            data.join(format!("{name}.pkl")),
        )
        .unwrap();
        let out = folder.path().join(format!("capture{protocol}"));
        let figure = figure();
        let result = convert(Dataset::Vto, &data, &figure.character, &out);
        let capture = result.map(|_| Capture::open(&out).unwrap());
        let capture = capture.unwrap_or_else(|e| panic!("protocol {protocol}: {e}"));
        let clip = capture.load_clip(&name).unwrap();
        assert_eq!(clip.clip.poses[3].trans, Vec3::X * 3.0);
        assert!((clip.garment.frame(4)[3] - Vec3::new(4.09, 0.10, 0.11)).length() < 1e-6);
        assert_eq!(capture.garment.rest.faces, [[0, 1, 2], [0, 2, 3]]);
    }
}

fn refusal(data: &[u8], character: &Character) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tshirt_shape00_1.pkl");
    fs::write(&path, data).unwrap();
    let out = folder.path().join("capture");
    let error = convert(Dataset::Vto, folder.path(), character, &out).expect_err("a damaged file");
    assert!(!out.join("capture.toml").exists());
    error.to_string()
}

#[test]
fn other_layouts_are_refused() {
    let figure = figure();
    let character = &figure.character;
    assert!(refusal(b"not a pickle", character).contains("expected a pickle"));
    assert!(refusal(b"\x80\x04}.", character).contains("expected an array `poses`"));
    let mut clip = motion(0);
    for pose in &mut clip.poses {
        pose.trans.y += 3.0;
    }
    let whole = vto(&figure, &clip);
    assert!(refusal(&whole[..whole.len() / 2], character).contains("expected a pickle"));
    let empty = tempfile::tempdir().unwrap();
    let error = convert(
        Dataset::VirtualBones,
        empty.path(),
        character,
        &empty.path().join("out"),
    );
    assert!(
        error
            .unwrap_err()
            .to_string()
            .contains("expected sequences (.npz)")
    );
    // A garment in another unit.
    let folder = tempfile::tempdir().unwrap();
    virtual_bones(folder.path(), &figure, 0.033, false);
    let error = convert(
        Dataset::VirtualBones,
        folder.path(),
        character,
        &folder.path().join("out"),
    );
    assert!(error.unwrap_err().to_string().contains("m off"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// A damaged file is refused or read; it never panics.
    #[test]
    fn damaged_pickles_never_panic(at in 0.0f64..1.0, flips in 1u8..=255, end in any::<bool>()) {
        let figure = figure();
        let mut data = vto(&figure, &motion(0));
        // The structure is at both ends of the arrays.
        let place = (at * if end { 400.0 } else { data.len() as f64 }) as usize;
        let place = if end { data.len() - 1 - place } else { place };
        data[place] ^= flips;
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("tshirt_shape00_1.pkl"), data).unwrap();
        let _ = convert(Dataset::Vto, folder.path(), &figure.character, &folder.path().join("capture"));
    }
}
