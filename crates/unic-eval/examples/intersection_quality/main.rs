//! What the ways of handling intersections do to a free-running model: vertices and triangles that cut
//! into the body, and what that costs in error and jitter.
//!
//! ```text
//! cargo run --release -p unic-eval --example intersection_quality -- CAPTURE MODEL FRAMES CLIP...
//! ```
//!
//! Inside is by the closest triangle, outside the folds of the body (`unic_core::folds`, interpolated between the
//! corners of faces), whose share of the skin is `mask`. A crossing is an edge of the garment through a triangle of the
//! body or the reverse; `pushing` are those by parts that may push the garment there (not by a hand in front of it),
//! `convex` those farther than 5 cm from any concave edge of the body. `paper` is the paper's indicator, `open` the same
//! outside the folds. `state` and `display` say what robust handling corrects; `corrected` is the ground truth after
//! the corrections of `display`, and `to it` the error of the others against that.

mod crossings;
mod measure;

use measure::{Corrected, Measure, posed};
use std::{path::Path, sync::Arc, time::Instant};
use unic_core::{
    animator::{Animator, Start, StepInput},
    config::{Corrects, IntersectionMode},
    model::Model,
};
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
        for (name, shows) in [("truth", false), ("corrected", true)] {
            let mut measure = Measure::new(&capture, &clip);
            for frame in 1..frames.min(clip.clip.len()) {
                let captured = clip.garment.frame(frame);
                let body = posed(&capture, &clip, frame);
                let shown = if shows {
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
