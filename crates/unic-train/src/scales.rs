//! The size of the displacements that a model is to work with.

use crate::config::{ModelSettings, StateSettings};
use glam::Vec3;
use rayon::prelude::*;
use unic_core::{character::Garment, config::DisplacementConfig, features::PointFrame, prior::Prior};
use unic_eval::PreparedClip;
use unic_io::Capture;

/// What a displacement state needs to know of the training frames.
pub(crate) struct Scales {
    /// Root mean square of a coordinate of the state, metres.
    pub(crate) scale_m: f32,
    /// Longest field output that training asks for and a margin, in units of `scale_m`.
    pub(crate) output_limit: f32,
}

/// Share by which a field output may exceed the largest one of training.
const OUTPUT_MARGIN: f32 = 1.25;

/// Scales below a tenth of a millimetre would blow rounding up to the size of folds, metres.
const LEAST_SCALE_M: f32 = 1e-4;

/// Pairs of successive frames that are looked at, at most and evenly spread.
const MOST_PAIRS: usize = 1000;

/// Vertices of which a mask leaves less do not decide how far the field reaches.
const LEAST_SHARE: f32 = 0.1;

/// None for states that are positions. The prior comes with its coefficients by clip and frame.
pub(crate) fn measure(
    settings: &ModelSettings,
    capture: &Capture,
    clips: &[PreparedClip],
    (prior, coefficients): (&Prior, &[Vec<Vec<f32>>]),
) -> Option<Scales> {
    let StateSettings::Displacement {
        memory_s, ref inputs, ..
    } = settings.state
    else {
        return None;
    };
    let decay = DisplacementConfig {
        memory_s,
        scale_m: 1.0,
        output_limit: 1.0,
        inputs: inputs.clone(),
    }
    .decay(1.0 / capture.manifest.fps);
    let frames: usize = coefficients.iter().map(Vec::len).sum();
    let stride = frames.div_ceil(MOST_PAIRS).max(1);
    let vertices = capture.garment.rest.vertices.len();
    let by_vertex: Vec<(f64, f32)> = (0..vertices)
        .into_par_iter()
        .map(|v| measure_vertex(&capture.garment, clips, (prior, coefficients), v, (decay, stride)))
        .collect();
    let variance: f64 = by_vertex.iter().map(|m| m.0).sum::<f64>() / (3 * vertices).max(1) as f64;
    let scale_m = (variance.sqrt() as f32).max(LEAST_SCALE_M);
    let largest = by_vertex.iter().map(|m| m.1).fold(0.0, f32::max);
    Some(Scales {
        scale_m,
        // One unit at least, so that a garment that never leaves its prior makes a model too.
        output_limit: (OUTPUT_MARGIN * largest / scale_m).max(1.0),
    })
}

/// Mean squared state |d|² of a vertex, and the longest field output |d_t − γ d_{t−1}| that
/// training would ask for.
fn measure_vertex(
    garment: &Garment,
    clips: &[PreparedClip],
    (prior, coefficients): (&Prior, &[Vec<Vec<f32>>]),
    vertex: usize,
    (decay, stride): (f32, usize),
) -> (f64, f32) {
    let (mut squares, mut count, mut largest) = (0.0, 0usize, 0.0f32);
    for (clip, coefficients) in clips.iter().zip(coefficients) {
        let state = |t: usize| -> Vec3 {
            let frame = PointFrame::new(garment, vertex, clip.kinematics.world_from_rest(t));
            frame.blended_displacement(clip.captured.garment.frame(t)[vertex])
                - prior.displacement(vertex, &coefficients[t])
        };
        let share = garment.share(vertex).max(LEAST_SHARE);
        for t in (1..coefficients.len()).step_by(stride) {
            let [before, now] = [t - 1, t].map(state);
            squares += f64::from(now.length_squared());
            count += 1;
            largest = largest.max((now - before * decay).length() / share);
        }
    }
    (squares / count.max(1) as f64, largest)
}
