//! Simulates the T-shirt of the shared capture on captured motion and prints its quality, next to
//! that of Blender's simulation where the capture has one.
//!
//! ```text
//! cargo run --release -p unic-sim --example real_motion -- [--frames N] [CLIP...]
//! ```
//! A CLIP is the name of a clip in the capture or of a file in `motion/locomotion`. The default is
//! a selection of both. Everything runs on one thread.

use glam::Vec3;
use std::{path::PathBuf, sync::Arc, time::Instant};
use unic_core::Pose;
use unic_io::{Capture, MotionOptions, import_motion};
use unic_sim::{
    Cloth, ClothSpec, Material, Simulation, SimulationSettings,
    quality::{ClipQuality, CreepReference, QualityMeter},
    self_contact::SelfContactSettings,
};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let data = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = data.join("captures/tshirt_blender");
    if !folder.exists() {
        eprintln!("skipped: {} is not there", folder.display());
        return Ok(());
    }
    let Arguments { limit, names } = arguments()?;
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread()
        .build_global()?;
    let capture = Capture::open(&folder)?;
    let shirt = Shirt::new(&capture)?;
    println!("{:>16} frames  cpu ms  >1 mm %  deepest mm   p99 %  creep mm", "");
    for name in names {
        if folder.join("clips").join(format!("{name}.npz")).exists() {
            let clip = capture.load_clip(&name)?;
            let mut blender = shirt.meter(clip.clip.fps);
            for (pose, garment) in clip.clip.poses.iter().zip(clip.garment.iter()) {
                blender.push(&shirt.skinned(pose), garment);
            }
            print(
                &format!("{name} (B)"),
                clip.garment.len(),
                0.0,
                &blender.finish(),
                None,
            );
            shirt.run(&name, &clip.clip.poses, limit)?;
        } else {
            let file = data.join("motion/locomotion").join(format!("{name}.npz"));
            let motion = import_motion(&file, &capture.character, &MotionOptions::default())?;
            shirt.run(&name, &motion.clip.poses, limit)?;
        }
    }
    Ok(())
}

/// Default settings, with self-contact if the environment variable `SELF_CONTACT` is set. Blender's
/// simulation has none.
fn settings() -> SimulationSettings {
    let has_self_contact = std::env::var_os("SELF_CONTACT").is_some();
    SimulationSettings {
        self_contact: has_self_contact.then(SelfContactSettings::default),
        ..Default::default()
    }
}

/// Command-line arguments.
struct Arguments {
    /// Largest number of frames per clip.
    limit: usize,
    /// Names of the clips.
    names: Vec<String>,
}

fn arguments() -> Result<Arguments, Failure> {
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    let mut limit = usize::MAX;
    if names.first().is_some_and(|n| n == "--frames") {
        limit = names.get(1).ok_or("--frames needs a number")?.parse()?;
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
    Ok(Arguments { limit, names })
}

/// The garment that all clips share.
struct Shirt<'a> {
    capture: &'a Capture,
    cloth: Arc<Cloth>,
    creep: CreepReference,
}

impl<'a> Shirt<'a> {
    fn new(capture: &'a Capture) -> Result<Self, Failure> {
        let rest = &capture.garment.rest;
        let cloth = Cloth::new(&ClothSpec::new(rest.clone(), Material::COTTON))?;
        println!(
            "{} particles, constraints {:?}",
            cloth.particle_count(),
            cloth.constraint_counts()
        );
        let cloth = Arc::new(cloth);
        let character = Arc::new(capture.character.clone());
        Ok(Self {
            capture,
            creep: CreepReference::new(&cloth, &character, &settings(), || true)?.ok_or("not finished")?,
            cloth,
        })
    }

    fn meter(&self, fps: f32) -> QualityMeter {
        QualityMeter::new(&self.capture.character, &self.capture.garment.rest, fps)
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

    fn run(&self, name: &str, poses: &[Pose], limit: usize) -> Result<(), Failure> {
        let character = Arc::new(self.capture.character.clone());
        let settings = settings();
        let fps = settings.fps;
        let mut simulation = Simulation::on_character(Arc::clone(&self.cloth), character, settings)?;
        let garment = simulation.settle(&poses[0], &poses[1])?;
        let mut meter = self.meter(fps);
        meter.push(&self.skinned(&poses[0]), garment);
        let poses = &poses[..poses.len().min(limit)];
        let mut seconds = 0.0;
        for pose in &poses[1..] {
            let start = cpu_seconds();
            simulation.step_frame(pose, Vec3::ZERO)?;
            seconds += cpu_seconds() - start;
            let body = simulation.body().ok_or("no body")?;
            meter.push(body, simulation.vertices());
        }
        let (skeleton, last) = (&self.capture.character.skeleton, &poses[poses.len() - 1]);
        for pose in CreepReference::poses_to_standing(skeleton, last, fps) {
            simulation.step_frame(&pose, Vec3::ZERO)?;
        }
        let creep_mm = self.creep.creep_mm(&simulation, skeleton, last);
        let cpu_s = seconds / (poses.len() - 1) as f64;
        print(name, poses.len(), cpu_s, &meter.finish(), Some(creep_mm));
        Ok(())
    }
}

fn print(name: &str, frames: usize, cpu_s: f64, quality: &ClipQuality, creep_mm: Option<f32>) {
    print!(
        "{name:>16} {frames:>6} {:>7.1} {:>8.2} {:>11.1} {:>7.1}",
        cpu_s * 1e3,
        quality.inside_percent,
        quality.deepest_mm,
        quality.strain_p99_percent,
    );
    match creep_mm {
        Some(creep_mm) => println!(" {creep_mm:>7.1}"),
        None => println!(),
    }
}

/// Returns the CPU time of this thread, seconds; wall time on systems without `/proc`.
fn cpu_seconds() -> f64 {
    let schedstat = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = schedstat.and_then(|t| t.split(' ').next().and_then(|n| n.parse::<f64>().ok()));
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    nanoseconds.map_or_else(
        || START.get_or_init(Instant::now).elapsed().as_secs_f64(),
        |n| n * 1e-9,
    )
}
