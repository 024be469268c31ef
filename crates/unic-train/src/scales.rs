//! Scales of the displacements that a model works with, measured on the training clips.

use crate::config::{ModelSettings, StateSettings};
use glam::Vec3;
use rayon::prelude::*;
use unic_core::{character::Garment, config::DisplacementConfig, features::PointFrame, prior::Prior};
use unic_eval::PreparedClip;
use unic_io::Capture;

/// Scales of a displacement state.
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

/// Largest number of pairs of successive frames that are measured.
const MOST_PAIRS: usize = 1000;

/// Smallest share of a mask that the field's reach is measured at: a vertex with less would make it
/// huge.
const LEAST_SHARE: f32 = 0.1;

/// A prior with its coefficients.
#[derive(Clone, Copy)]
pub(crate) struct PriorFit<'a> {
    /// The prior.
    pub(crate) prior: &'a Prior,
    /// Coefficients by clip and frame.
    pub(crate) coefficients: &'a [Vec<Vec<f32>>],
}

impl PriorFit<'_> {
    fn frames(&self) -> usize {
        self.coefficients.iter().map(Vec::len).sum()
    }
}

/// Measures the scales of a displacement state beside a prior. Returns none for root-relative
/// states.
pub(crate) fn measure(
    settings: &ModelSettings,
    capture: &Capture,
    clips: &[PreparedClip],
    prior: PriorFit,
) -> Option<Scales> {
    let StateSettings::Displacement {
        memory_s, ref inputs, ..
    } = settings.state
    else {
        return None;
    };
    let decay = DisplacementConfig {
        memory_s,
        excursion_m: None,
        scale_m: 1.0,
        output_limit: 1.0,
        inputs: inputs.clone(),
    }
    .decay(1.0 / capture.manifest.fps);
    let pairs = Pairs {
        garment: &capture.garment,
        clips,
        prior,
        decay,
        stride: prior.frames().div_ceil(MOST_PAIRS).max(1),
    };
    let vertices = capture.garment.rest.vertices.len();
    let by_vertex: Vec<VertexScales> = (0..vertices).into_par_iter().map(|v| pairs.measure(v)).collect();
    let variance: f64 = by_vertex.iter().map(|m| m.mean_square).sum::<f64>() / (3 * vertices).max(1) as f64;
    let scale_m = (variance.sqrt() as f32).max(LEAST_SCALE_M);
    let largest = by_vertex.iter().map(|m| m.longest_output).fold(0.0, f32::max);
    Some(Scales {
        scale_m,
        // One unit at least, so that a garment that never leaves its prior makes a model too.
        output_limit: (OUTPUT_MARGIN * largest / scale_m).max(1.0),
    })
}

/// Scales of one vertex.
struct VertexScales {
    /// Mean of |d|² over frames, m².
    mean_square: f64,
    /// Longest field output |d_t − γ d_{t−1}| that training would ask for, metres.
    longest_output: f32,
}

/// Pairs of successive frames, evenly spread over the clips.
struct Pairs<'a> {
    garment: &'a Garment,
    clips: &'a [PreparedClip],
    prior: PriorFit<'a>,
    /// Share γ of the state that is left after a frame.
    decay: f32,
    /// Frames from one pair to the next.
    stride: usize,
}

impl Pairs<'_> {
    fn measure(&self, vertex: usize) -> VertexScales {
        let (mut squares, mut count, mut largest) = (0.0, 0usize, 0.0f32);
        let share = self.garment.share(vertex).max(LEAST_SHARE);
        for (clip, coefficients) in self.clips.iter().zip(self.prior.coefficients) {
            let state = |t: usize| -> Vec3 {
                let frame = PointFrame::new(self.garment, vertex, clip.kinematics.world_from_rest(t));
                frame.blended_displacement(clip.captured.garment.frame(t)[vertex])
                    - self.prior.prior.displacement(vertex, &coefficients[t])
            };
            for t in (1..coefficients.len()).step_by(self.stride) {
                let [before, now] = [t - 1, t].map(state);
                squares += f64::from(now.length_squared());
                count += 1;
                largest = largest.max((now - before * self.decay).length() / share);
            }
        }
        VertexScales {
            mean_square: squares / count.max(1) as f64,
            longest_output: largest,
        }
    }
}
