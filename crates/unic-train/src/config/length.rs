//! How long a run is: epochs of its clips, or steps.

use super::{OptimiserConfig, Refit, TrainConfig};

/// Epochs of the published training: the authors' release trains for 400 and uses the checkpoint
/// after 300.
pub const PUBLISHED_EPOCHS: u64 = 300;

impl TrainConfig {
    /// Are `longer` the same settings for a longer run, whose learning rate has been the same up to
    /// where this one ends, but for the rounding of epochs to steps? The half periods of the
    /// schedule grow with the epochs, or with the steps where those are given. A run of two fits
    /// cannot be made longer.
    pub fn is_lengthened_by(&self, longer: &Self) -> bool {
        let (o, l) = (&self.optimiser, &longer.optimiser);
        let lengths = match (o.epochs, l.epochs) {
            (Some(epochs), Some(longer)) => [epochs, longer],
            (None, None) => [o.steps, l.steps],
            _ => return false,
        };
        let [rate, longer_rate] = [o.half_periods, l.half_periods];
        let same_rate = (rate * lengths[1] as f64 - longer_rate * lengths[0] as f64).abs()
            <= 1e-9 * longer_rate * lengths[0] as f64;
        let mut alike = longer.clone();
        alike.optimiser = OptimiserConfig {
            steps: o.steps,
            epochs: o.epochs,
            half_periods: rate,
            ..l.clone()
        };
        // Windows that grow over a run have grown otherwise over a longer one.
        let grows = self.batch.unroll_first != self.batch.unroll_last;
        // The clips of a second fit have pairs, and steps, of their own.
        let has_second_fit = self.validation.refit == Refit::AllClips;
        lengths[1] > lengths[0] && same_rate && alike == *self && !grows && !has_second_fit
    }

    /// Exactly so many steps, whatever number of epochs that is.
    pub fn set_steps(&mut self, steps: u64) {
        (self.optimiser.steps, self.optimiser.epochs) = (steps, None);
    }

    /// Epochs that `steps` make of so many pairs of consecutive frames.
    pub fn epochs_of(&self, steps: u64, pairs: usize) -> f64 {
        steps as f64 * self.pairs_a_step() as f64 / pairs.max(1) as f64
    }

    /// Steps of a training of [`PUBLISHED_EPOCHS`] of so many pairs of consecutive frames.
    pub fn published_steps(&self, pairs: usize) -> u64 {
        self.steps_of(PUBLISHED_EPOCHS, pairs)
    }

    /// These settings with the number of steps that their epochs are, for clips with so many pairs
    /// of consecutive frames.
    pub(crate) fn for_pairs(mut self, pairs: usize) -> Self {
        if let Some(epochs) = self.optimiser.epochs {
            self.optimiser.steps = self.steps_of(epochs, pairs);
        }
        self
    }

    fn steps_of(&self, epochs: u64, pairs: usize) -> u64 {
        let samples = epochs.saturating_mul(pairs as u64);
        samples.div_ceil(self.pairs_a_step()).max(1)
    }

    fn pairs_a_step(&self) -> u64 {
        (self.batch.windows.max(1) * self.batch.unroll_last.max(1)) as u64
    }
}
