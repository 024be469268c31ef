//! Effect of each way of handling intersections on a free-running model: vertices and triangles
//! that cut into the body, error and jitter.
//!
//! ```text
//! cargo run --release -p unic-eval --example intersection_quality -- CAPTURE MODEL FRAMES CLIP...
//! ```
//!
//! | column | meaning |
//! |---|---|
//! | RMSE | error against the ground truth, mm |
//! | to it | error against the ground truth after the corrections of `display`, mm |
//! | jitter | RMS second difference over time, mm |
//! | inside | vertices inside by the closest triangle, outside the body's folds |
//! | folded | vertices inside by the closest triangle, in the body's folds |
//! | paper | vertices inside by the paper's test |
//! | open | vertices inside by the paper's test, outside the body's folds |
//! | crossings | edges of the garment through triangles of the body or the reverse, in a frame |
//! | pushing | crossings with parts that may push the garment there (not a hand in front of it) |
//! | convex | crossings farther than 5 cm from any concave edge of the body |
//! | collapsed | vertices that share their place with another one, but not in the rest shape |
//! | mask | share of the skin in folds (`unic_core::folds`), interpolated over faces |
//! | ms | median time of a frame |
//!
//! Rows: `truth`, `corrected` (the ground truth after the corrections of `display`), and the model
//! without handling, with the paper's, and with robust handling that corrects the display or the
//! state.

mod crossings;
mod measure;

use measure::{Corrected, Measure, posed};
use std::{path::Path, sync::Arc, time::Instant};
use unic_core::{Animator, Corrects, IntersectionMode, Model, Start, StepInput};
use unic_io::{Capture, CapturedClip};

type Anything<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Anything<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [capture, model, frames, clips @ ..] = arguments.as_slice() else {
        return Err("usage: intersection_quality CAPTURE MODEL FRAMES CLIP...".into());
    };
    let capture = Capture::open(Path::new(capture))?;
    let model = Arc::new(Model::from_bytes(&std::fs::read(model)?)?);
    let frames: usize = frames.parse()?;
    println!(
        "{:14} {:>8} {:>8} {:>8} {:>10} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>9} {:>9}",
        "",
        "RMSE mm",
        "to it",
        "jitter",
        "inside %",
        "folded %",
        "paper %",
        "open %",
        "crossings",
        "pushing",
        "convex",
        "collapsed",
        "mask %",
        "ms"
    );
    for name in clips {
        let clip = capture.load_clip(name)?;
        println!("{name}");
        let mut corrected = Corrected::new(&capture);
        for (name, is_corrected) in [("truth", false), ("corrected", true)] {
            let mut measure = Measure::new(&capture, &clip);
            for frame in 1..frames.min(clip.clip.len()) {
                let captured = clip.garment.frame(frame);
                let body = posed(&capture, &clip, frame);
                let shown = if is_corrected {
                    corrected.of(&body, captured)
                } else {
                    captured
                };
                measure.add(frame, shown, 0.0);
            }
            measure.print(name);
        }
        let robust = |corrects| IntersectionMode::Robust {
            margin_m: IntersectionMode::MARGIN_M,
            corrects,
        };
        for (name, mode) in [
            ("off", IntersectionMode::Off),
            ("paper", IntersectionMode::Paper { relaxation_m: 0.005 }),
            ("display", robust(Corrects::Display)),
            ("state", robust(Corrects::State)),
        ] {
            run(&capture, &clip, frames, name, &model, mode)?;
        }
    }
    Ok(())
}

/// Runs a model freely with one way of handling and prints its row.
fn run(
    capture: &Capture,
    clip: &CapturedClip,
    frames: usize,
    name: &str,
    model: &Arc<Model>,
    mode: IntersectionMode,
) -> Anything<()> {
    let mut animator = Animator::new(model.clone());
    animator.set_intersection(mode);
    let input = |t: usize| StepInput::of_clip(&clip.clip, t);
    animator.reset(&input(0), Start::Positions(clip.garment.frame(0)))?;
    let mut measure = Measure::new(capture, clip);
    for frame in 1..frames.min(clip.clip.len()) {
        let start = Instant::now();
        let shown = animator.step(&input(frame))?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        measure.add(frame, shown.positions, ms);
    }
    measure.print(name);
    Ok(())
}
