//! Fits the prior: the garment's displacement as far as the motion alone predicts it.

mod linear;
mod series;

pub use series::displacements;

use crate::{
    config::{RecurrenceStart, StateSettings, TrainConfig},
    dataset::{Dataset, MotionVectors},
    device,
    error::TrainError,
    mirror::View,
    processor::Processor,
    recurrence::{FittedRecurrence, RecurrenceFit, RecurrenceTrainer, Sequence, UnitStart, Watch},
    regression::{LeaveOneOut, middle},
    replay::{FittedReplay, Residuals, wrinkle_filter},
};
use glam::Vec3;
use linear::{STRENGTHS, runtime_map};
use rayon::prelude::*;
use series::{Clips, Series, remove_mirror_bias};
use std::{path::Path, time::Instant};
use unic_core::{
    model::ModelError,
    network::Linear,
    prior::{Components, Prior},
    recurrence::Recurrence,
};
use unic_eval::{Displacements, LinearMap, PreparedClip, PrincipalComponents, TrainingSet, WrinkleFilter};

/// A prior, and its coefficients in every training frame as predicted by a prior that is fitted
/// without the clip. What the field has to add in training is then as large as on a new motion.
pub struct FittedPrior {
    /// Prior of the model, fitted to all clips.
    pub prior: Prior,
    /// Coefficients by clip and frame, K numbers each, predicted without the clip's motion.
    pub left_out: Vec<Vec<Vec<f32>>>,
    /// Start of the recurrence's training; none for a prior without a recurrence.
    pub recurrence_start: Option<RecurrenceStart>,
    /// Seconds that the fit took, over all resumes. Of interrupted fits, those of the recurrences
    /// are counted up to their last checkpoints.
    pub seconds: f64,
    folds: Folds,
}

/// Parts of priors that were fitted without a motion. Empty for a prior that does not depend on the
/// motion.
#[derive(Default)]
struct Folds {
    /// Number of each clip's motion.
    motion_numbers: Vec<usize>,
    /// Linear maps, one per motion, each fitted to all other motions.
    maps: Vec<Linear>,
    recurrence: Option<FittedRecurrence>,
    replay: Option<FittedReplay>,
}

impl FittedPrior {
    /// A prior that is the same for every motion, beside `clips` of so many frames.
    fn constant(prior: Prior, clips: impl Iterator<Item = usize>) -> Self {
        Self {
            left_out: clips.map(|frames| vec![Vec::new(); frames]).collect(),
            recurrence_start: None,
            seconds: 0.0,
            folds: Folds::default(),
            prior,
        }
    }

    /// The prior fitted without the motion of one of several clips. It is one of those by which
    /// ridge strengths and weights were chosen, so nothing is trained. Principal components,
    /// statistics, strength, weights, the mirror bias, shapes and gain of the replay are those of all
    /// clips, and swings are not amplified.
    pub(crate) fn without(&self, clip: usize) -> Prior {
        let mut prior = self.prior.clone();
        let motion = match self.folds.motion_numbers.get(clip) {
            Some(&motion) if !prior.is_empty() => motion,
            _ => return prior,
        };
        prior.map = self.folds.maps[motion].clone();
        prior.recurrence = None;
        let replay = self.folds.replay.as_ref();
        prior.replay = replay.and_then(|replay| replay.without(Some(motion)));
        if let Some(fitted) = &self.folds.recurrence
            && let Some(recurrence) = fitted.without(motion)
        {
            blend(&mut prior, &fitted.linear_shares, recurrence);
        }
        // The maps without a motion do not know of the wrinkles.
        prior.extend_maps();
        prior
    }
}

/// A training clip, and the prior that was fitted without its motion.
pub(crate) struct UnseenClip {
    /// Index among the clips that the prior was fitted to.
    pub(crate) clip: usize,
    pub(crate) prior: Prior,
}

impl FittedPrior {
    /// Returns one clip of up to `most` motions, evenly spread, each with the prior that has not seen
    /// its motion. Motions of the clips in `but` are left out. Empty for a prior that does not depend
    /// on the motion, and where all clips show one motion, of which a prior left out a part alone.
    pub(crate) fn unseen_clips(&self, most: usize, but: &[usize]) -> Vec<UnseenClip> {
        let numbers = &self.folds.motion_numbers[..];
        if self.prior.is_empty() || numbers.iter().all(|motion| *motion == numbers[0]) {
            return Vec::new();
        }
        let mut taken: Vec<usize> = but
            .iter()
            .filter_map(|&clip| numbers.get(clip).copied())
            .collect();
        let mut clips = Vec::new();
        for (clip, motion) in numbers.iter().enumerate() {
            if !taken.contains(motion) {
                taken.push(*motion);
                clips.push(clip);
            }
        }
        let count = clips.len().min(most);
        let spread = (0..count).map(|i| clips[(2 * i + 1) * clips.len() / (2 * count)]);
        let unseen = |clip| UnseenClip {
            clip,
            prior: self.without(clip),
        };
        spread.map(unseen).collect()
    }
}

