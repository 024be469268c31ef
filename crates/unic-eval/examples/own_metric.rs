//! A metric of one's own: the mean relative error of edge lengths in free running, for a model and
//! for linear blend skinning.
//!
//! ```text
//! cargo run --release -p unic-eval --example own_metric -- CAPTURE MODEL.unic CLIP
//! ```

use glam::Vec3;
use std::{path::Path, sync::Arc};
use unic_core::{Model, topology::edges};
use unic_eval::{Mode, ModelPredictor, Predictor, PredictorError, PreparedClip, baselines::Skinning};
use unic_io::Capture;

/// Shorter true edges do not count, metres.
const LEAST_EDGE_M: f32 = 1e-6;

fn main() -> Result<(), PredictorError> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [capture, model, clip] = arguments.as_slice() else {
        return Err("usage: own_metric CAPTURE MODEL.unic CLIP".into());
    };
    let capture = Capture::open(Path::new(capture))?;
    let model = Arc::new(Model::from_bytes(&std::fs::read(model)?)?);
    let captured = capture.load_clip(clip)?;
    let clip = PreparedClip::new(&model.config().motion, &capture.character.skeleton, captured);

    let edges = edges(&capture.garment.rest.faces);
    let metric = |predicted: &[Vec3], truth: &[Vec3]| edge_length_error(&edges, predicted, truth);
    let mut skinning = Skinning::rest(&Arc::new(capture.garment.clone()));
    let model = measure(&mut ModelPredictor::new(model), &clip, &metric)?;
    let skinning = measure(&mut skinning, &clip, &metric)?;

    println!("| second | model, % | skinning, % |\n|---|---|---|");
    let frames_per_second = (capture.manifest.fps.round() as usize).max(1);
    let seconds = model
        .chunks(frames_per_second)
        .zip(skinning.chunks(frames_per_second));
    for (second, (model, skinning)) in seconds.enumerate() {
        println!(
            "| {} | {:.2} | {:.2} |",
            second + 1,
            percent(model),
            percent(skinning)
        );
    }
    println!("| all | {:.2} | {:.2} |", percent(&model), percent(&skinning));
    Ok(())
}

/// Runs a predictor freely over a clip. Returns the metric of each frame from frame 1 on.
///
/// Frame 0 of the true garment is given, and every other frame is predicted from the one before.
fn measure(
    predictor: &mut dyn Predictor,
    clip: &PreparedClip,
    metric: &dyn Fn(&[Vec3], &[Vec3]) -> f64,
) -> Result<Vec<f64>, PredictorError> {
    predictor.start(clip, Mode::FreeRunning)?;
    let mut positions = Vec::new();
    let mut values = Vec::new();
    for frame in 1..clip.len() {
        predictor.predict(clip, frame, &mut positions)?;
        values.push(metric(&positions, clip.captured.garment.frame(frame)));
    }
    Ok(values)
}

/// Returns the mean of |l − l_true| / l_true over the edges.
fn edge_length_error(edges: &[[u32; 2]], predicted: &[Vec3], truth: &[Vec3]) -> f64 {
    let length = |at: &[Vec3], [a, b]: [u32; 2]| at[a as usize].distance(at[b as usize]);
    let errors = edges.iter().filter_map(|&edge| {
        let (found, expected) = (length(predicted, edge), length(truth, edge));
        (expected > LEAST_EDGE_M).then(|| f64::from((found - expected).abs() / expected))
    });
    mean(&errors.collect::<Vec<_>>())
}

fn percent(shares: &[f64]) -> f64 {
    100.0 * mean(shares)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
