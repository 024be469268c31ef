//! Fits the linear part of a model to the training clips.

use crate::{dataset::MotionVectors, mirror::View};
use glam::Vec3;
use rayon::prelude::*;
use unic_core::{features::PointFrame, network::Linear, prior::LinearPrior};
use unic_eval::{Displacements, LinearMap, Moments, PrincipalComponents, TrainingSet};

/// A prior, and its coefficients in every training frame as a prior would give them that has never
/// seen the clip: what the field has to add in training is then as large as on a new motion.
pub struct FittedPrior {
    /// For the model: fitted on all training clips.
    pub prior: LinearPrior,
    /// By clip and frame, K numbers each.
    pub left_out: Vec<Vec<Vec<f32>>>,
}

/// Frames that the shapes are computed from at most, evenly spread.
const MOST_FRAMES: usize = 2000;

/// Pieces that a lone clip is cut into, to leave out one at a time.
const PIECES: usize = 4;

/// Ridge strengths to choose from, in units of an input's variance.
const STRENGTHS: [f64; 9] = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0];

/// Fits `shapes` principal components of the displacement and a ridge regression to them; the
/// strength is the best one for clips left out.
pub fn fit_prior(set: &TrainingSet, motion: &[MotionVectors], shapes: usize) -> FittedPrior {
    let frames = set.spread_frames(MOST_FRAMES);
    let components = PrincipalComponents::fit(&Displacements { set, frames }, shapes);
    let clips: Vec<Series> = (0..set.train.len())
        .map(|clip| Series::new(set, clip, &motion[clip], &components))
        .collect();
    let series = match clips.as_slice() {
        [only] => only.cut(PIECES),
        _ => clips,
    };
    let moments: Vec<Moments> = series.iter().map(Series::moments).collect();
    let pooled = |left_out: Option<usize>| {
        let kept = moments
            .iter()
            .enumerate()
            .filter(|(clip, _)| Some(*clip) != left_out);
        Moments::pooled(kept.map(|(_, m)| m))
    };
    let folds: Vec<Option<Moments>> = (0..series.len()).map(|clip| pooled(Some(clip))).collect();
    let maps = |strength: f64| -> Vec<Option<LinearMap>> {
        folds
            .par_iter()
            .map(|m| m.as_ref().and_then(|m| m.solve(strength)))
            .collect()
    };
    let error = |strength: f64| -> f64 {
        series
            .iter()
            .zip(maps(strength))
            .map(|(s, m)| s.error(m.as_ref()))
            .sum()
    };
    let errors = STRENGTHS.map(|strength| (error(strength), strength));
    let strength = errors
        .into_iter()
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(STRENGTHS[4], |best| best.1);
    let mut left_out: Vec<Vec<Vec<f32>>> = (series.iter().zip(maps(strength)))
        .map(|(s, map)| s.coefficients(map.as_ref()))
        .collect();
    if set.train.len() == 1 {
        left_out = vec![left_out.concat()];
    }
    let inputs = 2 * motion.first().map_or(0, |m| m.len);
    let map = pooled(None).and_then(|m| m.solve(strength));
    FittedPrior {
        prior: linear_prior(&components, map.as_ref(), inputs),
        left_out,
    }
}

/// One clip: normalised pairs of motion vectors and components of the true displacement.
struct Series {
    /// Of frames 0, 1, ...: 2 D numbers each; frame 0 is paired with itself.
    inputs: Vec<Vec<f64>>,
    /// Of frames 0, 1, ...: K numbers each.
    components: Vec<Vec<f64>>,
}

impl Series {
    /// Consecutive pieces, `count` at most.
    fn cut(&self, count: usize) -> Vec<Self> {
        let frames = self.inputs.len().div_ceil(count).max(1);
        let pieces = self.inputs.chunks(frames).zip(self.components.chunks(frames));
        pieces
            .map(|(inputs, components)| Self {
                inputs: inputs.to_vec(),
                components: components.to_vec(),
            })
            .collect()
    }

    fn new(set: &TrainingSet, clip: usize, motion: &MotionVectors, components: &PrincipalComponents) -> Self {
        let prepared = &set.train[clip];
        let pair = |t: usize| {
            let both = [t.saturating_sub(1), t].map(|t| motion.frame(t, View::Direct));
            both.concat().into_iter().map(f64::from).collect()
        };
        let project = |t: usize| {
            let world_from_rest = prepared.kinematics.world_from_rest(t);
            let garment = prepared.captured.garment.frame(t).iter().enumerate();
            let sample: Vec<f32> = garment
                .flat_map(|(v, x)| {
                    PointFrame::new(&set.garment, v, world_from_rest)
                        .displacement(*x)
                        .to_array()
                })
                .collect();
            components.project(&sample)
        };
        Self {
            inputs: (0..prepared.len()).map(pair).collect(),
            components: (0..prepared.len()).into_par_iter().map(project).collect(),
        }
    }

    fn moments(&self) -> Moments {
        Moments::new(
            &self.inputs.concat(),
            &self.components.concat(),
            self.inputs.len(),
        )
    }

    fn predicted(&self, map: Option<&LinearMap>, frame: usize) -> Vec<f64> {
        // Without another clip to fit, the mean is all that is known.
        map.map_or_else(
            || vec![0.0; self.components[frame].len()],
            |m| m.apply(&self.inputs[frame]),
        )
    }

    /// Sum of squared errors.
    fn error(&self, map: Option<&LinearMap>) -> f64 {
        let squared = |t: usize| -> f64 {
            let predicted = self.predicted(map, t);
            predicted
                .iter()
                .zip(&self.components[t])
                .map(|(p, c)| (p - c).powi(2))
                .sum()
        };
        (0..self.inputs.len()).map(squared).sum()
    }

    fn coefficients(&self, map: Option<&LinearMap>) -> Vec<Vec<f32>> {
        let frames = 0..self.inputs.len();
        frames
            .map(|t| self.predicted(map, t).iter().map(|a| *a as f32).collect())
            .collect()
    }
}

fn linear_prior(components: &PrincipalComponents, map: Option<&LinearMap>, inputs: usize) -> LinearPrior {
    let mean: Vec<Vec3> = components.mean().chunks_exact(3).map(Vec3::from_slice).collect();
    let Some(map) = map else {
        return LinearPrior::constant(mean, inputs);
    };
    let count = components.len();
    let zero = map.apply(&vec![0.0; inputs]);
    let shape = |vertex: usize, k: usize| Vec3::from_slice(&components.component(k)[3 * vertex..]);
    LinearPrior {
        shapes: (0..mean.len())
            .flat_map(|v| (0..count).map(move |k| (v, k)))
            .map(|(v, k)| shape(v, k))
            .collect(),
        map: Linear {
            inputs,
            outputs: count,
            weight: (0..count)
                .flat_map(|k| (0..inputs).map(move |i| (i, k)))
                .map(|(i, k)| map.coefficient(i, k) as f32)
                .collect(),
            bias: zero.iter().map(|b| *b as f32).collect(),
        },
        mean,
    }
}
