//! Steps a garment as an engine does: the bytes of a model file and poses in, positions out.
//! docs/guides/embed.md has the same program.
//!
//! ```text
//! cargo run --release -p unic-core --example embed -- MODEL.unic GARMENT.obj
//! ```

use glam::{Quat, Vec3};
use std::{error::Error, fmt::Write, fs, sync::Arc, time::Instant};
use unic_core::{Animator, Model, Pose, Start, StepInput};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(model), Some(obj)) = (arguments.next(), arguments.next()) else {
        return Err("expected two arguments, MODEL.unic and GARMENT.obj".into());
    };

    // The asset: checked once, immutable, shared by all garments of its kind.
    let model = Arc::new(Model::from_bytes(&fs::read(model)?)?);

    // One garment in motion. It starts in its mean shape, and again after every cut of the motion.
    let mut garment = Animator::new(Arc::clone(&model));
    garment.reset(&input(&pose_at(&model, 0.0)), Start::MeanShape)?;

    // A tick is 1 / fps seconds of the model, whatever the display's rate is.
    let (fps, seconds) = (model.config().fps, 4.0);
    let ticks = (seconds * fps) as usize;
    let start = Instant::now();
    for tick in 1..=ticks {
        let frame = garment.step(&input(&pose_at(&model, tick as f32 / fps)))?;
        // An engine draws these: world positions in metres and unit normals, one a vertex.
        assert_eq!(frame.positions.len(), frame.normals.len());
    }
    let ms = 1e3 * start.elapsed().as_secs_f64() / ticks as f64;
    println!("{ticks} ticks at {fps} fps, {ms:.1} ms a tick");

    // The last frame as a mesh.
    let mut text = String::new();
    for p in garment.garment().positions {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for [a, b, c] in &model.garment().rest.faces {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1)?;
    }
    Ok(fs::write(obj, text)?)
}

/// The engine's animation: the character glides along a circle and swings its arms.
fn pose_at(model: &Model, seconds: f32) -> Pose {
    let skeleton = &model.character().skeleton;
    let mut pose = skeleton.bind_pose();
    // 1 m/s on a circle of 1 m: the root faces along the path, +Z at the start.
    let angle = seconds;
    pose.trans = Vec3::new(1.0 - angle.cos(), 0.0, angle.sin());
    pose.local[skeleton.root()] = Quat::from_rotation_y(angle);
    for (name, swing) in [("L_shoulder", 0.3), ("R_shoulder", -0.3)] {
        if let Some(joint) = skeleton.joint(name) {
            pose.local[joint] = Quat::from_rotation_x(swing * (4.0 * seconds).sin());
        }
    }
    pose
}

/// The input of one tick: the pose, flat ground at height 0, still air.
fn input(pose: &Pose) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind: Vec3::ZERO,
    }
}
