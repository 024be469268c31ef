//! Time of one simulated frame, for a straight skirt with as many vertices as each garment of the
//! published method. The built-in human walks on the spot from the bind pose.
//!
//! ```text
//! cargo bench -p unic-sim --bench step
//! ```
//!
//! Each sample is another frame of the same walk. The fastest and the slowest sample therefore
//! differ by the motion of the cloth as well as by the machine. `RAYON_NUM_THREADS` sets the number
//! of threads.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the run")]

use divan::{Bencher, counter::ItemsCount};
use glam::{Quat, Vec3};
use std::{f32::consts::TAU, sync::Arc};
use unic_builtin::human::human;
use unic_core::{Pose, character::Character, mesh::TriMesh, surface::Surface};
use unic_sim::{
    Attachment, Cloth, ClothSpec, Material, Simulation, SimulationSettings, self_contact::SelfContactSettings,
};

/// Numbers of vertices of the four garments of the paper.
const VERTICES: [usize; 4] = [3_653, 34_907, 59_380, 62_461];

/// Radius of the skirt, metres: wider than the hips.
const RADIUS: f32 = 0.24;
/// Length of the skirt, metres: from the waist to the knees.
const LENGTH: f32 = 0.55;
/// Height of the waist over the hip joints, metres. The first ring of vertices is attached there.
const WAIST: f32 = 0.12;

/// Frames before the first sample, after which the legs are in contact with the cloth.
const FRAMES_BEFORE: usize = 6;

fn main() {
    divan::main();
}

#[divan::bench(args = VERTICES, sample_count = 5, sample_size = 1)]
fn frame(bencher: Bencher, vertices: usize) {
    measure(bencher, vertices, |cloth| {
        Some(SelfContactSettings {
            thickness_m: cloth.material().thickness,
            ..Default::default()
        })
    });
}

#[divan::bench(args = VERTICES, sample_count = 5, sample_size = 1)]
fn frame_without_self_contact(bencher: Bencher, vertices: usize) {
    measure(bencher, vertices, |_| None);
}

/// Preparation of a garment: order of the particles, colouring of the constraints, long-range
/// limits.
#[divan::bench(args = VERTICES, sample_count = 1, sample_size = 1)]
fn build_cloth(bencher: Bencher, vertices: usize) {
    let spec = spec(&human(&Default::default()).unwrap(), vertices);
    bencher.bench_local(|| Cloth::new(&spec).unwrap());
}

fn measure(bencher: Bencher, vertices: usize, self_contact: impl Fn(&Cloth) -> Option<SelfContactSettings>) {
    let character = Arc::new(human(&Default::default()).unwrap());
    let cloth = Arc::new(Cloth::new(&spec(&character, vertices)).unwrap());
    assert_eq!(cloth.vertex_count(), vertices);
    let settings = SimulationSettings {
        self_contact: self_contact(&cloth),
        ..Default::default()
    };
    let mut simulation = Simulation::on_character(cloth, Arc::clone(&character), settings).unwrap();
    let mut frame = 0;
    let mut step = || {
        frame += 1;
        simulation
            .step_frame(&walking(&character, frame), Vec3::ZERO)
            .unwrap()[0]
    };
    for _ in 0..FRAMES_BEFORE {
        step();
    }
    bencher.counter(ItemsCount::new(vertices)).bench_local(step);
}

/// Pose of a walk on the spot with two steps a second; frame 0 is the bind pose.
fn walking(character: &Character, frame: usize) -> Pose {
    let mut pose = character.skeleton.bind_pose();
    let swing = 0.6 * (TAU * frame as f32 / 30.0).sin();
    let [left, right] = ["L_hip", "R_hip"].map(|name| character.skeleton.joint(name).unwrap());
    pose.local[left] = Quat::from_rotation_x(swing) * pose.local[left];
    pose.local[right] = Quat::from_rotation_x(-swing) * pose.local[right];
    pose
}

/// A skirt whose first ring of vertices is attached to the body.
fn spec(character: &Character, vertices: usize) -> ClothSpec {
    let hip = character.skeleton.joint("L_hip").unwrap();
    let top = character.skeleton.joints()[hip].y + WAIST;
    let sides = (vertices as f32 * TAU * RADIUS / LENGTH).sqrt().round() as usize;
    let mesh = tube(vertices, sides, top);
    let (body, surface) = (&character.body, Surface::build(&character.body));
    let attached = (0..sides as u32)
        .filter_map(|v| Attachment::to_nearest(v, mesh.vertices[v as usize], body, &surface));
    ClothSpec {
        attachments: attached.collect(),
        ..ClothSpec::new(mesh, Material::COTTON)
    }
}

/// A tube of squares, ring by ring from `top` metres down, with exactly `vertices` vertices. The
/// last ring may be incomplete.
fn tube(vertices: usize, sides: usize, top: f32) -> TriMesh {
    let rings = (vertices / sides) as f32;
    let place = |i: usize| {
        let (sine, cosine) = (TAU * (i % sides) as f32 / sides as f32).sin_cos();
        let down = (i / sides) as f32 / rings * LENGTH;
        Vec3::new(RADIUS * sine, top - down, RADIUS * cosine)
    };
    let square = |i: usize| {
        let next = i / sides * sides + (i + 1) % sides;
        let [a, b, c, d] = [i - sides, next - sides, next, i].map(|v| v as u32);
        (next < vertices).then_some([[a, d, c], [a, c, b]])
    };
    let faces = (sides..vertices).filter_map(square).flatten();
    TriMesh::new((0..vertices).map(place).collect(), faces.collect()).unwrap()
}
