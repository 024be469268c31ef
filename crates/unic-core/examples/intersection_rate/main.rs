//! What it costs to keep a garment out of a body, by stage, beside parry3d's closest points.
//!
//! ```text
//! cargo run --release -p unic-core --example intersection_rate
//! ```
//!
//! A garment of 3,790 and of 62,461 vertices on a body of 13,776 triangles: the captured T-shirt of
//! `../shared/data` where it is there, else tubes. Milliseconds, medians over frames: `cpu` is what one
//! thread ran itself, whatever else the machine does; `two` the clock's for two threads, which means
//! little unless two cores are idle.

mod oracle;
mod refine;
mod scene;

use cpu_time::ThreadTime;
use glam::Vec3;
use oracle::Oracle;
use scene::Scene;
use std::{hint::black_box, time::Instant};
use unic_core::{
    intersection::{DisplayPass, PosedVertices, RobustBody, RobustIntersection},
    mesh::vertex_normals,
};

const MARGIN_M: f32 = 0.003;
const HANDLING: [&str; 4] = ["pose", "look", "cover", "smooth"];

fn main() {
    for vertices in [3_790, 62_461] {
        let scene = Scene::new(vertices);
        println!(
            "{}: {} garment vertices, {} garment triangles, {} body triangles",
            scene.name,
            scene.garment.rest.vertices.len(),
            scene.garment.rest.faces.len(),
            scene.character.body.faces.len()
        );
        let [cpu, two] = [1, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let mut times = Times::new(threads);
            pool.expect("threads").install(|| run(&scene, &mut times));
            times
        });
        print(&cpu, &two);
        Oracle::print(&scene);
    }
}

fn run(scene: &Scene, times: &mut Times) {
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
        black_box(positions.iter().copied().sum::<Vec3>());
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

fn print(cpu: &Times, two: &Times) {
    println!("  {:24} {:>8} {:>8}", "", "cpu", "two");
    let mut sums = [0.0; 2];
    for (stage, (name, _)) in cpu.stages.iter().enumerate() {
        let medians = [cpu, two].map(|times| times.median(stage));
        if HANDLING.contains(name) {
            sums.iter_mut().zip(medians).for_each(|(sum, ms)| *sum += ms);
        }
        println!("  {name:24} {:8.3} {:8.3}", medians[0], medians[1]);
    }
    println!("  {:24} {:8.3} {:8.3}", HANDLING.join(" + "), sums[0], sums[1]);
}
