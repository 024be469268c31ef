//! How fast a machine trains.

use super::Trainer;
use crate::{error::TrainError, event::Control, fit::Fit, validation::free_running_rmse_of};
use std::{sync::Arc, time::Instant};
use unic_core::{config::IntersectionMode, model::Model};

/// Wall-clock seconds on this machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// An optimiser step, averaged over the run: windows grow.
    pub step: f64,
    /// A validation.
    pub validation: f64,
    /// The one at the end of a fit that holds clips out.
    pub last_validation: f64,
}

impl Pace {
    /// Steps of each fit so that all fits of a run fit into `seconds`, one at least. `every`: steps from
    /// one validation to the next.
    pub fn steps_within(&self, seconds: f64, fits: &[Fit], every: u64) -> u64 {
        let of_a_fit = |fit: &Fit| match fit {
            Fit::HeldOut => self.step + self.validation / every as f64,
            Fit::AllClips => self.step,
        };
        let all: f64 = fits.iter().map(of_a_fit).sum();
        // The last step is validated whether its turn has come or not.
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
    /// As [`Trainer::run`].
    pub fn pace(&self) -> Result<Pace, TrainError> {
        const SAMPLES: u64 = 5;
        let steps = self.config.optimiser.steps;
        let (mut network, mut moments) = (self.network.clone(), self.moments.clone());
        let mut total = 0.0;
        for i in 0..SAMPLES {
            let at = (steps / (2 * SAMPLES)).saturating_mul(2 * i + 1);
            // Twice: the first one warms caches and allocates.
            self.stepped(&mut network, &mut moments, at)?;
            let started = Instant::now();
            self.stepped(&mut network, &mut moments, at)?;
            total += started.elapsed().as_secs_f64();
        }
        let model = Arc::new(self.model_of(&self.network.values(), 1.0)?);
        let validation = self.seconds_of_validating(&model, model.config().intersection, usize::MAX)?;
        let judging = self.seconds_of_validating(&model, IntersectionMode::Off, self.judged_frames())?;
        Ok(Pace {
            step: total / SAMPLES as f64,
            // Beside free running, single steps over as many frames as shares are judged on.
            validation: validation + judging,
            last_validation: validation + judging * self.field_shares().len() as f64,
        })
    }

    /// The first `most` frames of every clip, as a few of them tell.
    fn seconds_of_validating(
        &self,
        model: &Arc<Model>,
        intersection: IntersectionMode,
        most: usize,
    ) -> Result<f64, TrainError> {
        const TIMED_FRAMES: usize = 100;
        let clips = &self.data.validation;
        let frames = |most: usize| clips.iter().map(|c| c.len().min(most)).sum::<usize>() as f64;
        let seconds = |most: usize| -> Result<f64, TrainError> {
            let started = Instant::now();
            free_running_rmse_of(model, clips, most, intersection, &mut || Control::Continue)?;
            Ok(started.elapsed().as_secs_f64())
        };
        // A run begins with much that it does once.
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
        };
        let both = [Fit::HeldOut, Fit::AllClips];
        assert_eq!(pace.steps_within(72.5, &both[..1], 20), 302);
        assert_eq!(pace.steps_within(72.5, &both, 20), 201);
        assert_eq!(pace.steps_within(-1.0, &both, 20), 1);
    }
}
