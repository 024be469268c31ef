//! Steps a garment through a motion file: reads it, converts it for the model's character and
//! resamples it to the model's ticks.
//!
//! The example `embed` of `unic-core` shows an engine that has poses of its own.
//!
//! ```text
//! cargo run --release -p unic-io --example motion_file -- MODEL.unic MOTION
//! ```

use std::{error::Error, path::Path, sync::Arc, time::Instant};
use unic_core::{Animator, Model, Start, StepInput};
use unic_io::{MotionOptions, import_motion};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(model), Some(motion)) = (arguments.next(), arguments.next()) else {
        return Err("expected two arguments, MODEL.unic and MOTION".into());
    };

    // The asset: checked once, immutable, shared by any number of instances.
    let model = Arc::new(Model::from_bytes(&std::fs::read(model)?)?);

    // A tick is 1 / fps seconds of the model. A motion of another rate is resampled to that.
    let fps = model.config().fps;
    let options = MotionOptions {
        fps: Some(fps),
        ..MotionOptions::default()
    };
    let import = import_motion(Path::new(&motion), model.character(), &options)?;
    import.notes.iter().for_each(|note| println!("{note}"));
    let clip = import.clip;
    let input = |t: usize| StepInput {
        pose: &clip.poses[t],
        next_pose: clip.poses.get(t + 1),
        ground_height: clip.ground_height,
        wind: clip.wind_at(t),
    };

    // One instance: state and scratch memory.
    let mut shirt = Animator::new(Arc::clone(&model));
    shirt.reset(&input(0), Start::MeanShape)?;
    let (start, mut lowest) = (Instant::now(), f32::INFINITY);
    for t in 1..clip.len() {
        let garment = shirt.step(&input(t))?;
        // Here an engine draws `garment.positions` and `garment.normals`.
        lowest = garment.positions.iter().fold(lowest, |low, p| low.min(p.y));
    }
    let steps = clip.len() - 1;
    let ms = 1e3 * start.elapsed().as_secs_f64() / steps as f64;
    println!("{steps} steps at {fps} fps, {ms:.1} ms a step, {lowest:.2} m above the ground");
    Ok(())
}
