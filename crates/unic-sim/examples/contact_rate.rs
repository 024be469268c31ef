//! Prints the cost of contact: CPU milliseconds per frame on one thread, at 30 fps with 4 intervals
//! of 5 substeps.
//!
//! ```text
//! cargo run --release -p unic-sim --example contact_rate
//! ```

#![allow(clippy::unwrap_used, reason = "the example stops by panicking")]

#[path = "../tests/scene/mod.rs"]
mod scene;

use glam::{Quat, Vec3};
use scene::{SUBSTEPS, Scene, at_rest, placed, predict, sheet};
use std::path::Path;
use unic_core::{folds::Folds, mesh::TriMesh, mesh::vertex_normals, surface::Surface};
use unic_sim::{
    contact::ContactSettings,
    self_contact::{SelfContactSettings, SelfContacts},
};

const FRAMES: usize = 10;
const INTERVALS: usize = 4;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/body/character.npz");
        match unic_io::read_character(&file) {
            Ok(character) => body_contact(&character.body),
            Err(error) => eprintln!("skipped: {error}"),
        }
        for gap in [0.015, 0.004, 0.002] {
            self_contact(gap);
        }
    });
}

/// Returns the CPU time of the calling thread, milliseconds; wall time on systems without `/proc`.
fn cpu_ms() -> f64 {
    let schedstat = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = schedstat.and_then(|line| line.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.unwrap_or_else(|| {
        let since = std::time::UNIX_EPOCH.elapsed().unwrap_or_default();
        since.as_nanos() as f64
    }) * 1e-6
}

/// Measures refitting, folds and contact with a body.
fn body_contact(body: &TriMesh) {
    let mut surface = Surface::build(body);
    let mut folds = Folds::default();
    let start = cpu_ms();
    (0..FRAMES).for_each(|_| surface.refit(&body.vertices));
    let refitted = cpu_ms();
    (0..FRAMES).for_each(|_| folds.find(&surface));
    let (refit, find) = (refitted - start, cpu_ms() - refitted);
    let share = folds.faces().iter().filter(|f| **f).count() as f64 / body.faces.len() as f64;
    println!(
        "body of {} faces: refit {:.2} ms, folds {:.2} ms ({:.1} % folded)",
        body.faces.len(),
        refit / FRAMES as f64,
        find / FRAMES as f64,
        100.0 * share
    );
    for (count, clearance) in [(3_600, 0.004), (3_600, 0.05), (62_000, 0.004), (62_000, 0.05)] {
        clothed(body, count, clearance);
    }
}

/// Measures contact of `count` particles all over a body that turns at 1 rad/s and moves at 1.5
/// m/s.
fn clothed(body: &TriMesh, count: usize, clearance_m: f32) {
    let mut normals = Vec::new();
    vertex_normals(&body.vertices, &body.faces, &mut normals);
    let corner = |k: usize| body.faces[k % body.faces.len()][k / body.faces.len() % 3] as usize;
    let next = |k: usize| body.faces[k % body.faces.len()][(k / body.faces.len() + 1) % 3] as usize;
    let place = |k: usize| {
        let on_edge = body.vertices[corner(k)].lerp(body.vertices[next(k)], 0.37);
        on_edge + normals[corner(k)] * clearance_m
    };
    let mut scene = Scene::new(body, (0..count).map(place).collect(), ContactSettings::default());
    scene.gravity = Vec3::ZERO;
    scene.particles.velocities.fill(Vec3::Z * 1.5);
    let mut advance = |first: usize, frames: usize| {
        let start = cpu_ms();
        for k in first..first + frames * INTERVALS {
            let t = k as f32 / 120.0;
            scene.advance(&placed(body, Quat::from_rotation_y(t), Vec3::Z * 1.5 * t));
        }
        (cpu_ms() - start) / frames as f64
    };
    advance(1, 2);
    let frame = advance(1 + 2 * INTERVALS, FRAMES);
    println!("{count} particles {clearance_m} m from the body: {frame:.1} ms a frame");
}

/// Measures self-contact of four wavy layers of 123 × 123 squares of 1 cm, `gap` metres apart.
fn self_contact(gap: f32) {
    let layer = sheet(123, 0.01);
    let up = |layer: usize| Vec3::new(0.003 * layer as f32, gap * layer as f32, 0.002 * layer as f32);
    let first = layer.vertices.len() as u32;
    let vertices = (0..4).flat_map(|k| layer.vertices.iter().map(move |v| v + up(k)));
    let faces = (0..4).flat_map(|k| layer.faces.iter().map(move |f| f.map(|v| v + k * first)));
    let mut rest = TriMesh::new(vertices.collect(), faces.collect()).unwrap();
    let mut particles = at_rest(rest.vertices.clone());
    // At rest the layers are farther apart than they lie.
    rest.vertices.iter_mut().for_each(|v| v.y *= 10.0);
    let velocity = |v: &Vec3| Vec3::Y * 0.1 * (v.x * 20.0).sin();
    particles.velocities = rest.vertices.iter().map(velocity).collect();
    let mut contacts = SelfContacts::new(&rest, SelfContactSettings::default());
    let dt = 1.0 / (30 * INTERVALS * SUBSTEPS) as f32;
    let (mut collect, mut project) = (0.0, 0.0);
    for _ in 0..INTERVALS {
        let start = cpu_ms();
        contacts.begin_interval(&particles, SUBSTEPS as f32 * dt);
        collect += cpu_ms() - start;
        for _ in 0..SUBSTEPS {
            predict(&mut particles, Vec3::ZERO, dt);
            let start = cpu_ms();
            contacts.project(dt, &mut particles);
            project += cpu_ms() - start;
        }
    }
    println!(
        "{} vertices in layers {gap} m apart: {} pairs, {collect:.0} ms collecting and {project:.0} ms projecting a frame",
        rest.vertices.len(),
        contacts.pair_count()
    );
}
