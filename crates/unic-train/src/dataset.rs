//! The training clips of a capture, and what must be measured on them before training.

mod held_out;
mod motion_vectors;

pub use motion_vectors::MotionVectors;

use crate::{
    config::{StateSettings, TrainConfig},
    error::TrainError,
    event::Control,
    fit::{Fit, FitClips},
    mirror::{MirrorMap, normalisation},
    prior::{FittedPrior, PriorSettings, fit_prior},
    processor::Processor,
    recurrence::Watch,
    scales::measure,
};
use burn::tensor::Device;
use glam::Vec3;
use held_out::{Later, known};
use rayon::prelude::*;
use std::time::Instant;
use unic_core::{
    config::{DisplacementConfig, ModelConfig, StateConfig},
    features::RestBox,
    motion::{MotionSpec, Normalisation, motion_len},
    prior::Prior,
};
use unic_eval::{PreparedClip, TrainingSet};
use unic_io::{Capture, Split};

/// Clips to train and to validate on, and the measured parts of the model.
pub struct Dataset {
    /// The capture that it comes from.
    pub capture: Capture,
    /// The fit that it is for.
    pub fit: Fit,
    /// The model's configuration, scales filled in.
    pub config: ModelConfig,
    /// Training clips.
    pub clips: Vec<PreparedClip>,
    /// Clips that the free-running error is validated on; a fit on all clips has none.
    pub validation: Vec<PreparedClip>,
    /// Statistics of the motion vectors of all clips that the run trains on, in the mirror too where windows are.
    pub normalisation: Normalisation,
    /// Normalised motion vectors of each training clip, T × D.
    pub motion: Vec<MotionVectors>,
    /// Where the garment hangs in a given motion, as the fit's model has it.
    pub prior: Prior,
    /// Coefficients of the prior by training clip and frame, fitted without that clip; clips that are held out and
    /// come back are not left out of them.
    pub coefficients: Vec<Vec<Vec<f32>>>,
    /// Bounding box of the rest shape.
    pub rest_box: RestBox,
    /// What fitting the prior took, seconds; nothing where the fit before has done so.
    pub prior_seconds: f64,
    /// What it is trained on, with gradients.
    pub(crate) device: Device,
    /// Of the fit on all clips after one that holds some of them out.
    later: Option<Later>,
}

impl Dataset {
    /// Opens the training and validation clips of a fit; test clips stay closed.
    ///
    /// # Errors
    /// Clips that cannot be read, no clip to train on, settings that fit no network.
    pub fn new(capture: Capture, settings: &TrainConfig, fit: Fit) -> Result<Self, TrainError> {
        Self::watched(capture, settings, fit, Processor::Cpu, &|_, _| Control::Continue)
    }

    /// As [`Dataset::new`], to train on a processor; `watch` is asked while the prior is trained, which takes
    /// as long as many a step.
    ///
    /// # Errors
    /// As [`Dataset::new`]; [`TrainError::Stopped`] where the watch says so; a processor that is
    /// not there.
    pub fn watched(
        mut capture: Capture,
        settings: &TrainConfig,
        fit: Fit,
        processor: Processor,
        watch: &Watch,
    ) -> Result<Self, TrainError> {
        settings.optimiser.products.check(processor)?;
        let device = processor.device()?;
        if matches!(settings.model.state, StateSettings::RootRelative) {
            // The published method knows no skinning that a mask could blend to.
            capture.garment.mask = None;
        }
        let spec = MotionSpec::new(
            settings.model.layout,
            settings.model.velocity,
            capture.contact_joints,
            &capture.character,
        )?;
        let names = FitClips::new(&capture, fit, settings)?;
        let prior_of = match names.comes_back {
            true => capture.clip_names(Split::Train),
            false => &names.train,
        };
        let mut clips = load(&capture, &spec, prior_of, settings.motion_seconds)?;
        let validation = load(&capture, &spec, &names.validation, None)?;
        if !names.comes_back {
            forget_motion(&mut clips, &validation);
        }
        let joints = capture.character.skeleton.len();
        let vectors = clips
            .iter()
            .flat_map(|c| (0..c.len()).map(|t| c.kinematics.motion(t)));
        let mirror = settings.regularisation.mirror;
        let mirror = mirror
            .then(|| MirrorMap::new(&capture.character.skeleton))
            .flatten();
        let normalisation = normalisation(joints, settings.model.normalisation, vectors, mirror.as_ref())?;
        let motion: Vec<MotionVectors> = clips
            .iter()
            .map(|c| MotionVectors::new(c, &normalisation, mirror.as_ref()))
            .collect();
        let started = Instant::now();
        let fitted = fitted_prior(settings, &capture, &clips, &motion, &device, watch)?;
        let mut drawn = clips
            .iter()
            .map(|c| validation.iter().any(|v| v.name() == c.name()));
        let drawn = drawn.position(|is_drawn| is_drawn && names.comes_back);
        let unseen = drawn.map(|clip| fitted.without(clip));
        let data = Self {
            config: measured_config(
                settings,
                spec,
                &capture,
                &clips,
                (&fitted.prior, &fitted.left_out),
            ),
            normalisation,
            motion,
            prior: fitted.prior,
            coefficients: fitted.left_out,
            rest_box: RestBox::of(&capture.garment.rest.vertices),
            clips,
            validation,
            capture,
            fit,
            prior_seconds: started.elapsed().as_secs_f64(),
            device,
            later: None,
        };
        let data = match unseen {
            Some(prior) => data.holding_out(settings, prior),
            None => data,
        };
        data.config.check(joints)?;
        Ok(data)
    }

