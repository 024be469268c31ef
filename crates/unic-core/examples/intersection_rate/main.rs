//! What it costs to keep a garment out of a body, by stage, beside parry3d's closest points.
//!
//! ```text
//! cargo run --release -p unic-core --example intersection_rate
//! cargo run --release -p unic-core --example intersection_rate -- 62461   # one size, one thread, nothing beside
//! ```
//!
//! A garment of 3,790 and of 62,461 vertices on a body of 13,776 triangles: the captured T-shirt of
//! `../shared/data` where it is there, else tubes. Milliseconds, medians over frames: `cpu` is what one
//! thread ran itself, whatever else the machine does; `two` the clock's for two threads, which means
//! little unless two cores are idle. `bits` tells whether two programs, built by one compiler, show the same
//! to the last bit.

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
    intersection::{DisplayPass, PosedVertices, RobustBody, RobustIntersection},
    mesh::vertex_normals,
};

const MARGIN_M: f32 = 0.003;
const HANDLING: [&str; 4] = ["pose", "look", "cover", "smooth"];

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
    assert_eq!(bits, bits_of_two, "threads change nothing");
    print(&cpu, Some(&two));
    println!("  {:24} {bits:016x}", "bits");
    Oracle::print(&scene);
}

/// Times on so many threads, and a hash of all positions that are shown.
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
        let posed = PosedVertices {
            body: &body,
            vertices: &frame.body,
            colliders: &[],
        };
        times.stage("look", || display.look(posed, &positions));
        times.stage("cover", || display.cover(posed));
        times.stage("smooth", || display.smooth(posed, &mut positions));
        times.stage("normals", || {
            vertex_normals(&positions, &scene.garment.rest.faces, &mut normals);
        });
        for position in &positions {
            position.to_array().map(f32::to_bits).hash(hasher);
        }
        black_box(&normals);
    }
}

/// Milliseconds by stage and frame.
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

    /// Without the first frame, which allocates.
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
