//! A small symmetric figure in a tube, captured in a temporary folder.
#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]
#![allow(
    dead_code,
    reason = "every test file is a program of its own and uses a part of this"
)]

use burn::tensor::Device;
use glam::{Quat, Vec3};
use std::f32::consts::TAU;
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
    config::{EncoderConfig, FieldConfig},
    mesh::TriMesh,
    skeleton::{Pose, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use unic_io::{Capture, CaptureWriter, Manifest, Split, capture::JointReference};
use unic_train::*;

pub(crate) const FPS: f32 = 30.0;
pub(crate) const FRAMES: usize = 24;
const SIDES: u32 = 12;
const RINGS: u32 = 5;
/// Vertices of the garment.
pub(crate) const VERTICES: usize = (SIDES * RINGS) as usize;
const JOINTS: usize = 6;

/// A tube around +Y, symmetric in x: vertex `side` of a ring is the mirror image of `sides − side`.
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

/// The garment vertex on the other side.
pub(crate) fn opposite(vertex: u32) -> u32 {
    let (ring, side) = (vertex / SIDES, vertex % SIDES);
    ring * SIDES + (SIDES - side) % SIDES
}

/// From hip to chest by height, a little of the arm on each side.
fn weights(mesh: &TriMesh) -> SkinningWeights {
    let row = |v: &Vec3| {
        let upper = ((v.y - 0.9) / 0.4).clamp(0.0, 1.0);
        let arm = |x: f32| upper * (2.0 * x).clamp(0.0, 0.4);
        let (left, right) = (arm(v.x), arm(-v.x));
        [1.0 - upper, upper - left - right, left, right, 0.0, 0.0]
    };
    let dense: Vec<f32> = mesh.vertices.iter().flat_map(row).collect();
    SkinningWeights::from_dense(&dense, mesh.vertices.len(), JOINTS).unwrap()
}

pub(crate) fn character() -> Character {
    let body = tube(0.15, 0.0, 1.6, [17, 16]);
    let skeleton = Skeleton::new(SkeletonParts {
        names: ["hip", "chest", "L_arm", "R_arm", "L_foot", "R_foot"]
            .map(str::to_owned)
            .to_vec(),
        parents: vec![-1, 0, 1, 1, 0, 0],
        joints: [
            [0.0, 0.9, 0.0],
            [0.0, 1.2, 0.0],
            [0.2, 1.4, 0.0],
            [-0.2, 1.4, 0.0],
            [0.1, 0.1, 0.0],
            [-0.1, 0.1, 0.0],
        ]
        .map(Vec3::from_array)
        .to_vec(),
        ..SkeletonParts::default()
    });
    Character {
        weights: weights(&body),
        body,
        skeleton: skeleton.unwrap(),
    }
}

/// A tube so tight that it cuts into the body when it swings.
pub(crate) fn garment() -> Garment {
    let rest = tube(0.16, 0.7, 1.4, [RINGS, SIDES]);
    Garment {
        weights: weights(&rest),
        rest,
    }
}

/// A motion with the garment on it.
#[derive(Clone)]
pub(crate) struct Take {
    pub(crate) clip: Clip,
    pub(crate) garment: Vec<Vec<Vec3>>,
}

/// Bows, leans and turns in a slow walk, the arms on their own; `seed` shifts it in time.
pub(crate) fn clip(name: &str, seed: usize, frames: usize) -> Clip {
    let pose = |t: usize| {
        let s = (t + 17 * seed) as f32 / FPS;
        let local = vec![
            Quat::from_rotation_y(0.5 * (2.0 * s).cos()),
            Quat::from_rotation_x(0.4 * (5.0 * s).sin()) * Quat::from_rotation_z(0.3 * (4.0 * s).sin()),
            Quat::from_rotation_z(0.6 * (3.0 * s).sin()),
            Quat::from_rotation_z(0.5 * (7.0 * s).cos()),
            Quat::from_rotation_x(0.5 * (6.0 * s).sin()),
            Quat::from_rotation_x(-0.4 * (6.0 * s).sin()),
        ];
        let trans = Vec3::new(0.1 * (3.0 * s).sin(), 0.02 * (6.0 * s).cos(), 0.4 * s);
        Pose { trans, local }
    };
    Clip {
        name: name.into(),
        fps: FPS,
        poses: (0..frames).map(pose).collect(),
        ground_height: 0.0,
    }
}

/// The skinned garment in every frame of a clip.
pub(crate) fn skinned(clip: &Clip) -> Vec<Vec<Vec3>> {
    let (character, garment) = (character(), garment());
    let frame = |pose: &Pose| {
        let (mut joints, mut transforms, mut positions) = (Vec::new(), Vec::new(), Vec::new());
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        garment
            .weights
            .skin(&garment.rest.vertices, &transforms, &mut positions);
        positions
    };
    clip.poses.iter().map(frame).collect()
}

/// The lower rings swing after the hip with a memory of 0.2 s.
pub(crate) fn take(name: &str, seed: usize, frames: usize) -> Take {
    let clip = clip(name, seed, frames);
    let (rest, mut swing) = (garment().rest, Vec3::ZERO);
    let mut garment = skinned(&clip);
    for (t, positions) in garment.iter_mut().enumerate() {
        let velocity = (clip.poses[t].trans - clip.poses[t.saturating_sub(1)].trans) * FPS;
        swing += ((velocity * -0.1) - swing) * (1.0 - f32::exp(-1.0 / (0.2 * FPS)));
        for (position, rest) in positions.iter_mut().zip(&rest.vertices) {
            *position += swing * (1.4 - rest.y) / 0.7;
        }
    }
    Take { clip, garment }
}

/// The same seen in a mirror.
pub(crate) fn mirror_image(take: &Take, name: &str) -> Take {
    let flip = |q: Quat| Quat::from_xyzw(q.x, -q.y, -q.z, q.w);
    let mut other = take.clone();
    other.clip.name = name.into();
    for pose in &mut other.clip.poses {
        pose.trans = mirrored(pose.trans);
        pose.local = [0, 1, 3, 2, 5, 4].map(|j: usize| flip(pose.local[j])).to_vec();
    }
    for (frame, original) in other.garment.iter_mut().zip(&take.garment) {
        *frame = (0..VERTICES as u32)
            .map(|v| mirrored(original[opposite(v) as usize]))
            .collect();
    }
    other
}

/// Writes takes as a capture and opens it. The folder goes with the first value.
pub(crate) fn capture(takes: &[(Take, Split)]) -> (tempfile::TempDir, Capture) {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("tube");
    let mut manifest = Manifest::new("tube", FPS);
    manifest.contact_joints = Some([4, 4, 5, 5].map(JointReference::Index));
    let mut writer =
        CaptureWriter::create(&root, manifest, &character(), &garment(), &Default::default()).unwrap();
    for (take, split) in takes {
        let mut out = writer.begin_clip(&take.clip, *split, None).unwrap();
        take.garment.iter().for_each(|frame| out.push(frame).unwrap());
        out.finish().unwrap();
    }
    writer.finish().unwrap();
    let capture = Capture::open(&root).unwrap();
    (folder, capture)
}

/// Takes as training data. Clips stay mapped when the folder goes.
pub(crate) fn dataset_of(takes: &[(Take, Split)], config: &TrainConfig) -> Dataset {
    let (_folder, capture) = capture(takes);
    Dataset::new(capture, config).unwrap()
}

/// Three takes to train on, one to validate.
pub(crate) fn dataset(config: &TrainConfig) -> Dataset {
    let splits = [Split::Train, Split::Train, Split::Train, Split::Validation];
    let takes = splits
        .iter()
        .enumerate()
        .map(|(i, split)| (take(&format!("take{i}"), i, FRAMES), *split));
    dataset_of(&takes.collect::<Vec<_>>(), config)
}

/// Both kinds of state.
pub(crate) const PRESETS: [Preset; 2] = [Preset::Paper, Preset::Tiny];

/// A preset's method with networks and batches that a test affords.
pub(crate) fn small(preset: Preset) -> TrainConfig {
    let mut config = TrainConfig::preset(preset);
    config.model.encoder = EncoderConfig {
        hidden: vec![24],
        channels: 6,
        categories: 4,
    };
    config.model.field = FieldConfig {
        width: 24,
        hidden_layers: 3,
        skip: Some(2),
    };
    if let StateSettings::Displacement { prior_shapes, .. } = &mut config.model.state {
        *prior_shapes = 3;
    }
    config.batch = BatchConfig {
        windows: 4,
        points: 16,
        unroll_first: 1,
        unroll_last: 3,
        unroll_grown: 0.5,
    };
    config.optimiser.steps = 10;
    config.optimiser.warmup_steps = 2;
    config.validate_every = 4;
    config.intersection.at_inference = false;
    config
}

/// Starts without noise: what is compared or differentiated is the same every time.
pub(crate) fn without_noise(mut config: TrainConfig) -> TrainConfig {
    config.regularisation.state_noise_m = 0.0;
    config.regularisation.motion_noise = 0.0;
    config
}

pub(crate) fn device() -> Device {
    Device::flex().autodiff()
}

/// Sizes and random parameters of the networks for a data set, the field's head among them.
pub(crate) fn network(data: &Dataset, seed: u64) -> (NetworkShape, Network) {
    let shape = NetworkShape::new(&data.config, data.capture.character.skeleton.len());
    let shape = NetworkShape {
        zero_head: false,
        ..shape
    };
    let network = Network::new(&shape, seed, &device());
    (shape, network)
}

/// Runs to the end without listening.
pub(crate) fn run(trainer: &mut Trainer) {
    trainer.run(None, &mut |_| Control::Continue).unwrap();
}

/// Numbers in ±scale that repeat: multiples of the golden ratio.
pub(crate) fn numbers(count: usize, scale: f32, seed: usize) -> Vec<f32> {
    let phase = |i: usize| ((i + 1000 * seed) as f64 * 0.618_033_988_749_895).fract();
    (0..count)
        .map(|i| scale * (2.0 * phase(i) - 1.0) as f32)
        .collect()
}

/// ‖a − b‖ / ‖b‖.
pub(crate) fn relative_error(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    let square = |x: f32| f64::from(x).powi(2);
    let error: f64 = a.iter().zip(b).map(|(a, b)| square(a - b)).sum();
    (error / b.iter().map(|b| square(*b)).sum::<f64>().max(f64::MIN_POSITIVE)).sqrt()
}
