//! Speed of training on a machine.

use super::{Trainer, measurement::judged_frames};
use crate::{
    error::TrainError,
    event::Control,
    fit::Fit,
    learner::{Averaging, Learner},
    network::Network,
    validation::{Chosen, JUDGED_START_S, free_running_rmse_of, living_frames},
};
use std::{sync::Arc, time::Instant};
use unic_core::{
    config::IntersectionMode,
    model::Model,
    parallel::{Serial, install},
};
use unic_eval::{LivingMeasure, PreparedClip};
use unic_kernels::FieldShape;

/// Durations on this machine, in wall-clock seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Optimiser step, averaged over the run: windows grow.
    pub step: f64,
    /// Measurement on the validation clips in the middle of a fit.
    pub validation: f64,
    /// Validation at the end of a fit that holds clips out.
    pub last_validation: f64,
    /// Free running through the seconds of the validation clips on which shares are judged.
    pub judging: f64,
}

impl Pace {
    /// Number of steps per fit with which all fits of a run take `seconds`; at least one. `every`
    /// is the number of steps from one measurement to the next.
    pub fn steps_within(&self, seconds: f64, fits: &[Fit], every: u64) -> u64 {
        let of_a_fit = |fit: &Fit| match fit {
            Fit::HeldOut => self.step + self.validation / every as f64,
            Fit::AllClips => self.step,
        };
        let all: f64 = fits.iter().map(of_a_fit).sum();
        // The last step is always followed by a measurement.
        let last = if fits.contains(&Fit::HeldOut) {
            self.validation + self.last_validation
        } else {
            0.0
        };
        (((seconds - last) / all) as u64).max(1)
    }
}

impl Trainer {
    /// Times a few steps, which are not kept, and a few frames of a validation.
    ///
    /// # Errors
    /// The errors of [`Trainer::run`].
    pub fn pace(&self) -> Result<Pace, TrainError> {
        const SAMPLES: u64 = 5;
        let steps = self.config().optimiser.steps;
        let at = |i: u64| (steps / (2 * SAMPLES)).saturating_mul(2 * i + 1);
        let at: Vec<u64> = (0..SAMPLES).map(at).collect();
        let step = self.learner.seconds_per_step(&self.field, &at)?;
        let model = Arc::new(self.model_of(&self.network().values(), Chosen::SETTINGS)?);
        let frames = judged_frames(&self.field.data);
        let validation = self.seconds_of_validating(&model, model.config().intersection, usize::MAX)?;
        let judging = self.seconds_of_validating(&model, IntersectionMode::Off, frames)?;
        let data = &self.field.data;
        let frames = (JUDGED_START_S * data.config.fps) as usize;
        let shown = install(Arc::new(Serial), || {
            self.seconds_of_validating(&model, IntersectionMode::Off, frames)
        })?;
        // Clips run side by side, each on one thread. Judges are about as long as the clips held out.
        let rounds = self.judged().count().div_ceil(rayon::current_num_threads());
        let shown = shown * rounds as f64 / data.validation.len().max(1) as f64;
        Ok(Pace {
            step,
            judging,
            // Beside free running, a measurement makes single steps over as many frames as a share
            // is judged on.
            validation: validation + judging,
            last_validation: validation
                + judging * self.field_shares().len() as f64
                + shown * (self.shown_trials() + self.crossing_trials()) as f64
                + self.seconds_of_measuring_life()? * self.life_trials() as f64,
        })
    }

    /// Largest number of frames that [`Trainer::validation`] animates, each after a call of its `ask`.
    /// Most validations end sooner: where a value is too large, no larger one is tried.
    pub fn most_validation_frames(&self) -> u64 {
        let data = &self.field.data;
        let most = |clip: &PreparedClip, frames: usize| clip.len().min(frames) as u64;
        let starts = (JUDGED_START_S * data.config.fps) as usize;
        let trial: u64 = self.judged().map(|(clip, _)| most(clip, starts)).sum();
        let shares = match self.field_shares().len() {
            1 => 0,
            shares => shares as u64,
        };
        let frames = judged_frames(data);
        let of_validation = |clip| shares * most(clip, frames) + most(clip, usize::MAX);
        let validation: u64 = data.validation.iter().map(of_validation).sum();
        validation + trial * self.shown_trials() as u64
    }

    /// Seconds of a step of a field of another width and number of hidden layers, averaged over the
    /// run.
    ///
    /// # Errors
    /// The errors of [`Trainer::run`].
    pub(crate) fn seconds_per_step_of(
        &mut self,
        [width, hidden_layers]: [usize; 2],
    ) -> Result<f64, TrainError> {
        let mut shape = self.field.shape.clone();
        shape.field = FieldShape {
            hidden: width,
            hidden_layers,
            skip: None,
            ..shape.field
        };
        shape.field.validate()?;
        let network = Network::new(&shape, self.config().seed, &self.field.device);
        let learner = Learner::new(network, Averaging::of(&self.config().regularisation));
        let own = std::mem::replace(&mut self.field.shape, shape);
        let steps = self.config().optimiser.steps;
        let seconds = learner.seconds_per_step(&self.field, &[steps / 4, steps / 2]);
        self.field.shape = own;
        seconds
    }

    /// Estimates the seconds in which the life of all judged clips is measured, from those of a few
    /// frames.
    fn seconds_of_measuring_life(&self) -> Result<f64, TrainError> {
        const TIMED_FRAMES: usize = 4;
        let (data, mut judged) = (&self.field.data, self.judged());
        let Some((clip, _)) = judged.next().filter(|_| self.life_trials() > 0) else {
            return Ok(0.0);
        };
        let measure = LivingMeasure::new(&data.capture.garment.rest).map_err(TrainError::Wrinkles)?;
        let timed = clip.len().min(TIMED_FRAMES);
        let frames: Vec<_> = (0..timed).map(|t| clip.captured.garment.frame(t)).collect();
        let started = Instant::now();
        measure.liveliness(&frames);
        let frame = started.elapsed().as_secs_f64() / timed.max(1) as f64;
        let (most, every) = living_frames(data.config.fps);
        Ok(frame * (most / every * (1 + judged.count())) as f64)
    }

    /// Estimates the seconds of free running over the first `most` frames of every clip from those
    /// of a few frames.
    fn seconds_of_validating(
        &self,
        model: &Arc<Model>,
        intersection: IntersectionMode,
        most: usize,
    ) -> Result<f64, TrainError> {
        const TIMED_FRAMES: usize = 100;
        let clips = &self.field.data.validation;
        let frames = |most: usize| clips.iter().map(|c| c.len().min(most)).sum::<usize>() as f64;
        let seconds = |most: usize| -> Result<f64, TrainError> {
            let started = Instant::now();
            free_running_rmse_of(model, clips, most, intersection, &mut || Control::Continue)?;
            Ok(started.elapsed().as_secs_f64())
        };
        // Creating an animator and its first frame do much that happens once.
        let [start, timed] = [seconds(1)?, seconds(TIMED_FRAMES)?];
        let timed_steps = frames(TIMED_FRAMES) - frames(1);
        Ok(start + (timed - start).max(0.0) * (frames(most) - frames(1)) / timed_steps.max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_fits_share_a_budget() {
        let pace = Pace {
            step: 0.1,
            validation: 2.0,
            last_validation: 10.0,
            judging: 1.0,
        };
        let both = [Fit::HeldOut, Fit::AllClips];
        assert_eq!(pace.steps_within(72.5, &both[..1], 20), 302);
        assert_eq!(pace.steps_within(72.5, &both, 20), 201);
        assert_eq!(pace.steps_within(-1.0, &both, 20), 1);
    }
}
