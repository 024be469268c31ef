//! The T-shirt of the shared capture on real motion, beside Blender's own result where there is one.
//!
//! ```text
//! cargo run --release -p unic-sim --example real_motion -- [--frames N] [CLIP...]
//! ```
//! A CLIP is the name of one in the capture or of a file in `motion/locomotion`; without any, a few
//! of both. All numbers are of one thread.

use glam::Vec3;
use std::{path::PathBuf, sync::Arc, time::Instant};
use unic_core::{mesh::TriMesh, skeleton::Pose, topology::edges};
use unic_io::{Capture, MotionOptions, import_motion};
use unic_sim::{
    Cloth, ClothSpec, Material, Simulation, SimulationSettings,
    soundness::{Gauge, Soundness},
};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let data = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = data.join("captures/tshirt_blender");
    if !folder.exists() {
        eprintln!("skipped: {} is not there", folder.display());
        return Ok(());
    }
    let (limit, names) = arguments()?;
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread()
        .build_global()?;
    let capture = Capture::open(&folder)?;
    let scene = Scene::new(&capture)?;
    println!(
        "{:>16} frames  cpu ms  >1 mm %  deepest mm   p99 %  hem before/after cm",
        ""
    );
    for name in names {
        if folder.join("clips").join(format!("{name}.npz")).exists() {
            let clip = capture.load_clip(&name)?;
            let mut blender = scene.gauge(clip.clip.fps);
            for (pose, garment) in clip.clip.poses.iter().zip(clip.garment.iter()) {
                blender.push(&scene.skinned(pose), garment, scene.pelvis(pose));
            }
            print(
                &format!("{name} (B)"),
                clip.garment.len(),
                0.0,
                &blender.finish(),
                None,
            );
            scene.run(&name, &clip.clip.poses, limit)?;
        } else {
            let file = data.join("motion/locomotion").join(format!("{name}.npz"));
            let motion = import_motion(&file, &capture.character, &MotionOptions::default())?;
            scene.run(&name, &motion.clip.poses, limit)?;
        }
    }
    Ok(())
}

fn arguments() -> Result<(usize, Vec<String>), Failure> {
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    let mut limit = usize::MAX;
    if names.first().is_some_and(|n| n == "--frames") {
        limit = names.get(1).ok_or("--frames wants a number")?.parse()?;
        names.drain(..2);
    }
    if names.is_empty() {
        names = [
            "run_02_03",
            "jump_02_04",
            "dance_55_01",
            "Walk1",
            "TurnOnSpot1",
            "Run1",
        ]
        .map(String::from)
        .to_vec();
    }
    Ok((limit, names))
}

/// What all clips share.
struct Scene<'a> {
    capture: &'a Capture,
    cloth: Arc<Cloth>,
    hem: Vec<u32>,
}

impl<'a> Scene<'a> {
    fn new(capture: &'a Capture) -> Result<Self, Failure> {
        let rest = &capture.garment.rest;
        let cloth = Cloth::new(&ClothSpec::new(rest.clone(), Material::COTTON))?;
        println!(
            "{} particles, constraints {:?}",
            cloth.particle_count(),
            cloth.constraint_counts()
        );
        Ok(Self {
            capture,
            cloth: Arc::new(cloth),
            hem: hem(rest),
        })
    }

    fn gauge(&self, fps: f32) -> Gauge {
        Gauge::new(&self.capture.character, &self.capture.garment.rest, fps)
    }

    fn pelvis(&self, pose: &Pose) -> Vec3 {
        self.capture.character.skeleton.joints()[0] + pose.trans
    }

