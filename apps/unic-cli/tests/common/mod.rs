//! A small synthetic capture, and the program driven as a user does.
#![allow(
    dead_code,
    reason = "every test file is a program of its own and uses a part of this"
)]

use glam::{Quat, Vec3};
use std::{
    f32::consts::TAU,
    path::{Path, PathBuf},
    process::{Command, Output},
};
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
    mesh::TriMesh,
    skeleton::{Pose, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use unic_io::{CaptureWriter, Manifest, Split, capture::JointReference};

pub(crate) const FRAMES: usize = 30;
pub(crate) const FPS: f32 = 30.0;
/// Vertices of the garment.
pub(crate) const VERTICES: usize = 60;

/// A tube around +Y of `rings` × `sides` vertices.
fn tube(radius: f32, from: f32, to: f32, [rings, sides]: [u32; 2]) -> TriMesh {
    let vertex = |i: u32| {
        let (sin, cos) = (TAU * (i % sides) as f32 / sides as f32).sin_cos();
        let y = from + (to - from) * (i / sides) as f32 / (rings - 1) as f32;
        Vec3::new(radius * sin, y, radius * cos)
    };
    let quad = |i: u32| {
        let (ring, side) = (i / sides, i % sides);
        let [a, b] = [ring * sides + side, ring * sides + (side + 1) % sides];
        [[a, b, b + sides], [a, b + sides, a + sides]]
    };
    let vertices = (0..rings * sides).map(vertex).collect();
    TriMesh::new(vertices, (0..(rings - 1) * sides).flat_map(quad).collect()).unwrap()
}

/// Blends from the first joint to the second between 0.9 m and 1.3 m.
fn weights(mesh: &TriMesh) -> SkinningWeights {
    let row = |v: &Vec3| {
        let upper = ((v.y - 0.9) / 0.4).clamp(0.0, 1.0);
        [1.0 - upper, upper, 0.0, 0.0]
    };
    let dense: Vec<f32> = mesh.vertices.iter().flat_map(row).collect();
    SkinningWeights::from_dense(&dense, mesh.vertices.len(), 4).unwrap()
}

pub(crate) fn character() -> Character {
    let body = tube(0.15, 0.0, 1.6, [9, 10]);
    let skeleton = Skeleton::new(SkeletonParts {
        names: ["hip", "chest", "L_foot", "R_foot"].map(str::to_owned).to_vec(),
        parents: vec![-1, 0, 0, 0],
        joints: vec![Vec3::Y * 0.9, Vec3::Y * 1.2, Vec3::X * 0.1, Vec3::X * -0.1],
        ..SkeletonParts::default()
    });
    Character {
        weights: weights(&body),
        body,
        skeleton: skeleton.unwrap(),
    }
}

pub(crate) fn garment() -> Garment {
    let rest = tube(0.2, 0.7, 1.4, [5, 12]);
    Garment {
        weights: weights(&rest),
        rest,
    }
}

/// A slow walk with a bow; `seed` shifts it in time.
pub(crate) fn clip(name: &str, seed: usize) -> Clip {
    let pose = |t: usize| {
        let s = (t + 17 * seed) as f32 / FPS;
        let bow = Quat::from_rotation_x(0.4 * (5.0 * s).sin());
        let turn = Quat::from_rotation_y(0.5 * (2.0 * s).cos());
        let local = vec![turn, bow, Quat::IDENTITY, Quat::IDENTITY];
        Pose {
            trans: Vec3::new(0.1 * (3.0 * s).sin(), 0.0, 0.4 * s),
            local,
        }
    };
    Clip {
        name: name.into(),
        fps: FPS,
        poses: (0..FRAMES).map(pose).collect(),
        ground_height: 0.0,
    }
}

/// The skinned garment, its lower rings swinging after the hip with a memory of 0.2 s.
fn frames(clip: &Clip, character: &Character, garment: &Garment) -> Vec<Vec<Vec3>> {
    let mut swing = Vec3::ZERO;
    let frame = |t: usize| {
        let pose = &clip.poses[t];
        let velocity = (pose.trans - clip.poses[t.saturating_sub(1)].trans) * FPS;
        swing += ((velocity * -0.1) - swing) * (1.0 - f32::exp(-1.0 / (0.2 * FPS)));
        let (mut joints, mut transforms, mut positions) = (Vec::new(), Vec::new(), Vec::new());
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        garment
            .weights
            .skin(&garment.rest.vertices, &transforms, &mut positions);
        let low = |rest: &Vec3| (1.4 - rest.y) / 0.7;
        positions
            .iter_mut()
            .zip(&garment.rest.vertices)
            .for_each(|(p, rest)| *p += swing * low(rest));
        positions
    };
    (0..clip.len()).map(frame).collect()
}

/// Writes the capture `folder`/tube: two training clips, one to validate, two to test.
pub(crate) fn write_capture(folder: &Path) -> PathBuf {
    let root = folder.join("tube");
    let (character, garment) = (character(), garment());
    let mut manifest = Manifest::new("tube", FPS);
    manifest.provenance = "made by a test".into();
    manifest.contact_joints = Some([2, 2, 3, 3].map(JointReference::Index));
    let mut writer =
        CaptureWriter::create(&root, manifest, &character, &garment, &Default::default()).unwrap();
    let splits = [
        ("one", Split::Train),
        ("two", Split::Train),
        ("three", Split::Validation),
        ("four", Split::Test),
        ("five", Split::Test),
    ];
    for (seed, (name, split)) in splits.into_iter().enumerate() {
        let clip = clip(name, seed);
        let mut out = writer.begin_clip(&clip, split, None).unwrap();
        frames(&clip, &character, &garment)
            .iter()
            .for_each(|frame| out.push(frame).unwrap());
        out.finish().unwrap();
    }
    writer.finish().unwrap();
    root
}

/// The program with these arguments, in `folder`.
pub(crate) fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_unic"));
    command.current_dir(folder).args(line.split_whitespace());
    command
}

pub(crate) fn unic(folder: &Path, line: &str) -> Output {
    command(folder, line).output().unwrap()
}

/// Stdout of a run that must succeed.
pub(crate) fn succeeds(folder: &Path, line: &str) -> String {
    let output = unic(folder, line);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "unic {line}: {:?}\n{stderr}",
        output.status
    );
    String::from_utf8(output.stdout).unwrap()
}

/// The one JSON object that a run prints.
pub(crate) fn json(folder: &Path, line: &str) -> serde_json::Value {
    serde_json::from_str(&succeeds(folder, line)).unwrap()
}

/// Settings that make a run of seconds.
pub(crate) const SHORT: &str = "--preset tiny --set optimiser.warmup_steps=5 --set validate_every=20";

/// Trains `out` on tube.
pub(crate) fn train(folder: &Path, out: &str, more: &str) -> serde_json::Value {
    json(folder, &format!("train tube {SHORT} --out {out} --json {more}"))
}

/// Name and bytes of each tensor of a model, in the order of names.
pub(crate) fn tensors(path: &Path) -> Vec<(String, Vec<u8>)> {
    let bytes = std::fs::read(path).unwrap();
    let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    let mut all: Vec<_> = file
        .tensors()
        .into_iter()
        .map(|(name, t)| (name, t.data().to_vec()))
        .collect();
    all.sort();
    assert!(all.len() > 8);
    all
}
