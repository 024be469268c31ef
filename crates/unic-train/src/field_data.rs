//! Data that the deformation field is trained on: clips, and the prior that the field adds to.

mod held_out;

use crate::{
    config::{RecurrenceStart, StateSettings, TrainConfig},
    dataset::{Dataset, MotionVectors, shows_motion_of},
    error::TrainError,
    event::Control,
    fit::Fit,
    prior::{FittedPrior, PriorTrainer, UnseenClip},
    processor::Processor,
    scales::{PriorFit, measure},
    strain::MeasuredStrain,
};
use held_out::{ClipLists, HeldOut};
use unic_core::{
    config::{DisplacementConfig, FieldConfig, ModelConfig, StateConfig},
    features::RestBox,
    motion::{MotionSpec, Normalisation},
    prior::Prior,
};
use unic_eval::PreparedClip;
use unic_io::Capture;

/// Clips of one fit with the prior, and the model's configuration with measured scales.
pub struct FieldData {
    /// Capture that the clips come from.
    pub capture: Capture,
    /// Fit that the data are for.
    pub fit: Fit,
    /// The model's configuration, with its scales measured on the clips.
    pub config: ModelConfig,
    /// Training clips.
    pub clips: Vec<PreparedClip>,
    /// Clips that the free-running error is measured on. A fit on all clips has none.
    pub validation: Vec<PreparedClip>,
    /// Mean and scale of the motion vectors of all clips that the run trains on, with their mirror
    /// images where windows are mirrored.
    pub normalisation: Normalisation,
    /// Normalised motion vectors of each training clip, T × D.
    pub motion: Vec<MotionVectors>,
    /// Prior of the fit's model.
    pub prior: Prior,
    /// Coefficients of the prior by training clip and frame, predicted by a prior that is fitted
    /// without the clip. In the fit that holds clips out, the priors of the other clips have seen
    /// those.
    pub coefficients: Vec<Vec<Vec<f32>>>,
    /// Lengths of edges and chords in the training clips, for the strain projection; empty without one.
    pub(crate) strain: MeasuredStrain,
    /// Motions that judge strain projection and replay beside the validation clips.
    pub(crate) judges: Vec<Judge>,
    /// Bounding box of the rest shape.
    pub rest_box: RestBox,
    /// Start of the training of the prior's recurrence; none for a prior without a recurrence.
    pub recurrence_start: Option<RecurrenceStart>,
    /// Seconds that the prior's training took. Zero where the fit before has trained it.
    pub prior_seconds: f64,
    /// Data of the fit on all clips, which follows one that holds some of them out.
    later: Option<Later>,
}

/// A training clip, and a prior that was fitted without its motion.
pub(crate) struct Judge {
    /// Name of the clip.
    pub(crate) clip: String,
    pub(crate) prior: Prior,
}

/// Largest number of motions that judge strain projection and replay beside the validation clips. One clip
/// alone judges badly: on a skirt it has chosen a bending that left a third too many wrinkles.
const MOST_JUDGES: usize = 5;

impl FieldData {
    /// Loads clips and fits the prior on the CPU, without stops and checkpoints.
    ///
    /// # Errors
    /// The errors of [`Dataset::load`], [`PriorTrainer::run`] and [`FieldData::new`].
    pub fn prepare(capture: Capture, settings: &TrainConfig, fit: Fit) -> Result<Self, TrainError> {
        let data = Dataset::load(capture, settings, fit)?;
        let trainer = PriorTrainer {
            data: &data,
            settings,
            processor: Processor::Cpu,
            folder: None,
        };
        let prior = trainer.run(&|_, _| Control::Continue)?;
        Self::new(data, prior, settings)
    }

