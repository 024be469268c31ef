//! Length of a run, in epochs of its clips or in steps.

use super::{OptimiserConfig, Refit, TrainConfig};

/// Epochs of the published training: the authors' release trains for 400 and uses the checkpoint
/// after 300.
pub const PUBLISHED_EPOCHS: u64 = 300;

impl TrainConfig {
    /// Returns whether `longer` has the same settings for a longer run with the same learning rate
    /// in every common step, up to the rounding of epochs to steps. The half periods of its
    /// schedule must grow in proportion to the epochs, or to the steps. A run of two fits, or
    /// with a sizing, cannot be made longer.
    pub fn is_lengthened_by(&self, longer: &Self) -> bool {
        let (o, l) = (&self.optimiser, &longer.optimiser);
        let lengths = match (o.epochs, l.epochs) {
            (Some(epochs), Some(longer)) => [epochs, longer],
            (None, None) => [o.steps, l.steps],
            _ => return false,
        };
        let [rate, longer_rate] = [o.half_periods, l.half_periods];
        // Half periods per epoch or step, compared by cross-multiplication. The tolerance covers
        // rounding.
        let same_rate = (rate * lengths[1] as f64 - longer_rate * lengths[0] as f64).abs()
            <= 1e-9 * longer_rate * lengths[0] as f64;
        let mut alike = longer.clone();
        alike.optimiser = OptimiserConfig {
            steps: o.steps,
            epochs: o.epochs,
            half_periods: rate,
            ..l.clone()
        };
        // The length of windows depends on the share of the run that is done, so the same step of a
        // longer run has shorter windows.
        let grows = self.batch.unroll_first != self.batch.unroll_last;
        // A second fit has other clips, and so another number of pairs and steps.
        let has_second_fit = self.validation.refit == Refit::AllClips;
        // The limit on the steps decides which fields a sizing tries.
        let is_sized = !self.sizing.sizes.is_empty();
        lengths[1] > lengths[0] && same_rate && alike == *self && !grows && !has_second_fit && !is_sized
    }

    /// Sets the number of steps and removes the number of epochs.
    pub fn set_steps(&mut self, steps: u64) {
        (self.optimiser.steps, self.optimiser.epochs) = (steps, None);
    }

    /// Returns the number of epochs that `steps` are on clips with `pairs` pairs of consecutive
    /// frames.
    pub fn epochs_of(&self, steps: u64, pairs: usize) -> f64 {
        steps as f64 * self.pairs_a_step() as f64 / pairs.max(1) as f64
    }

    /// Returns the number of steps of [`PUBLISHED_EPOCHS`] on clips with `pairs` pairs of
    /// consecutive frames.
    pub fn published_steps(&self, pairs: usize) -> u64 {
        self.steps_of(PUBLISHED_EPOCHS, pairs)
    }

    /// Computes the number of steps from the epochs, if there are any, for clips with `pairs` pairs
    /// of consecutive frames.
    pub(crate) fn for_pairs(mut self, pairs: usize) -> Self {
        if let Some(epochs) = self.optimiser.epochs {
            self.optimiser.steps = self.steps_of(epochs, pairs);
        }
        self
    }

    fn steps_of(&self, epochs: u64, pairs: usize) -> u64 {
        let samples = epochs.saturating_mul(pairs as u64);
        // Rounded up, so that a run has at least the epochs that were asked for.
        samples.div_ceil(self.pairs_a_step()).max(1)
    }

    fn pairs_a_step(&self) -> u64 {
        (self.batch.windows.max(1) * self.batch.unroll_last.max(1)) as u64
    }
}
