//! Fits where the garment hangs in a given motion to the training clips.

mod series;

pub(crate) use series::displacements;

use crate::{
    config::RecurrenceSettings,
    dataset::MotionVectors,
    error::TrainError,
    mirror::View,
    recurrence::{Fitted, Watch, fit_recurrence},
};
use burn::tensor::Device;
use glam::Vec3;
use rayon::prelude::*;
use series::{Clips, Series, hang_alike};
use unic_core::{model::ModelError, network::Linear, prior::Prior};
use unic_eval::{Displacements, LinearMap, Moments, PrincipalComponents, TrainingSet};

/// A prior, and its coefficients in every training frame as a prior would give them that has never
/// seen the clip: what the field has to add in training is then as large as on a new motion.
pub struct FittedPrior {
    /// For the model: fitted on all training clips.
    pub prior: Prior,
    /// By clip and frame, K numbers each.
    pub left_out: Vec<Vec<Vec<f32>>>,
    unseen: Unseen,
}

/// Priors that have not seen a motion; nothing for a prior that nothing was fitted for.
#[derive(Default)]
struct Unseen {
    /// Of each clip.
    motion_numbers: Vec<usize>,
    /// The linear map without each motion.
    maps: Vec<Linear>,
    recurrence: Option<Fitted>,
}

impl FittedPrior {
    /// A prior that says the same whatever the motion, before `clips` of so many frames.
    pub(crate) fn constant(prior: Prior, clips: impl Iterator<Item = usize>) -> Self {
        Self {
            left_out: clips.map(|frames| vec![Vec::new(); frames]).collect(),
            unseen: Unseen::default(),
            prior,
        }
    }

    /// The prior as it would be without the motion of one of several training clips, and at no cost: it is one of
    /// those that strengths and shares were chosen by. Shapes, statistics, the strength, the share of the recurrence and how
    /// askew the garment hangs are those of all clips, and swings are not enlarged.
    pub(crate) fn without(&self, clip: usize) -> Prior {
        let mut prior = self.prior.clone();
        let motion = match self.unseen.motion_numbers.get(clip) {
            Some(&motion) if !prior.is_empty() => motion,
            _ => return prior,
        };
        prior.map = self.unseen.maps[motion].clone();
        prior.recurrence = None;
        if let Some(fitted) = &self.unseen.recurrence
            && let Some(recurrence) = fitted.without(motion)
        {
            prior.map.scale(fitted.linear_share);
            prior.recurrence = Some(recurrence.clone());
        }
        prior
    }
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
/// best one for motions left out, and a recurrence, blended with it; with mirrored motion too where it
/// is wanted and skeleton and garment are symmetric: it teaches what the motion does, and not how the
/// garment hangs askew in every clip alike.
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
    let clips = Clips {
        set,
        motion,
        components: &components,
    };
    let mut series = clips.series(PIECES).map_err(ModelError::from)?;
    hang_alike(&mut series, STRENGTHS[STRENGTHS.len() / 2]);
    let linear = LeaveOneOut::fit(&series);
    let sequences: Vec<_> = (series.par_iter())
        .map(|s| s.sequence(linear.without(s)))
        .collect();
    let inputs = 2 * motion.first().map_or(0, |m| m.len);
    let mut prior = linear_prior(&components, linear.all.as_ref(), inputs);
    let fitted = match settings.recurrence {
        Some(recurrence) if !prior.is_empty() => fit_recurrence(recurrence, &sequences, settings, watch)?,
        _ => None,
    };
    let map_without = |map: &Option<LinearMap>| linear_of(map.as_ref(), inputs, components.len());
    let unseen = Unseen {
        motion_numbers: set.motions(),
        maps: linear.maps.iter().map(map_without).collect(),
        recurrence: fitted,
    };
    let left_out: Vec<_> = match &unseen.recurrence {
        Some(fitted) => {
            prior.map.scale(fitted.linear_share);
            prior.recurrence = Some(fitted.recurrence.clone());
            fitted.left_out.iter().collect()
        }
        None => sequences.iter().map(|s| &s.linear).collect(),
    };
    let direct = series
        .iter()
        .zip(left_out)
        .filter(|(s, _)| s.view() == View::Direct);
    let left_out: Vec<_> = direct.map(|(s, a)| by_frame(a, s.len())).collect();
    Ok(FittedPrior {
        prior,
        left_out: match set.train.len() {
            1 => vec![left_out.concat()],
            _ => left_out,
        },
        unseen,
    })
}