    /// Can windows be mirrored?
    pub fn mirrors(&self) -> bool {
        self.motion.iter().all(MotionVectors::is_mirrored)
    }

    /// Frames of the longest window that fits a clip, the first frame not counted. Windows are drawn
    /// from the clips that they fit: one short clip does not shorten all rollouts.
    pub fn longest_unroll(&self) -> usize {
        self.clips
            .iter()
            .map(|c| c.len().saturating_sub(1))
            .max()
            .unwrap_or(0)
    }

    /// Pairs of consecutive frames in the training clips: samples of a teacher-forced step.
    pub fn frame_pairs(&self) -> usize {
        self.clips.iter().map(|c| c.len().saturating_sub(1)).sum()
    }

    /// Seconds of training motion.
    pub fn seconds(&self) -> f64 {
        let frames: usize = self.clips.iter().map(PreparedClip::len).sum();
        frames as f64 / f64::from(self.config.fps)
    }
}

/// A motion that is validated on is not trained on in another wind, where other motion is left.
fn forget_motion(clips: &mut Vec<PreparedClip>, validation: &[PreparedClip]) {
    let known = known(clips, validation);
    if !known.iter().all(|k| *k) {
        let mut known = known.into_iter();
        clips.retain(|_| known.next() != Some(true));
    }
}

/// The named clips, each cut to the same share where there are more than `seconds` of them.
fn load(
    capture: &Capture,
    spec: &MotionSpec,
    names: &[String],
    seconds: Option<f64>,
) -> Result<Vec<PreparedClip>, TrainError> {
    let frames = |name: &String| Ok(capture.summarise_clip(name)?.pose_frames);
    let share = match seconds {
        None => 1.0,
        Some(seconds) => {
            let all: usize = names.iter().map(frames).sum::<Result<usize, TrainError>>()?;
            (seconds * f64::from(capture.manifest.fps) / all.max(1) as f64).min(1.0)
        }
    };
    let prepare = |name: &String| {
        let mut captured = capture.load_clip(name)?;
        let kept = (captured.clip.len() as f64 * share).ceil() as usize;
        captured.clip.poses.truncate(kept.max(2));
        Ok(PreparedClip::new(spec, &capture.character.skeleton, captured))
    };
    names.par_iter().map(prepare).collect()
}

fn fitted_prior(
    settings: &TrainConfig,
    capture: &Capture,
    clips: &[PreparedClip],
    motion: &[MotionVectors],
    device: &Device,
    watch: &Watch,
) -> Result<FittedPrior, TrainError> {
    match &settings.model.state {
        StateSettings::Displacement {
            prior_shapes,
            recurrence,
            ..
        } => {
            let garment = capture.garment.clone();
            let set = TrainingSet {
                garment,
                train: clips.to_vec(),
                validation: Vec::new(),
            };
            let settings = PriorSettings {
                shapes: *prior_shapes,
                recurrence: recurrence.as_ref(),
                seed: settings.seed,
                fps: capture.manifest.fps,
                device: device.clone(),
            };
            fit_prior(&set, motion, &settings, watch)
        }
        StateSettings::RootRelative => {
            let zeros = vec![Vec3::ZERO; capture.garment.rest.vertices.len()];
            let inputs = 2 * motion_len(capture.character.skeleton.len());
            let prior = Prior::constant(zeros, inputs);
            Ok(FittedPrior::constant(prior, clips.iter().map(PreparedClip::len)))
        }
    }
}

/// With the scales of the clips about a prior, which comes with its coefficients.
fn measured_config(
    settings: &TrainConfig,
    spec: MotionSpec,
    capture: &Capture,
    clips: &[PreparedClip],
    prior: (&Prior, &[Vec<Vec<f32>>]),
) -> ModelConfig {
    let model = &settings.model;
    let state = match (&model.state, measure(model, capture, clips, prior)) {
        (StateSettings::Displacement { memory_s, inputs, .. }, Some(scales)) => {
            StateConfig::Displacement(DisplacementConfig {
                memory_s: *memory_s,
                scale_m: scales.scale_m,
                output_limit: scales.output_limit,
                inputs: inputs.clone(),
            })
        }
        _ => StateConfig::RootRelative,
    };
    ModelConfig {
        fps: capture.manifest.fps,
        motion: spec,
        encoder: model.encoder.clone(),
        field: model.field,
        state,
        intersection: settings.intersection.of_model(),
    }
}