/// Scales the outputs of a linear prior's map by `linear_shares`, and adds a recurrence.
fn blend(prior: &mut Prior, linear_shares: &[f32], recurrence: &Recurrence) {
    prior.map.scale_outputs(linear_shares);
    prior.recurrence = Some(recurrence.clone());
}

/// Largest number of frames, evenly spread, that the principal components are computed from.
const MOST_FRAMES: usize = 2000;

/// Largest number of vectors in all principal components together. A frame reads them all, and the
/// file holds them.
const MOST_COMPONENT_VECTORS: usize = 1_000_000;

/// Number of principal components that even the largest garments may have.
const LEAST_COMPONENTS: usize = 32;

/// Pieces that a lone clip is cut into, to leave out one at a time.
const PIECES: usize = 4;

/// Fits the prior of a run.
///
/// Principal components of the displacement; a ridge regression to them whose strength is the best
/// one for motions left out; a recurrence, blended with it. Where mirroring is wanted and skeleton
/// and garment are symmetric, mirrored motion is fitted too.
pub struct PriorTrainer<'a> {
    /// Clips that the prior is fitted to.
    pub data: &'a Dataset,
    /// Settings of the run.
    pub settings: &'a TrainConfig,
    /// Processor that the recurrence is trained on.
    pub processor: Processor,
    /// Folder for checkpoints of the recurrence. A fit that finds some continues from them.
    pub folder: Option<&'a Path>,
}

/// Principal components, and the series of clips that maps are fitted to.
struct Projected<'a> {
    components: PrincipalComponents,
    series: Vec<Series<'a>>,
    /// Numbers in a pair of motion vectors.
    inputs: usize,
}

impl PriorTrainer<'_> {
    /// Fits the prior. `watch` is called after every step of the recurrence, from several threads.
    ///
    /// # Errors
    /// A training that diverges; [`TrainError::Stopped`] where `watch` answers stop, after a
    /// checkpoint; a processor that is not there; a checkpoint of another training.
    pub fn run(&self, watch: &Watch) -> Result<FittedPrior, TrainError> {
        let started = Instant::now();
        // Checked first, because the fit may take minutes before it needs the processor.
        device::check(self.settings.optimiser.products, self.processor)?;
        let mut fitted = match &self.settings.model.state {
            StateSettings::Displacement { prior_shapes, .. } => self.fit(*prior_shapes, watch)?,
            StateSettings::RootRelative => self.zero(),
        };
        fitted.seconds += started.elapsed().as_secs_f64();
        Ok(fitted)
    }

    /// Returns a prior of zero displacement: the published method has none.
    fn zero(&self) -> FittedPrior {
        let character = &self.data.capture.character;
        let zeros = vec![Vec3::ZERO; self.data.capture.garment.rest.vertices.len()];
        let prior = Prior::constant(zeros, 2 * self.data.motion_spec.len(character.skeleton.len()));
        FittedPrior::constant(prior, self.data.clips.iter().map(PreparedClip::len))
    }

    fn fit(&self, components: usize, watch: &Watch) -> Result<FittedPrior, TrainError> {
        let set = self.set();
        // Made first, because the fit may take minutes before it needs the filter.
        let filter = (self.settings.replay.at_inference)
            .then(|| wrinkle_filter(&set.garment))
            .transpose()?;
        let projected = self.project(&set, &self.data.motion, components)?;
        let linear = LeaveOneOut::fit(&projected.series, &STRENGTHS);
        let sequences: Vec<_> = (projected.series.par_iter())
            .map(|s| s.sequence(linear.without(s)))
            .collect();
        let mut prior = projected.linear_prior(linear.all.as_ref());
        let RecurrenceFit {
            fitted: recurrence,
            restored_seconds,
        } = match self.recurrence() {
            Some(settings) if !prior.is_empty() => {
                let trainer = RecurrenceTrainer {
                    start: self.start(settings.start),
                    settings,
                    seed: self.settings.seed,
                    fps: self.data.capture.manifest.fps,
                    device: &device::open(self.processor)?,
                    folder: self.folder,
                };
                trainer.run(&sequences, watch)?
            }
            _ => RecurrenceFit {
                fitted: None,
                restored_seconds: 0.0,
            },
        };
        let left_out = match &recurrence {
            Some(fitted) => {
                blend(&mut prior, &fitted.linear_shares, &fitted.recurrence);
                fitted.left_out.clone()
            }
            None => sequences.iter().map(|s| s.linear.clone()).collect::<Vec<_>>(),
        };
        let replay = filter.and_then(|filter| self.replay(filter, &prior, &sequences, &left_out));
        if let Some(replay) = &replay {
            prior.append_components(replay.shapes());
            prior.replay = replay.without(None);
        }
        Ok(FittedPrior {
            left_out: projected.by_clip(&left_out, set.train.len()),
            prior,
            recurrence_start: recurrence.as_ref().map(|fitted| fitted.start),
            seconds: restored_seconds,
            folds: Folds {
                motion_numbers: set.motions(),
                maps: linear.maps.iter().map(|m| projected.map(m.as_ref())).collect(),
                recurrence,
                replay,
            },
        })
    }

    /// Collects wrinkles for the replay.
    ///
    /// Those of mirrored motion are left out: cloth that sticks to one side would jump to the other.
    fn replay(
        &self,
        filter: WrinkleFilter,
        prior: &Prior,
        sequences: &[Sequence],
        left_out: &[Vec<f32>],
    ) -> Option<FittedReplay> {
        if prior.is_empty() {
            return None;
        }
        let pairs = sequences.iter().zip(left_out);
        let (direct, left_out): (Vec<_>, Vec<_>) = pairs
            .filter(|(s, _)| s.view == View::Direct)
            .map(|(s, predicted)| (s.clone(), predicted.clone()))
            .unzip();
        let clips: Vec<&PreparedClip> = match &self.data.clips[..] {
            // A lone clip was cut into pieces.
            [clip] => vec![clip; direct.len()],
            clips => clips.iter().collect(),
        };
        let residuals = Residuals {
            garment: &self.data.capture.garment,
            prior,
            sequences: &direct,
            clips: &clips,
            left_out: &left_out,
        };
        let fps = self.data.capture.manifest.fps;
        FittedReplay::fit(&self.settings.replay, fps, filter, residuals)
    }

    fn recurrence(&self) -> Option<&crate::config::RecurrenceSettings> {
        match &self.settings.model.state {
            StateSettings::Displacement { recurrence, .. } => recurrence.as_ref(),
            StateSettings::RootRelative => None,
        }
    }

    /// First values of a recurrence, if not random.
    fn start(&self, start: RecurrenceStart) -> Option<UnitStart> {
        let (spec, capture) = (&self.data.motion_spec, &self.data.capture);
        match start {
            RecurrenceStart::Random => None,
            RecurrenceStart::Pretrained => UnitStart::new(
                spec,
                &capture.character.skeleton,
                &self.data.normalisation,
                capture.manifest.fps,
            ),
        }
    }

    fn set(&self) -> TrainingSet {
        TrainingSet {
            garment: self.data.capture.garment.clone(),
            train: self.data.clips.clone(),
            validation: Vec::new(),
        }
    }

    /// The sequences that a recurrence is trained on, with other motion vectors.
    pub(crate) fn sequences_of<'a>(
        &self,
        motion: &'a [MotionVectors],
        components: usize,
    ) -> Result<Vec<Sequence<'a>>, TrainError> {
        let set = self.set();
        let projected = self.project(&set, motion, components)?;
        Ok(projected.series.iter().map(|s| s.sequence(None)).collect())
    }

    fn project<'a>(
        &self,
        set: &TrainingSet,
        motion: &'a [MotionVectors],
        components: usize,
    ) -> Result<Projected<'a>, TrainError> {
        let frames = set.spread_frames(MOST_FRAMES);
        let most = (MOST_COMPONENT_VECTORS / set.garment.rest.vertices.len().max(1)).max(LEAST_COMPONENTS);
        let components = PrincipalComponents::fit(&Displacements { set, frames }, components.min(most));
        let clips = Clips {
            set,
            motion,
            components: &components,
        };
        let mut series = clips.series(PIECES).map_err(ModelError::from)?;
        remove_mirror_bias(&mut series, middle(&STRENGTHS));
        Ok(Projected {
            series,
            components,
            inputs: 2 * self.data.motion.first().map_or(0, |m| m.len),
        })
    }
}

