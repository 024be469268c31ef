//! The clips of one fit, opened and normalised.

mod joint_springs;
mod motion_vectors;

pub(crate) use joint_springs::joint_springs;
pub use motion_vectors::MotionVectors;

use crate::{
    config::{SkinningSource, StateSettings, TrainConfig},
    error::TrainError,
    fit::{Fit, FitClips},
    mirror::{MirrorMap, normalisation},
    skinning::bind_to_motion,
};
use rayon::prelude::*;
use unic_core::motion::{MotionSpec, Normalisation};
use unic_eval::PreparedClip;
use unic_io::{Capture, Split};

/// Clips of one fit with their normalised motion vectors. Test clips stay closed.
pub struct Dataset {
    /// Capture that the clips come from. Its garment has no mask where the state is root-relative, and
    /// fitted weights where the settings ask for them.
    pub capture: Capture,
    /// Fit that the clips are for.
    pub fit: Fit,
    /// Definition of the motion vectors.
    pub motion_spec: MotionSpec,
    /// Clips that the prior is fitted to: the training clips. Where the run's next fit trains on
    /// the validation clips too, these are among them.
    pub clips: Vec<PreparedClip>,
    /// Clips that the free-running error is measured on. A fit on all clips has none.
    pub validation: Vec<PreparedClip>,
    /// Mean and scale of the motion vectors of `clips`, with their mirror images where windows are
    /// mirrored.
    pub normalisation: Normalisation,
    /// Normalised motion vectors of each of `clips`, T × D.
    pub motion: Vec<MotionVectors>,
    /// The validation clips are among `clips`, because the run's next fit trains on them.
    pub(crate) holds_validation: bool,
}

impl Dataset {
    /// Opens the training and validation clips of a fit.
    ///
    /// # Errors
    /// Clips that cannot be read, no clip to train on, settings that fit no motion vector.
    pub fn load(mut capture: Capture, settings: &TrainConfig, fit: Fit) -> Result<Self, TrainError> {
        if matches!(settings.model.state, StateSettings::RootRelative) {
            // The published method has no skinned garment that a mask could blend to.
            capture.garment.mask = None;
        }
        let mut motion_spec = MotionSpec::new(
            settings.model.layout,
            settings.model.velocity,
            capture.contact_joints,
            &capture.character,
        )?;
        motion_spec.springs = joint_springs(&settings.model.springs, &capture.character.skeleton);
        motion_spec.check(&capture.character.skeleton)?;
        let names = FitClips::new(&capture, fit, settings)?;
        let loaded = match names.validation_comes_back {
            true => capture.clip_names(Split::Train),
            false => &names.train,
        };
        let mut clips = load(&capture, &motion_spec, loaded, settings.motion_seconds)?;
        let validation = load(&capture, &motion_spec, &names.validation, None)?;
        if !names.validation_comes_back {
            remove_known_motion(&mut clips, &validation);
        }
        let skeleton = &capture.character.skeleton;
        let mirror = settings.regularisation.mirror;
        if let StateSettings::Displacement {
            skinning: SkinningSource::Fitted,
            ..
        } = settings.model.state
        {
            bind_to_motion(&capture.character, &mut capture.garment, &clips, mirror)?;
        }
        let mirror = mirror
            .then(|| MirrorMap::new(&motion_spec.springs, skeleton))
            .flatten();
        let vectors = clips
            .iter()
            .flat_map(|c| (0..c.len()).map(|t| c.kinematics.motion(t)));
        let rule = settings.model.normalisation;
        let normalisation = normalisation(
            skeleton.len(),
            motion_spec.len(skeleton.len()),
            rule,
            vectors,
            mirror.as_ref(),
        )?;
        let motion = clips
            .iter()
            .map(|c| MotionVectors::new(c, &normalisation, mirror.as_ref()))
            .collect();
        Ok(Self {
            fit,
            motion_spec,
            clips,
            validation,
            normalisation,
            motion,
            holds_validation: names.validation_comes_back,
            capture,
        })
    }
}

/// Returns a flag for each clip: whether one of `validation` shows the same motion, in any wind.
pub(crate) fn shows_motion_of(clips: &[PreparedClip], validation: &[PreparedClip]) -> Vec<bool> {
    let is_shown = |clip: &PreparedClip| {
        let clip = &clip.captured.clip;
        validation.iter().any(|v| clip.has_motion_of(&v.captured.clip))
    };
    clips.iter().map(is_shown).collect()
}

/// Removes training clips that show a validation clip's motion in another wind, if other motion is
/// left: the validation error is that of unseen motion.
fn remove_known_motion(clips: &mut Vec<PreparedClip>, validation: &[PreparedClip]) {
    let known = shows_motion_of(clips, validation);
    if !known.iter().all(|k| *k) {
        let mut known = known.into_iter();
        clips.retain(|_| known.next() != Some(true));
    }
}

/// Loads the named clips, each cut to the same share where there are more than `seconds` of them.
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
        // A step needs a pair of frames.
        captured.clip.poses.truncate(kept.max(2));
        Ok(PreparedClip::new(spec, &capture.character.skeleton, captured))
    };
    // Rayon's `collect` keeps the order of the names, for any number of threads.
    names.par_iter().map(prepare).collect()
}
