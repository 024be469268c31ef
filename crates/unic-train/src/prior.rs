//! Fits where the garment hangs in a given motion to the training clips.

use crate::{
    config::RecurrenceSettings,
    dataset::MotionVectors,
    error::TrainError,
    mirror::{View, mirrored},
    recurrence::{Sequence, Watch, fit_recurrence, mirrored_components},
};
use glam::Vec3;
use rayon::prelude::*;
use unic_core::{features::PointFrame, network::Linear, prior::Prior, surface_map::SurfaceMap};
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
    let components = PrincipalComponents::fit(&Displacements { set, frames }, settings.shapes);
    let clips: Vec<Series> = (0..set.train.len())
        .map(|clip| Series::new(set, clip, &motion[clip], &components))
        .collect();
    let series = match clips.as_slice() {
        [only] => only.cut(PIECES),
        _ => clips,
    };
    let linear = LeaveOneOut::fit(&series);
    let mut left_out = (series.iter().zip(&linear.maps))
        .map(|(s, map)| s.coefficients(map.as_ref()))
        .collect::<Vec<_>>();
    let inputs = 2 * motion.first().map_or(0, |m| m.len);
    let mut prior = linear_prior(&components, linear.all.as_ref(), inputs);
    if let (Some(recurrence), false) = (settings.recurrence, prior.is_empty()) {
        let data = Remembered {
            set,
            motion,
            components: &components,
            series: &series,
            maps: &linear.maps,
        };
        let sequences = data.sequences();
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

/// The linear map of all series, and of all but each.
struct LeaveOneOut {
    all: Option<LinearMap>,
    maps: Vec<Option<LinearMap>>,
}

impl LeaveOneOut {
    fn fit(series: &[Series]) -> Self {
        let moments: Vec<Moments> = series.iter().map(Series::moments).collect();
        let pooled = |left_out: Option<usize>| {
            let kept = (moments.iter().enumerate()).filter(|(clip, _)| Some(*clip) != left_out);
            Moments::pooled(kept.map(|(_, m)| m))
        };
        let folds: Vec<Option<Moments>> = (0..series.len()).map(|clip| pooled(Some(clip))).collect();
        let maps = |strength: f64| -> Vec<Option<LinearMap>> {
            let solved = |m: &Option<Moments>| m.as_ref().and_then(|m| m.solve(strength));
            folds.par_iter().map(solved).collect()
        };
        let error = |strength: f64| -> f64 {
            let errors = series.iter().zip(maps(strength));
            errors.map(|(s, m)| s.error(m.as_ref())).sum()
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

/// What a recurrence learns from.
struct Remembered<'a> {
    set: &'a TrainingSet,
    motion: &'a [MotionVectors],
    components: &'a PrincipalComponents,
    series: &'a [Series],
    maps: &'a [Option<LinearMap>],
}

impl<'a> Remembered<'a> {
    /// Every series, then every mirrored one where the garment is symmetric.
    fn sequences(&self) -> Vec<Sequence<'a>> {
        let mut sequences: Vec<Sequence> = self.places().map(|p| self.sequence(p, View::Direct)).collect();
        let is_mirrored = self.motion.iter().all(MotionVectors::is_mirrored);
        let map = is_mirrored
            .then(|| mirrored_components(&self.set.garment.rest))
            .flatten();
        if let Some(map) = map {
            let mirrored = |p| Sequence {
                targets: self.mirrored_targets(p, &map),
                ..self.sequence(p, View::Mirrored)
            };
            sequences.extend(self.places().map(mirrored));
        }
        sequences
    }

    /// Series, its clip and its first frame there.
    fn places(&self) -> impl Iterator<Item = (usize, usize, usize)> + use<'_, 'a> {
        let is_cut = self.set.train.len() == 1;
        let starts = self.series.iter().scan(0, move |next, series| {
            let start = *next;
            *next += if is_cut { series.inputs.len() } else { 0 };
            Some(start)
        });
        let clip = move |index: usize| if is_cut { 0 } else { index };
        starts
            .enumerate()
            .map(move |(index, start)| (index, clip(index), start))
    }

    fn sequence(&self, (index, clip, start): (usize, usize, usize), view: View) -> Sequence<'a> {
        let (series, map) = (&self.series[index], self.maps[index].as_ref());
        let left = |t: usize| {
            let predicted = series.predicted(map, t);
            let pairs = series.components[t].iter().zip(predicted);
            pairs.map(|(c, p)| (c - p) as f32).collect::<Vec<_>>()
        };
        Sequence {
            motion: &self.motion[clip],
            view,
            frames: start..start + series.inputs.len(),
            targets: (0..series.inputs.len()).flat_map(left).collect(),
            fold: index,
        }
    }

    /// What the linear map leaves of the mirrored garment in the mirrored motion.
    fn mirrored_targets(&self, (index, clip, start): (usize, usize, usize), map: &SurfaceMap) -> Vec<f32> {
        let frames = start..start + self.series[index].inputs.len();
        let left = |frame: usize| {
            let mut there = Vec::new();
            // A map of this garment's own mesh.
            let moved = map.vectors(&displacements(self.set, clip, frame), &mut there);
            debug_assert!(moved.is_ok());
            let sample: Vec<f32> = there.iter().flat_map(|u| mirrored(*u).to_array()).collect();
            let pair = pair(&self.motion[clip], frame, View::Mirrored);
            let linear = self.maps[index].as_ref().map(|m| m.apply(&pair));
            let components = self.components.project(&sample);
            (components.iter().enumerate())
                .map(|(k, c)| (c - linear.as_ref().map_or(0.0, |p| p[k])) as f32)
                .collect::<Vec<f32>>()
        };
        frames.into_par_iter().flat_map_iter(left).collect()
    }
}

/// Displacements of a frame in the vertices' rotated frames, metres.
fn displacements(set: &TrainingSet, clip: usize, frame: usize) -> Vec<Vec3> {
    let prepared = &set.train[clip];
    let world_from_rest = prepared.kinematics.world_from_rest(frame);
    let garment = prepared.captured.garment.frame(frame).iter().enumerate();
    garment
        .map(|(v, x)| PointFrame::new(&set.garment, v, world_from_rest).displacement(*x))
        .collect()
}

/// Motion vectors of a frame and the one before; the first frame is paired with itself.
fn pair(motion: &MotionVectors, frame: usize, view: View) -> Vec<f64> {
    let both = [frame.saturating_sub(1), frame].map(|t| motion.frame(t, view));
    both.concat().into_iter().map(f64::from).collect()
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
        let project = |t: usize| {
            let displacements = displacements(set, clip, t);
            let sample: Vec<f32> = displacements.iter().flat_map(|u| u.to_array()).collect();
            components.project(&sample)
        };
        let frames = set.train[clip].len();
        Self {
            inputs: (0..frames).map(|t| pair(motion, t, View::Direct)).collect(),
            components: (0..frames).into_par_iter().map(project).collect(),
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