/// Frames × K numbers, by frame.
fn by_frame(coefficients: &[f32], frames: usize) -> Vec<Vec<f32>> {
    let count = coefficients.len() / frames.max(1);
    (0..frames)
        .map(|t| coefficients[t * count..][..count].to_vec())
        .collect()
}

/// The linear map of all series, and of all but those of each motion.
struct LeaveOneOut {
    all: Option<LinearMap>,
    /// By motion.
    maps: Vec<Option<LinearMap>>,
}

impl LeaveOneOut {
    fn fit(series: &[Series]) -> Self {
        let moments: Vec<Moments> = series.iter().map(Series::moments).collect();
        let pooled = |left_out: Option<usize>| {
            let kept = (moments.iter().zip(series)).filter(|(_, s)| Some(s.motion_number()) != left_out);
            Moments::pooled(kept.map(|(m, _)| m))
        };
        let motions = series.iter().map(|s| s.motion_number() + 1).max().unwrap_or(0);
        let folds: Vec<Option<Moments>> = (0..motions).map(|motion| pooled(Some(motion))).collect();
        let at = |strength: f64| -> Self {
            let solved = |m: &Option<Moments>| m.as_ref().and_then(|m| m.solve(strength));
            Self {
                all: None,
                maps: folds.par_iter().map(solved).collect(),
            }
        };
        let error = |strength: f64| -> f64 {
            let fitted = at(strength);
            let squared = |s: &Series| s.residual(fitted.without(s)).map(|e| e * e).sum::<f64>();
            let errors: Vec<f64> = series.par_iter().map(squared).collect();
            errors.into_iter().sum()
        };
        let errors = STRENGTHS.map(|strength| (error(strength), strength));
        let best = errors.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let strength = best.map_or(STRENGTHS[4], |best| best.1);
        Self {
            all: pooled(None).and_then(|m| m.solve(strength)),
            ..at(strength)
        }
    }

    /// The map that has not seen the motion of `series`.
    fn without(&self, series: &Series) -> Option<&LinearMap> {
        self.maps[series.motion_number()].as_ref()
    }
}

fn linear_prior(components: &PrincipalComponents, map: Option<&LinearMap>, inputs: usize) -> Prior {
    let mean: Vec<Vec3> = components.mean().chunks_exact(3).map(Vec3::from_slice).collect();
    let Some(map) = map else {
        return Prior::constant(mean, inputs);
    };
    let shape = |vertex: usize, k: usize| Vec3::from_slice(&components.component(k)[3 * vertex..]);
    Prior {
        shapes: (0..mean.len())
            .flat_map(|v| (0..components.len()).map(move |k| (v, k)))
            .map(|(v, k)| shape(v, k))
            .collect(),
        map: linear_of(Some(map), inputs, components.len()),
        mean,
        recurrence: None,
    }
}

/// Without a map the mean is all that is said.
fn linear_of(map: Option<&LinearMap>, inputs: usize, outputs: usize) -> Linear {
    let weight = |(k, i)| map.map_or(0.0, |m| m.coefficient(i, k) as f32);
    let bias = map.map_or_else(|| vec![0.0; outputs], |m| m.apply(&vec![0.0; inputs]));
    Linear {
        inputs,
        outputs,
        weight: (0..outputs)
            .flat_map(|k| (0..inputs).map(move |i| (k, i)))
            .map(weight)
            .collect(),
        bias: bias.into_iter().map(|b| b as f32).collect(),
    }
}