impl Projected<'_> {
    fn map(&self, map: Option<&LinearMap>) -> Linear {
        runtime_map(map, self.inputs, self.components.len())
    }

    fn linear_prior(&self, map: Option<&LinearMap>) -> Prior {
        let components = &self.components;
        let mean: Vec<Vec3> = components.mean().chunks_exact(3).map(Vec3::from_slice).collect();
        if map.is_none() {
            return Prior::constant(mean, self.inputs);
        }
        let shape = |vertex: usize, k: usize| Vec3::from_slice(&components.component(k)[3 * vertex..]);
        let vectors: Vec<Vec3> = (0..mean.len())
            .flat_map(|v| (0..components.len()).map(move |k| (v, k)))
            .map(|(v, k)| shape(v, k))
            .collect();
        Prior {
            components: Components::of_vectors(&vectors, components.len()),
            map: self.map(map),
            mean,
            recurrence: None,
            replay: None,
        }
    }

    /// Coefficients of the direct series by clip and frame, from those of all series.
    fn by_clip(&self, coefficients: &[Vec<f32>], clips: usize) -> Vec<Vec<Vec<f32>>> {
        let direct = self
            .series
            .iter()
            .zip(coefficients)
            .filter(|(s, _)| s.view() == View::Direct);
        let by_series: Vec<_> = direct.map(|(s, a)| by_frame(a, s.len())).collect();
        match clips {
            // A lone clip was cut into pieces.
            1 => vec![by_series.concat()],
            _ => by_series,
        }
    }
}

/// Splits frames × K numbers by frame.
fn by_frame(coefficients: &[f32], frames: usize) -> Vec<Vec<f32>> {
    let count = coefficients.len() / frames.max(1);
    (0..frames)
        .map(|t| coefficients[t * count..][..count].to_vec())
        .collect()
}
