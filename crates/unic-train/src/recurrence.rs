//! Trains the recurrence of a prior: the part that remembers the motion.
//!
//! The linear map of a prior is fitted in closed form. A [`Recurrence`] learns the same K
//! coefficients beside it; a frame costs only the small network. Both are blended with the
//! shares that do best on motions which neither has seen. The recurrence learns the coefficients
//! themselves, and not the residual of the linear map: on an unseen motion that residual is mostly
//! noise of that motion alone.

mod blend;
mod head;
mod human_motion;
mod pretrained;
mod pretraining;
mod scan;
mod sequence;
mod sizes;
mod swing;
mod unit;
mod unit_training;
mod watch;
mod windows;

pub use pretrained::PretrainedUnit;
pub(crate) use pretrained::UnitStart;
pub use pretraining::Pretraining;
pub(crate) use sequence::Sequence;
pub(crate) use unit_training::{PriorSizes, frames_per_second};
pub use watch::Watch;

use crate::{
    config::{RecurrenceSettings, RecurrenceStart},
    error::TrainError,
};
use blend::Blend;
use burn::tensor::Device;
use head::HeadStart;
use rayon::prelude::*;
use sequence::motion_count;
use sizes::Sizes;
use std::path::Path;
use swing::Swings;
use unic_core::recurrence::Recurrence;
use unit_training::UnitTraining;
use watch::Progress;

/// A recurrence that improves the prior.
pub(crate) struct FittedRecurrence {
    /// Trained on all sequences. Its outputs are scaled by their shares in the blend.
    pub(crate) recurrence: Recurrence,
    /// Start of the training.
    pub(crate) start: RecurrenceStart,
    /// Share of the linear map in each of the K coefficients of the blend, 0 to 1.
    pub(crate) linear_shares: Vec<f32>,
    /// Blended coefficients of each sequence, T × K, predicted without the sequence's motion. Their
    /// swings are not amplified: a field would learn to damp them.
    pub(crate) left_out: Vec<Vec<f32>>,
    /// Recurrences, one per fold, each trained without the fold's motions. They are scaled by the
    /// same shares, and their swings are not amplified.
    folds: Vec<Option<Recurrence>>,
}

impl FittedRecurrence {
    /// The recurrence trained without a motion. None where there was no other motion to train on.
    pub(crate) fn without(&self, motion_number: usize) -> Option<&Recurrence> {
        self.folds[fold_of(motion_number, self.folds.len())].as_ref()
    }
}

/// Result of training recurrences.
pub(crate) struct RecurrenceFit {
    /// None if a recurrence does not improve on the linear map on motions left out.
    pub(crate) fitted: Option<FittedRecurrence>,
    /// Seconds of training before this process, which checkpoints have restored.
    pub(crate) restored_seconds: f64,
}

/// Largest number of folds for cross-validation. Two would judge a small capture by half of its
/// motion.
pub(crate) const MOST_FOLDS: usize = 5;

/// The fold that a motion belongs to.
fn fold_of(motion_number: usize, folds: usize) -> usize {
    motion_number % folds
}

/// Trains recurrences: one without each fold, then the one that the model gets.
pub(crate) struct RecurrenceTrainer<'a> {
    /// Sizes and training.
    pub(crate) settings: &'a RecurrenceSettings,
    /// First values of the parameters but for the last map, if not random.
    pub(crate) start: Option<UnitStart>,
    /// Seed of the random streams.
    pub(crate) seed: u64,
    /// Ticks per second.
    pub(crate) fps: f32,
    /// Device of the training, with gradients.
    pub(crate) device: &'a Device,
    /// Folder for checkpoints, one subfolder each.
    pub(crate) folder: Option<&'a Path>,
}

impl RecurrenceTrainer<'_> {
    /// Trains on `sequences`.
    ///
    /// # Errors
    /// A training that diverges; [`TrainError::Stopped`] where `watch` answers stop.
    pub(crate) fn run(&self, sequences: &[Sequence], watch: &Watch) -> Result<RecurrenceFit, TrainError> {
        let steps = self.settings.steps_for(sequences.iter().map(Sequence::len).sum());
        // At least two folds: a lone motion is in fold 0, which then has nothing to train on and
        // leaves the prediction to the linear map.
        let count = motion_count(sequences).clamp(2, MOST_FOLDS);
        // As many samples per frame as the training on all motions has.
        let fold_steps = (steps * (count as u64 - 1)).div_ceil(count as u64);
        let progress = Progress::new(count as u64 * fold_steps + steps, watch);
        let at_once = rayon::current_num_threads().min(count);
        let head = HeadStart::of(sequences, self.fps);
        let others = |fold: usize| -> Vec<&Sequence> {
            let is_other = |s: &&Sequence| fold_of(s.motion_number, count) != fold;
            sequences.iter().filter(is_other).collect()
        };
        let folds = (0..count).into_par_iter().map(|fold| {
            let name = format!("without_{fold}");
            self.train(&name, fold_steps, &others(fold), head, at_once, &progress)
        });
        let folds = folds.collect::<Result<Vec<_>, TrainError>>()?;
        let predicted = |s: &Sequence| match &folds[fold_of(s.motion_number, count)] {
            Some(recurrence) => s.predicted_by(recurrence),
            None => s.linear.clone(),
        };
        let Some(blend) = Blend::fit(sequences, sequences.par_iter().map(predicted).collect()) else {
            return Ok(RecurrenceFit {
                fitted: None,
                restored_seconds: progress.restored_seconds(),
            });
        };
        let swings = Swings {
            wanted: self.settings.swing,
            shares: &blend.recurrence_shares,
            fps: self.fps,
        };
        let amplified = swings.amplified(sequences, &blend.left_out);
        let all: Vec<&Sequence> = amplified.iter().collect();
        let recurrence = self.train("all", steps, &all, head, 1, &progress)?;
        let start = match self.start(&all) {
            Some(_) => RecurrenceStart::Pretrained,
            None => RecurrenceStart::Random,
        };
        let fitted = recurrence.map(|recurrence| FittedRecurrence {
            start,
            recurrence: blend.weighted(recurrence),
            folds: folds
                .into_iter()
                .map(|fold| fold.map(|r| blend.weighted(r)))
                .collect(),
            linear_shares: blend.linear_shares(),
            left_out: blend.left_out,
        });
        Ok(RecurrenceFit {
            fitted,
            restored_seconds: progress.restored_seconds(),
        })
    }

    /// First values of a unit that is trained on sequences; none for random numbers.
    fn start(&self, sequences: &[&Sequence]) -> Option<&UnitStart> {
        let sizes = Sizes::new(self.settings, sequences.first()?);
        self.start.as_ref().filter(|start| start.fits(sizes))
    }

    /// Trains one recurrence; `name` is that of its folder of checkpoints.
    fn train(
        &self,
        name: &str,
        steps: u64,
        sequences: &[&Sequence],
        head: HeadStart,
        at_once: usize,
        progress: &Progress,
    ) -> Result<Option<Recurrence>, TrainError> {
        let folder = self.folder.map(|folder| folder.join(name));
        let start = self.start(sequences);
        let training = UnitTraining {
            settings: self.settings,
            start,
            head: start.map_or(HeadStart::Random, |_| head),
            steps,
            seed: self.seed,
            fps: self.fps,
            device: self.device,
            at_once,
            folder: folder.as_deref(),
        };
        let trained = training.run(sequences, progress)?;
        Ok(trained.map(|unit| unit.recurrence()))
    }
}