    /// Joins clips with the prior that was fitted to them.
    ///
    /// # Errors
    /// Settings that fit no model.
    pub fn new(data: Dataset, prior: FittedPrior, settings: &TrainConfig) -> Result<Self, TrainError> {
        let is_validated =
            |c: &PreparedClip| data.holds_validation && data.validation.iter().any(|v| v.name() == c.name());
        let drawn = data.clips.iter().position(is_validated);
        let unseen = drawn.map(|clip| prior.without(clip));
        let is_judged = settings.projection.of_model().is_some() || settings.replay.at_inference;
        let judges = match data.validation.is_empty() || !is_judged {
            true => Vec::new(),
            false => prior.unseen_clips(MOST_JUDGES, drawn.as_slice()),
        };
        let judge = |unseen: UnseenClip| Judge {
            clip: data.clips[unseen.clip].name().to_owned(),
            prior: unseen.prior,
        };
        let config = measured_config(
            settings,
            data.motion_spec.clone(),
            &data.capture,
            &data.clips,
            PriorFit {
                prior: &prior.prior,
                coefficients: &prior.left_out,
            },
        );
        let all = Self {
            rest_box: RestBox::of(&data.capture.garment.rest.vertices),
            config,
            strain: measured_strain(settings, &data.capture, &data.clips),
            judges: judges.into_iter().map(judge).collect(),
            normalisation: data.normalisation,
            motion: data.motion,
            prior: prior.prior,
            coefficients: prior.left_out,
            clips: data.clips,
            validation: data.validation,
            capture: data.capture,
            fit: data.fit,
            recurrence_start: prior.recurrence_start,
            prior_seconds: prior.seconds,
            later: None,
        };
        let data = match unseen {
            Some(prior) => all.holding_out(settings, prior),
            None => all,
        };
        data.config.check(data.capture.character.skeleton.len())?;
        Ok(data)
    }

    /// Takes out the clips that show a validated motion, and replaces the prior by one that has not
    /// seen the motion. Where all clips show the same motion in several winds, only the validation
    /// clips go.
    ///
    /// The prior of the first fit is one of those without a motion, by which the prior of the
    /// second fit was judged. So the prior's training, which takes longest, is done once. Both fits
    /// share the skinning weights, the scale of the motion vectors, the principal components, and the
    /// coefficients of the clips that both train on.
    fn holding_out(mut self, settings: &TrainConfig, prior: Prior) -> Self {
        let is_drawn = |clip: &PreparedClip| self.validation.iter().any(|v| v.name() == clip.name());
        let drawn: Vec<bool> = self.clips.iter().map(is_drawn).collect();
        let known = shows_motion_of(&self.clips, &self.validation);
        let flags = if known.iter().all(|k| *k) { &drawn } else { &known };
        let mut lists = self.take_lists();
        let clips = lists.take_out(flags);
        self.set_lists(lists);
        let prior = std::mem::replace(&mut self.prior, prior);
        let fit = PriorFit {
            prior: &self.prior,
            coefficients: &self.coefficients,
        };
        let motion = self.config.motion.clone();
        let config = measured_config(settings, motion, &self.capture, &self.clips, fit);
        let strain = measured_strain(settings, &self.capture, &self.clips);
        self.later = Some(Later {
            strain: std::mem::replace(&mut self.strain, strain),
            config: std::mem::replace(&mut self.config, config),
            prior,
            clips,
        });
        self
    }

    /// Returns the data of the fit on all clips, equal to those that [`FieldData::new`] makes for
    /// it. Returns none where no clip is held out that comes back.
    pub fn on_all_clips(mut self) -> Option<Self> {
        let later = self.later.take()?;
        (self.config, self.prior) = (later.config, later.prior);
        self.strain = later.strain;
        let mut lists = self.take_lists();
        lists.put_back(later.clips);
        self.set_lists(lists);
        self.validation.clear();
        self.judges.clear();
        self.prior_seconds = 0.0;
        self.fit = Fit::AllClips;
        Some(self)
    }

