//! Fits where the garment hangs in a given motion to the training clips.

mod remembered;
mod series;

pub(crate) use series::displacements;

use crate::{
    config::RecurrenceSettings,
    dataset::MotionVectors,
    error::TrainError,
    recurrence::{Watch, fit_recurrence},
};
use burn::tensor::Device;
use glam::Vec3;
use rayon::prelude::*;
use remembered::Remembered;
use series::Series;
use unic_core::{model::ModelError, network::Linear, prior::Prior};
use unic_eval::{Displacements, LinearMap, Moments, PrincipalComponents, TrainingSet};

/// A prior, and its coefficients in every training frame as a prior would give them that has never
/// seen the clip: what the field has to add in training is then as large as on a new motion.
pub struct FittedPrior {
    /// For the model: fitted on all training clips.
    pub prior: Prior,
    /// By clip and frame, K numbers each.
    pub left_out: Vec<Vec<Vec<f32>>>,
}

/// Frames that the shapes are computed from at most, evenly spread.
const MOST_FRAMES: usize = 2000;

/// Vectors of all shapes together, at most: a frame reads them all, and so does the file.
const MOST_SHAPE_VECTORS: usize = 1_000_000;

/// Shapes that the largest garments may have all the same.
const LEAST_MOST_SHAPES: usize = 32;

/// Pieces that a lone clip is cut into, to leave out one at a time.
const PIECES: usize = 4;

/// Ridge strengths to choose from, in units of an input's variance.
const STRENGTHS: [f64; 9] = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0];

/// What to fit beside the data.
pub struct PriorSettings<'a> {
    /// Shapes K.
    pub shapes: usize,
    /// What remembers the motion, if anything does.
    pub recurrence: Option<&'a RecurrenceSettings>,
    /// Of the random streams.
    pub seed: u64,
    /// Frames a second.
    pub fps: f32,
    /// Where the recurrence is trained; with gradients.
    pub device: Device,
}

/// Fits principal components of the displacement, a ridge regression to them whose strength is the
/// best one for clips left out, and a recurrence to what that leaves.
///
/// # Errors
/// A training of the recurrence that diverges, a watch that says stop.
pub fn fit_prior(
    set: &TrainingSet,
    motion: &[MotionVectors],
    settings: &PriorSettings,
    watch: &Watch,
) -> Result<FittedPrior, TrainError> {
    let frames = set.spread_frames(MOST_FRAMES);
    let most = (MOST_SHAPE_VECTORS / set.garment.rest.vertices.len().max(1)).max(LEAST_MOST_SHAPES);
    let components = PrincipalComponents::fit(&Displacements { set, frames }, settings.shapes.min(most));
    let clips: Vec<Series> = (0..set.train.len())
        .map(|clip| Series::new(set, clip, &motion[clip], &components))
        .collect();
    let series = match clips.as_slice() {
        [only] => only.cut(PIECES),
        _ => clips,
    };
    let motions = match set.train.len() {
        1 => (0..series.len()).collect(),
        _ => set.motions(),
    };
    let linear = LeaveOneOut::fit(&series, &motions);
    let coefficients = |(s, map): (&Series, &Option<LinearMap>)| -> Vec<Vec<f32>> {
        let (predicted, count) = (s.predicted(map.as_ref()), components.len());
        let of_frame = |t: usize| {
            predicted[t * count..][..count]
                .iter()
                .map(|a| *a as f32)
                .collect()
        };
        (0..s.len()).map(of_frame).collect()
    };
    let mut left_out: Vec<_> = series.iter().zip(&linear.maps).map(coefficients).collect();
    let inputs = 2 * motion.first().map_or(0, |m| m.len);
    let mut prior = linear_prior(&components, linear.all.as_ref(), inputs);
    if let (Some(recurrence), false) = (settings.recurrence, prior.is_empty()) {
        let data = Remembered {
            set,
            motion,
            components: &components,
            series: &series,
            motions: &motions,
            maps: &linear.maps,
        };
        let sequences = data.sequences().map_err(ModelError::from)?;
        if let Some(fitted) = fit_recurrence(recurrence, &sequences, settings, watch)? {
            for (left_out, corrections) in left_out.iter_mut().zip(fitted.left_out) {
                let frames = left_out.iter_mut().zip(corrections.chunks_exact(prior.len()));
                frames.for_each(|(a, c)| a.iter_mut().zip(c).for_each(|(a, c)| *a += c));
            }
            prior.recurrence = Some(fitted.recurrence);
        }
    }
    if set.train.len() == 1 {
        left_out = vec![left_out.concat()];
    }
    Ok(FittedPrior { prior, left_out })
}

/// The linear map of all series, and of all but those of each one's motion.
struct LeaveOneOut {
    all: Option<LinearMap>,
    maps: Vec<Option<LinearMap>>,
}

impl LeaveOneOut {
    fn fit(series: &[Series], motions: &[usize]) -> Self {
        let moments: Vec<Moments> = series.iter().map(Series::moments).collect();
        let pooled = |left_out: Option<usize>| {
            let kept = (moments.iter().zip(motions)).filter(|(_, motion)| Some(**motion) != left_out);
            Moments::pooled(kept.map(|(m, _)| m))
        };
        let folds: Vec<Option<Moments>> = motions.iter().map(|motion| pooled(Some(*motion))).collect();
        let maps = |strength: f64| -> Vec<Option<LinearMap>> {
            let solved = |m: &Option<Moments>| m.as_ref().and_then(|m| m.solve(strength));
            folds.par_iter().map(solved).collect()
        };
        let error = |strength: f64| -> f64 {
            let pairs: Vec<_> = series.iter().zip(maps(strength)).collect();
            let squared = |(s, map): (&Series, Option<LinearMap>)| -> f64 {
                s.residual(map.as_ref()).map(|e| e * e).sum()
            };
            let errors: Vec<f64> = pairs.into_par_iter().map(squared).collect();
            errors.into_iter().sum()
        };
        let errors = STRENGTHS.map(|strength| (error(strength), strength));
        let best = errors.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let strength = best.map_or(STRENGTHS[4], |best| best.1);
        Self {
            all: pooled(None).and_then(|m| m.solve(strength)),
            maps: maps(strength),
        }
    }
}

fn linear_prior(components: &PrincipalComponents, map: Option<&LinearMap>, inputs: usize) -> Prior {
    let mean: Vec<Vec3> = components.mean().chunks_exact(3).map(Vec3::from_slice).collect();
    let Some(map) = map else {
        return Prior::constant(mean, inputs);
    };
    let count = components.len();
    let zero = map.apply(&vec![0.0; inputs]);
    let shape = |vertex: usize, k: usize| Vec3::from_slice(&components.component(k)[3 * vertex..]);
    Prior {
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
        recurrence: None,
    }
}