    fn skinned(&self, pose: &Pose) -> Vec<Vec3> {
        let character = &self.capture.character;
        let (mut joints, mut rest, mut vertices) = (Vec::new(), Vec::new(), Vec::new());
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut rest);
        character
            .weights
            .skin(&character.body.vertices, &rest, &mut vertices);
        vertices
    }

    /// Mean height of the hem over the pelvis, metres.
    fn hem_height(&self, garment: &[Vec3], pose: &Pose) -> f32 {
        let mean = self.hem.iter().map(|&v| garment[v as usize].y).sum::<f32>() / self.hem.len() as f32;
        mean - self.pelvis(pose).y
    }

    fn run(&self, name: &str, poses: &[Pose], limit: usize) -> Result<(), Failure> {
        let character = Arc::new(self.capture.character.clone());
        let settings = SimulationSettings::default();
        let fps = settings.fps;
        let mut simulation = Simulation::on_character(Arc::clone(&self.cloth), character, settings)?;
        let garment = simulation.settle(&poses[0], &poses[1])?;
        let mut gauge = self.gauge(fps);
        gauge.push(&self.skinned(&poses[0]), garment, self.pelvis(&poses[0]));
        let poses = &poses[..poses.len().min(limit)];
        let mut seconds = 0.0;
        for pose in &poses[1..] {
            let start = cpu_seconds();
            simulation.step_frame(pose, Vec3::ZERO)?;
            seconds += cpu_seconds() - start;
            let body = simulation.body().ok_or("no body")?;
            gauge.push(body, simulation.vertices(), self.pelvis(pose));
        }
        let hem = self.stand_before_and_after(poses)?;
        let cpu_s = seconds / (poses.len() - 1) as f64;
        print(name, poses.len(), cpu_s, &gauge.finish(), Some(hem));
        Ok(())
    }

    /// Height of the hem after standing in the bind pose before the clip, and after it.
    fn stand_before_and_after(&self, poses: &[Pose]) -> Result<[f32; 2], Failure> {
        let character = Arc::new(self.capture.character.clone());
        let settings = SimulationSettings::default();
        let mut simulation =
            Simulation::on_character(Arc::clone(&self.cloth), Arc::clone(&character), settings)?;
        let stand = |like: &Pose| {
            let mut pose = like.clone();
            pose.local[1..].clone_from_slice(&character.skeleton.bind_pose().local[1..]);
            pose
        };
        let (first, last) = (&poses[0], &poses[poses.len() - 1]);
        let standing = stand(first);
        simulation.settle(&standing, &standing)?;
        for _ in 0..30 {
            simulation.step_frame(&standing, Vec3::ZERO)?;
        }
        let before = self.hem_height(simulation.vertices(), &standing);
        for t in 1..=30 {
            simulation.step_frame(&standing.interpolate(first, t as f32 / 30.0), Vec3::ZERO)?;
        }
        for pose in &poses[1..] {
            simulation.step_frame(pose, Vec3::ZERO)?;
        }
        let standing = stand(last);
        for t in 1..=60 {
            let t = (t as f32 / 30.0).min(1.0);
            simulation.step_frame(&last.interpolate(&standing, t), Vec3::ZERO)?;
        }
        Ok([before, self.hem_height(simulation.vertices(), &standing)])
    }
}

/// The rim with the lowest mean height.
fn hem(rest: &TriMesh) -> Vec<u32> {
    let mut rims: Vec<[u32; 2]> = Vec::new();
    for &edge in &edges(&rest.faces) {
        let of_it = rest.faces.iter().filter(|f| edge.iter().all(|v| f.contains(v)));
        if of_it.count() == 1 {
            rims.push(edge);
        }
    }
    let mut loops: Vec<Vec<u32>> = Vec::new();
    for [a, b] in rims {
        let (mut with, without): (Vec<_>, Vec<_>) = loops
            .into_iter()
            .partition(|l: &Vec<u32>| l.contains(&a) || l.contains(&b));
        with.push(vec![a, b]);
        loops = without;
        loops.push(with.concat());
    }
    let height = |l: &Vec<u32>| l.iter().map(|&v| rest.vertices[v as usize].y).sum::<f32>() / l.len() as f32;
    loops
        .into_iter()
        .min_by(|a, b| height(a).total_cmp(&height(b)))
        .unwrap_or_default()
}

fn print(name: &str, frames: usize, cpu_s: f64, sound: &Soundness, hem: Option<[f32; 2]>) {
    print!(
        "{name:>16} {frames:>6} {:>7.1} {:>8.2} {:>11.1} {:>7.1}",
        cpu_s * 1e3,
        sound.inside_percent,
        sound.deepest_mm,
        sound.strain_p99_percent,
    );
    match hem {
        Some([before, after]) => println!("  {:.1} / {:.1}", before * 100.0, after * 100.0),
        None => println!(),
    }
}

/// CPU time of this thread where the system tells, else wall time.
fn cpu_seconds() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|t| t.split(' ').next().and_then(|n| n.parse::<f64>().ok()));
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    nanoseconds.map_or_else(
        || START.get_or_init(Instant::now).elapsed().as_secs_f64(),
        |n| n * 1e-9,
    )
}
