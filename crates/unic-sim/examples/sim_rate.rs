//! CPU time of a frame for flared skirts of several sizes on a walking pillar, by threads and with
//! and without self-contact.
//!
//! ```text
//! cargo run --release -p unic-sim --example sim_rate -- [FRAMES]
//! ```

use glam::{Quat, Vec3};
use std::{f32::consts::TAU, sync::Arc, time::Instant};
use unic_core::{
    character::Character,
    mesh::TriMesh,
    skeleton::{Pose, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use unic_sim::{
    Cloth, ClothSpec, Material, Simulation, SimulationSettings, self_contact::SelfContactSettings,
};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let frames: u32 = std::env::args().nth(1).map_or(Ok(20), |n| n.parse())?;
    println!(
        "vertices  constraints (triangles, hinges, aggregates)  build s  threads  self  wall ms  cpu ms a frame"
    );
    for (around, along) in [(76, 48), (240, 145), (312, 190), (322, 194)] {
        let skirt = tube(around, along, |t| (0.13 + 0.35 * t, 1.0 - 0.6 * t));
        let start = Instant::now();
        let pins = (0..around).collect();
        let cloth = Cloth::new(&ClothSpec {
            pins,
            ..ClothSpec::new(skirt, Material::COTTON)
        })?;
        let build = start.elapsed().as_secs_f64();
        let cloth = Arc::new(cloth);
        for (threads, own) in [(1, false), (2, false), (1, true), (2, true)] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
            let [wall, cpu] = pool.install(|| rate(&cloth, own, frames))?;
            println!(
                "{:>8}  {:>24?}  {build:>6.2}  {threads:>7}  {own:>5}  {wall:>7.1}  {cpu:>7.1}",
                cloth.vertex_count(),
                cloth.constraint_counts(),
            );
        }
    }
    Ok(())
}

/// Wall and CPU milliseconds a frame.
fn rate(cloth: &Arc<Cloth>, own: bool, frames: u32) -> Result<[f64; 2], String> {
    let settings = SimulationSettings {
        self_contact: own.then(SelfContactSettings::default),
        ..Default::default()
    };
    let failed = |e: &dyn std::fmt::Display| e.to_string();
    let character = Arc::new(pillar().map_err(|e| failed(&e))?);
    let mut simulation =
        Simulation::on_character(Arc::clone(cloth), character, settings).map_err(|e| failed(&e))?;
    let pose = |frame: u32| Pose {
        trans: Vec3::ZERO,
        local: vec![Quat::from_rotation_y(0.5 * (frame as f32 / 5.0).sin())],
    };
    let mut step = |frame| {
        simulation
            .step_frame(&pose(frame), Vec3::ZERO)
            .map(|_| ())
            .map_err(|e| failed(&e))
    };
    (1..10).try_for_each(&mut step)?;
    let (start, cpu) = (Instant::now(), cpu_seconds());
    (10..10 + frames).try_for_each(step)?;
    let scale = 1e3 / f64::from(frames);
    Ok([
        start.elapsed().as_secs_f64() * scale,
        (cpu_seconds() - cpu) * scale,
    ])
}

/// CPU time of the process, seconds; zero where the system does not tell. In ticks of 10 ms.
fn cpu_seconds() -> f64 {
    let told = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = told.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields
        .skip(11)
        .take(2)
        .filter_map(|n| n.parse::<f64>().ok())
        .sum::<f64>()
        / 100.0
}

/// A tube around the vertical: radius and height as functions of the way down, 0 to 1.
fn tube(around: u32, along: u32, shape: impl Fn(f32) -> (f32, f32)) -> TriMesh {
    let place = |i: u32| {
        let (radius, height) = shape((i / around) as f32 / (along - 1) as f32);
        let angle = TAU * (i % around) as f32 / around as f32;
        Vec3::new(radius * angle.sin(), height, radius * angle.cos())
    };
    let at = |x: u32, y: u32| y * around + x % around;
    let squares = (0..along - 1).flat_map(|y| (0..around).map(move |x| (x, y)));
    let faces = squares.flat_map(|(x, y)| {
        let [a, b, c, d] = [at(x, y), at(x, y + 1), at(x + 1, y + 1), at(x + 1, y)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh {
        vertices: (0..around * along).map(place).collect(),
        faces: faces.collect(),
        uvs: None,
    }
}

/// A leg to wear a skirt on, of some 4,000 vertices and one joint.
fn pillar() -> Result<Character, Failure> {
    let body = tube(64, 60, |t| (0.11 + 0.03 * (9.0 * t).sin(), 1.1 - 1.1 * t));
    let count = body.vertices.len();
    let parts = SkeletonParts {
        parents: vec![-1],
        joints: vec![Vec3::Y],
        ..Default::default()
    };
    Ok(Character {
        skeleton: Skeleton::new(parts)?,
        weights: SkinningWeights::from_dense(&vec![1.0; count], count, 1)?,
        body,
    })
}