    /// Calls `work` with the data of all clips that the run trains on, also where this fit holds
    /// some of them out.
    pub(crate) fn on_all_known_clips<T>(&mut self, work: impl FnOnce(&Self) -> T) -> T {
        let Some(mut later) = self.later.take() else {
            return work(self);
        };
        let mut lists = self.take_lists();
        let flags = later.clips.flags(lists.clips.len());
        lists.put_back(later.clips);
        self.set_lists(lists);
        let result = work(self);
        let mut lists = self.take_lists();
        later.clips = lists.take_out(&flags);
        self.set_lists(lists);
        self.later = Some(later);
        result
    }

    /// Sets the size of the field, for this fit and the one after it.
    pub(crate) fn set_field(&mut self, field: FieldConfig) {
        self.config.field = field;
        if let Some(later) = &mut self.later {
            later.config.field = field;
        }
    }

    fn take_lists(&mut self) -> ClipLists {
        ClipLists {
            clips: std::mem::take(&mut self.clips),
            motion: std::mem::take(&mut self.motion),
            coefficients: std::mem::take(&mut self.coefficients),
        }
    }

    fn set_lists(&mut self, lists: ClipLists) {
        (self.clips, self.motion, self.coefficients) = (lists.clips, lists.motion, lists.coefficients);
    }

    /// Returns whether windows can be mirrored.
    pub fn mirrors(&self) -> bool {
        self.motion.iter().all(MotionVectors::is_mirrored)
    }

    /// Number of frames of the longest window that fits a clip, without the window's first frame.
    /// Windows are drawn from the clips that they fit, so one short clip does not shorten all
    /// rollouts.
    pub fn longest_unroll(&self) -> usize {
        self.clips
            .iter()
            .map(|c| c.len().saturating_sub(1))
            .max()
            .unwrap_or(0)
    }

    /// Number of pairs of consecutive frames in the training clips: the samples of teacher forcing.
    pub fn frame_pairs(&self) -> usize {
        self.clips.iter().map(|c| c.len().saturating_sub(1)).sum()
    }

    /// Duration of the training motion, in seconds.
    pub fn seconds(&self) -> f64 {
        let frames: usize = self.clips.iter().map(PreparedClip::len).sum();
        frames as f64 / f64::from(self.config.fps)
    }
}

/// Parts of the data in which the fit on all clips differs from the one before.
struct Later {
    config: ModelConfig,
    strain: MeasuredStrain,
    prior: Prior,
    clips: HeldOut,
}

/// Lengths of edges and chords in clips; none where the settings ask for no projection.
fn measured_strain(settings: &TrainConfig, capture: &Capture, clips: &[PreparedClip]) -> MeasuredStrain {
    let deviations = settings.projection.deviations;
    let rest = &capture.garment.rest;
    settings
        .projection
        .of_model()
        .map_or_else(MeasuredStrain::default, |config| {
            MeasuredStrain::new(rest, &capture.character, &config, clips, deviations)
        })
}

/// The model's configuration with scales measured on clips beside a prior.
fn measured_config(
    settings: &TrainConfig,
    motion: MotionSpec,
    capture: &Capture,
    clips: &[PreparedClip],
    prior: PriorFit,
) -> ModelConfig {
    let model = &settings.model;
    let state = match (&model.state, measure(model, capture, clips, prior)) {
        (
            StateSettings::Displacement {
                memory_s,
                excursion_m,
                inputs,
                ..
            },
            Some(scales),
        ) => StateConfig::Displacement(DisplacementConfig {
            memory_s: *memory_s,
            excursion_m: Some(*excursion_m).filter(|metres| *metres > 0.0),
            scale_m: scales.scale_m,
            output_limit: scales.output_limit,
            inputs: inputs.clone(),
        }),
        _ => StateConfig::RootRelative,
    };
    ModelConfig {
        fps: capture.manifest.fps,
        motion,
        encoder: model.encoder.clone(),
        field: model.field,
        state,
        intersection: settings.intersection.of_model(),
        projection: settings.projection.of_model(),
    }
}
