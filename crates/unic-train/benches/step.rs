//! One training step of the presets on garments of the sizes that the field publishes, at the end
//! of a run, where windows are longest: gather, forward, backward, update.
//!
//! ```text
//! cargo bench -p unic-train --bench step
//! ```
//!
//! The captures are synthetic: a skirt of exactly so many vertices that swings after a walker of 24
//! joints. Both presets roll out a subset of the vertices, so that a step costs nearly the same at
//! all sizes; what grows with the garment is opening the capture, which is not measured here.
//! Threads are those of rayon: `RAYON_NUM_THREADS`.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the run")]

use divan::{Bencher, counter::ItemsCount};
use glam::{Quat, Vec3};
use std::{f32::consts::TAU, time::Instant};
use unic_core::{
    Pose,
    character::{Character, Garment},
    clip::Clip,
    mesh::TriMesh,
    skeleton::{SMPL_JOINT_NAMES, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use unic_io::Split;
use unic_testdata::{Figure, Take, capture};
use unic_train::{Control, Event, FieldData, Fit, Outcome, Preset, TrainConfig, Trainer};

/// Vertices of the four garments of the paper.
const VERTICES: [usize; 4] = [3_653, 34_907, 59_380, 62_461];

/// Longest step that is measured repeatedly, in seconds. A longer one is timed once and printed.
const LONGEST_STEP: f64 = 60.0;

/// Frames of a clip: room for the longest window of the presets.
const FRAMES: usize = 32;
const FPS: f32 = 30.0;

fn main() {
    divan::main();
}

#[divan::bench(args = VERTICES, sample_count = 5, sample_size = 1)]
fn standard(bencher: Bencher, vertices: usize) {
    step(bencher, Preset::Standard, vertices);
}

#[divan::bench(args = VERTICES, sample_count = 5, sample_size = 1)]
fn paper(bencher: Bencher, vertices: usize) {
    step(bencher, Preset::Paper, vertices);
}

fn step(bencher: Bencher, preset: Preset, vertices: usize) {
    let mut config = TrainConfig::preset(preset);
    config.batch.unroll_first = config.batch.unroll_last;
    config.validation.every = u64::MAX;
    let splits = [Split::Train, Split::Train, Split::Validation];
    let takes: Vec<(Take, Split)> = (0..)
        .zip(splits)
        .map(|(i, split)| (take(i, vertices), split))
        .collect();
    let (_folder, capture) = capture(&figure(vertices), &takes);
    let data = FieldData::prepare(capture, &config, Fit::HeldOut).unwrap();
    let mut trainer = Trainer::new(data, config.clone()).unwrap();
    let mut step = || {
        let stop = |event: &Event| match event {
            Event::Step { .. } => Control::Stop,
            _ => Control::Continue,
        };
        let outcome = trainer.run(None, &mut { stop }).unwrap();
        assert_eq!(outcome, Outcome::Stopped);
    };
    let start = Instant::now();
    step();
    let seconds = start.elapsed().as_secs_f64();
    if seconds > LONGEST_STEP {
        println!("skipped: a step of {preset:?} at {vertices} vertices takes {seconds:.0} s");
        return;
    }
    let batch = &config.batch;
    let points = batch.windows * batch.points.min(vertices) * batch.unroll_last;
    bencher.counter(ItemsCount::new(points)).bench_local(step);
}

/// SMPL's tree with plain proportions: metres, T-pose.
const JOINTS: [(i64, [f32; 3]); 24] = [
    (-1, [0.0, 0.97, 0.0]),
    (0, [0.09, 0.90, 0.0]),
    (0, [-0.09, 0.90, 0.0]),
    (0, [0.0, 1.08, 0.0]),
    (1, [0.10, 0.49, 0.0]),
    (2, [-0.10, 0.49, 0.0]),
    (3, [0.0, 1.20, 0.0]),
    (4, [0.10, 0.08, 0.0]),
    (5, [-0.10, 0.08, 0.0]),
    (6, [0.0, 1.28, 0.0]),
    (7, [0.11, 0.02, 0.12]),
    (8, [-0.11, 0.02, 0.12]),
    (9, [0.0, 1.48, 0.0]),
    (9, [0.05, 1.40, 0.0]),
    (9, [-0.05, 1.40, 0.0]),
    (12, [0.0, 1.57, 0.0]),
    (13, [0.18, 1.42, 0.0]),
    (14, [-0.18, 1.42, 0.0]),
    (16, [0.45, 1.42, 0.0]),
    (17, [-0.45, 1.42, 0.0]),
    (18, [0.71, 1.42, 0.0]),
    (19, [-0.71, 1.42, 0.0]),
    (20, [0.80, 1.41, 0.0]),
    (21, [-0.80, 1.41, 0.0]),
];

/// A column of SMPL's size for a body, a skirt of exactly so many vertices.
fn figure(vertices: usize) -> Figure {
    let body = tube(6_890, 60, 0.15, 0.0..1.6);
    let sides = (vertices as f32 * 3.0).sqrt() as usize;
    let rest = tube(vertices, sides, 0.25, 0.45..1.0);
    let skeleton = Skeleton::new(SkeletonParts {
        names: SMPL_JOINT_NAMES.map(String::from).to_vec(),
        parents: JOINTS.map(|(parent, _)| parent).to_vec(),
        joints: JOINTS.map(|(_, place)| Vec3::from_array(place)).to_vec(),
        ..SkeletonParts::default()
    });
    Figure {
        character: Character {
            weights: weights(&body),
            body,
            skeleton: skeleton.unwrap(),
            file_mesh: None,
        },
        garment: {
            let weights = weights(&rest);
            Garment::new(rest, weights)
        },
        contact_joints: [7, 10, 8, 11],
    }
}

/// Skinning weights that shift from the pelvis to the thigh of a vertex's side with falling height.
fn weights(mesh: &TriMesh) -> SkinningWeights {
    let row = |v: &Vec3| {
        let thigh = ((1.0 - v.y) / 0.5).clamp(0.0, 0.8);
        let left = (0.5 + 2.0 * v.x).clamp(0.0, 1.0);
        [(0, 1.0 - thigh), (1, thigh * left), (2, thigh * (1.0 - left))].into_iter()
    };
    SkinningWeights::from_rows(JOINTS.len(), mesh.vertices.iter().map(row)).unwrap()
}

/// Rings of squares from the bottom up; the last ring ends where the vertices do.
fn tube(vertices: usize, sides: usize, radius: f32, heights: std::ops::Range<f32>) -> TriMesh {
    let rings = (vertices / sides) as f32;
    let place = |i: usize| {
        let (sine, cosine) = (TAU * (i % sides) as f32 / sides as f32).sin_cos();
        let up = (i / sides) as f32 / rings * (heights.end - heights.start);
        Vec3::new(radius * sine, heights.start + up, radius * cosine)
    };
    let square = |i: usize| {
        let next = i / sides * sides + (i + 1) % sides;
        let [a, b, c, d] = [i - sides, next - sides, next, i].map(|v| v as u32);
        (next < vertices).then_some([[a, b, c], [a, c, d]])
    };
    let faces = (sides..vertices).filter_map(square).flatten();
    TriMesh::new((0..vertices).map(place).collect(), faces.collect()).unwrap()
}

/// A walk in a bow; the skirt's hem lags behind.
fn take(seed: usize, vertices: usize) -> Take {
    let phase = |t: usize| (t + 11 * seed) as f32 / FPS;
    let pose = |t: usize| {
        let s = phase(t);
        let mut local = vec![Quat::IDENTITY; JOINTS.len()];
        local[0] = Quat::from_rotation_y(0.5 * s.sin());
        let swing = 0.5 * (TAU * s).sin();
        (local[1], local[2]) = (Quat::from_rotation_x(swing), Quat::from_rotation_x(-swing));
        Pose {
            trans: Vec3::Z * s,
            local,
        }
    };
    let clip = Clip {
        name: format!("walk{seed}"),
        fps: FPS,
        poses: (0..FRAMES).map(pose).collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    };
    let figure = figure(vertices);
    let mut garment = figure.skinned(&clip);
    for (t, positions) in garment.iter_mut().enumerate() {
        let lag = 0.1 * (TAU * phase(t) - 0.5).sin();
        for (position, rest) in positions.iter_mut().zip(&figure.garment.rest.vertices) {
            position.x += lag * (1.0 - rest.y);
        }
    }
    Take { clip, garment }
}
