//! Clips that one fit holds out and the next one trains on.
//!
//! The prior of the first fit is one of those without a motion that the prior of the second was judged by: its
//! training, which takes longest, is done once. Both fits share what motion vectors are scaled by, the shapes, and the
//! coefficients that the fields of the other clips learn beside.

use super::{Dataset, MotionVectors, measured_config};
use crate::{config::TrainConfig, fit::Fit};
use unic_core::{config::ModelConfig, prior::Prior};
use unic_eval::PreparedClip;

/// What the fit on all clips has otherwise.
pub(super) struct Later {
    config: ModelConfig,
    prior: Prior,
    /// In their order.
    clips: Vec<HeldOut>,
}

struct HeldOut {
    /// Among all training clips.
    index: usize,
    clip: PreparedClip,
    motion: MotionVectors,
    coefficients: Vec<Vec<f32>>,
}

/// Of each clip: does one of `validation` show its motion, if in another wind?
pub(super) fn known(clips: &[PreparedClip], validation: &[PreparedClip]) -> Vec<bool> {
    let is_known = |clip: &PreparedClip| {
        let clip = &clip.captured.clip;
        validation.iter().any(|v| clip.has_motion_of(&v.captured.clip))
    };
    clips.iter().map(is_known).collect()
}

impl Dataset {
    /// Without the motion that is validated on, whose clips are among the training clips, and with a prior that has
    /// not seen it; where there is but one motion, in several winds, without those clips alone.
    pub(super) fn holding_out(mut self, settings: &TrainConfig, prior: Prior) -> Self {
        let is_drawn = |clip: &PreparedClip| self.validation.iter().any(|v| v.name() == clip.name());
        let drawn: Vec<bool> = self.clips.iter().map(is_drawn).collect();
        let known = known(&self.clips, &self.validation);
        let held_out = if known.iter().all(|k| *k) { &drawn } else { &known };
        let prior = std::mem::replace(&mut self.prior, prior);
        let mut clips = Vec::new();
        for index in (0..held_out.len()).rev().filter(|i| held_out[*i]) {
            clips.push(HeldOut {
                index,
                clip: self.clips.remove(index),
                motion: self.motion.remove(index),
                coefficients: self.coefficients.remove(index),
            });
        }
        clips.reverse();
        let (spec, now) = (self.config.motion.clone(), (&self.prior, &self.coefficients[..]));
        let config = measured_config(settings, spec, &self.capture, &self.clips, now);
        self.later = Some(Later {
            config: std::mem::replace(&mut self.config, config),
            prior,
            clips,
        });
        self
    }

    /// For the fit on all clips after this one: the same as [`Dataset::new`] makes of them. None where nothing that
    /// comes back is held out.
    pub fn on_all_clips(mut self) -> Option<Self> {
        let later = self.later.take()?;
        (self.config, self.prior) = (later.config, later.prior);
        for held_out in later.clips {
            let index = held_out.index;
            self.clips.insert(index, held_out.clip);
            self.motion.insert(index, held_out.motion);
            self.coefficients.insert(index, held_out.coefficients);
        }
        self.validation.clear();
        self.prior_seconds = 0.0;
        self.fit = Fit::AllClips;
        Some(self)
    }
}
