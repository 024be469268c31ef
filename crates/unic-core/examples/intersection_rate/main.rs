//! Times of the intersection handling by stage, compared with parry3d's closest points.
//!
//! ```text
//! cargo run --release -p unic-core --example intersection_rate
//! cargo run --release -p unic-core --example intersection_rate -- 62461   # one size, one thread
//! ```
//!
//! Garments of 3,790 and of 62,461 vertices are handled on a body of 13,776 triangles: the captured
//! T-shirt of `../shared/data` if it exists, else tubes. Times are medians over frames in
//! milliseconds. Column `cpu` is the CPU time of one thread, which other load hardly changes.
//! Column `two` is the wall-clock time of two threads, which is meaningful only on two idle cores.
//! `bits` is a hash of all shown positions: two programs with the same hash compute the same bytes.

mod oracle;
mod refine;
mod scene;

use cpu_time::ThreadTime;
use oracle::Oracle;
use scene::Scene;
use std::{
    hash::{DefaultHasher, Hash, Hasher},
    hint::black_box,
    time::Instant,
};
use unic_core::{
    intersection::{CollisionScene, DisplayPass, RobustBody, RobustIntersection},
    mesh::vertex_normals,
};

const MARGIN_M: f32 = 0.003;

/// Stages of the intersection handling, whose times are summed.
const HANDLING: [&str; 4] = ["pose", "contacts", "lift faces", "smooth"];

fn main() {
    match std::env::args().nth(1).map(|size| size.parse()) {
        None => [3_790, 62_461].into_iter().for_each(compare),
        Some(Ok(vertices)) => {
            let (times, bits) = measure(&Scene::new(vertices), 1);
            print(&times, None);
            println!("  {:24} {bits:016x}", "bits");
        }
        Some(Err(error)) => {
            eprintln!("the number of garment vertices: {error}");
            std::process::exit(2);
        }
    }
}

fn compare(vertices: usize) {
    let scene = Scene::new(vertices);
    println!(
        "{}: {} garment vertices, {} garment triangles, {} body triangles",
        scene.name,
        scene.garment.rest.vertices.len(),
        scene.garment.rest.faces.len(),
        scene.character.body.faces.len()
    );
    let [(cpu, bits), (two, bits_of_two)] = [1, 2].map(|threads| measure(&scene, threads));
    assert_eq!(bits, bits_of_two, "results do not depend on threads");
    print(&cpu, Some(&two));
    println!("  {:24} {bits:016x}", "bits");
    Oracle::print(&scene);
}

/// Measures the times on a number of threads, and hashes all shown positions.
fn measure(scene: &Scene, threads: usize) -> (Times, u64) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let mut times = Times::new(threads);
    let mut hasher = DefaultHasher::new();
    (pool.expect("threads")).install(|| run(scene, &mut times, &mut hasher));
    (times, hasher.finish())
}

fn run(scene: &Scene, times: &mut Times, hasher: &mut DefaultHasher) {
    let rule = RobustIntersection { margin_m: MARGIN_M };
    let character = &scene.character;
    let mut body = RobustBody::new(character, &scene.garment);
    let mut display = DisplayPass::new(rule, &scene.garment, &body);
    let (mut skinned, mut normals) = (Vec::new(), Vec::new());
    for frame in &scene.frames {
        let mut positions = frame.garment.clone();
        times.stage("skin", || {
            let weights = &character.weights;
            weights.skin(&character.body.vertices, &frame.world_from_rest, &mut skinned);
        });
        times.stage("pose", || body.pose(&frame.body));
        let collisions = CollisionScene {
            body: &body,
            vertices: &frame.body,
            colliders: &[],
            skinned: None,
        };
        times.stage("contacts", || {
            display.find_contacts(collisions, &mut positions);
            display.find_corrections(collisions);
        });
        times.stage("lift faces", || display.lift_faces(collisions));
        times.stage("smooth", || {
            display.spread_corrections(collisions, &mut positions)
        });
        times.stage("normals", || {
            vertex_normals(&positions, &scene.garment.rest.faces, &mut normals);
        });
        for position in &positions {
            position.to_array().map(f32::to_bits).hash(hasher);
        }
        black_box(&normals);
    }
}

/// Times by stage and frame, milliseconds.
struct Times {
    threads: usize,
    stages: Vec<(&'static str, Vec<f64>)>,
}

impl Times {
    fn new(threads: usize) -> Self {
        Self {
            threads,
            stages: Vec::new(),
        }
    }

    fn stage(&mut self, name: &'static str, work: impl FnOnce()) {
        let (own, clock) = (ThreadTime::now(), Instant::now());
        work();
        let elapsed = match self.threads {
            1 => own.elapsed(),
            _ => clock.elapsed(),
        };
        let ms = elapsed.as_secs_f64() * 1e3;
        match self.stages.iter_mut().find(|(n, _)| *n == name) {
            Some((_, all)) => all.push(ms),
            None => self.stages.push((name, vec![ms])),
        }
    }

    /// Median time of a stage, without the first frame, which allocates.
    fn median(&self, stage: usize) -> f64 {
        median(&self.stages[stage].1[1..])
    }
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn print(cpu: &Times, two: Option<&Times>) {
    let columns: Vec<&Times> = std::iter::once(cpu).chain(two).collect();
    let row = |name: &str, values: &[f64]| {
        let values: String = values.iter().map(|ms| format!(" {ms:8.3}")).collect();
        println!("  {name:24}{values}");
    };
    println!(
        "  {:24} {:>8} {:>8}",
        "",
        "cpu",
        if two.is_some() { "two" } else { "" }
    );
    let mut sums = vec![0.0; columns.len()];
    for (stage, (name, _)) in cpu.stages.iter().enumerate() {
        let medians: Vec<f64> = columns.iter().map(|times| times.median(stage)).collect();
        if HANDLING.contains(name) {
            sums.iter_mut().zip(&medians).for_each(|(sum, ms)| *sum += ms);
        }
        row(name, &medians);
    }
    row(&HANDLING.join(" + "), &sums);
}
