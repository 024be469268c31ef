//! Trains the encoder and the deformation field of one fit.

mod export;
mod field_training;
mod measurement;
mod pace;
mod resume;
mod shown;
#[cfg(test)]
mod tests;

pub use pace::Pace;
pub use resume::FieldRecord;

use crate::{
    checkpoint::Checkpoint,
    config::TrainConfig,
    device,
    error::TrainError,
    event::{Control, Event, Outcome},
    field_data::FieldData,
    learner::{Averaging, Learner},
    network::{Network, NetworkShape},
    processor::Processor,
    sizing::Sizing,
    time::TrainingTime,
};
use field_training::FieldTraining;
use std::path::Path;

/// One fit of a run: its data, its networks and their training.
pub struct Trainer {
    learner: Learner<Network>,
    field: FieldTraining,
}

impl Trainer {
    /// Starts a fit on the CPU.
    ///
    /// # Errors
    /// Settings that fit no network, clips too short to train on.
    pub fn new(data: FieldData, config: TrainConfig) -> Result<Self, TrainError> {
        Self::on(Processor::Cpu, data, config)
    }

    /// Starts a fit on a processor with the field that a sizing has chosen. Its validation keeps the
    /// chosen share, which several clips have judged.
    ///
    /// # Errors
    /// The errors of [`Trainer::on`].
    pub fn sized(
        processor: Processor,
        mut data: FieldData,
        config: &TrainConfig,
        sizing: Option<&Sizing>,
    ) -> Result<Self, TrainError> {
        let config = match sizing {
            Some(sizing) => sizing.applied_to(config),
            None => config.clone(),
        };
        data.set_field(config.model.field);
        let mut trainer = Self::on(processor, data, config)?;
        trainer.field.sizing = sizing.cloned();
        Ok(trainer)
    }

    /// Starts a fit on a processor.
    ///
    /// # Errors
    /// The errors of [`Trainer::new`]; a processor that is not there, or that lacks the settings'
    /// products.
    pub fn on(processor: Processor, data: FieldData, config: TrainConfig) -> Result<Self, TrainError> {
        config.check()?;
        device::check(config.optimiser.products, processor)?;
        let config = config.for_pairs(data.frame_pairs());
        if data.longest_unroll() == 0 {
            let lengths = data.clips.iter().map(unic_eval::PreparedClip::len);
            return Err(TrainError::ShortClip {
                capture: data.capture.root.clone(),
                frames: lengths.min().unwrap_or(0),
            });
        }
        let shape = NetworkShape::new(&data.config, data.capture.character.skeleton.len());
        shape.field.validate()?;
        let device = device::open(processor)?;
        let network = Network::new(&shape, config.seed, &device);
        let averaging = Averaging::of(&config.regularisation);
        Ok(Self {
            learner: Learner::new(network, averaging),
            field: FieldTraining {
                prior_seconds: data.prior_seconds,
                best_rmse: None,
                other: TrainingTime::default(),
                validation: None,
                sizing: None,
                config,
                data,
                shape,
                device,
            },
        })
    }

    /// The networks with the parameters of the newest step. Their sizes are [`NetworkShape::new`]
    /// of the data's configuration.
    pub fn network(&self) -> &Network {
        self.learner.network()
    }

    /// Settings of the run, which all of its fits share.
    pub fn config(&self) -> &TrainConfig {
        &self.field.config
    }

    /// Clips, prior and measured scales.
    pub fn data(&self) -> &FieldData {
        &self.field.data
    }

    /// Calls `work` with the data of all clips that the run trains on.
    pub(crate) fn on_all_known_clips<T>(&mut self, work: impl FnOnce(&FieldData) -> T) -> T {
        self.field.data.on_all_known_clips(work)
    }

    /// Returns the data for another training.
    pub fn into_data(self) -> FieldData {
        self.field.data
    }

    /// Number of steps done.
    pub fn step(&self) -> u64 {
        self.learner.step()
    }

    /// Training time of this fit so far, over all resumes, with that of its prior.
    pub fn time(&self) -> TrainingTime {
        self.field.time(self.learner.seconds())
    }

    /// Sets the training time of the run's other fits and of their validation. The model file
    /// records the sum.
    pub fn set_other_time(&mut self, other: TrainingTime) {
        self.field.other = other;
    }

    /// Runs to the last step, or until a listener answers stop. With a folder, checkpoints go
    /// there.
    ///
    /// # Errors
    /// A loss that is not finite, a folder that cannot be written to.
    pub fn run(
        &mut self,
        folder: Option<&Path>,
        listen: &mut dyn FnMut(&Event) -> Control,
    ) -> Result<Outcome, TrainError> {
        self.learner.run(&mut self.field, folder, listen)
    }

    /// Continues from a checkpoint of the same fit with the same settings. The result is that of an
    /// uninterrupted run where the product format is unchanged. The run may be a longer one, see
    /// [`TrainConfig::is_lengthened_by`].
    ///
    /// # Errors
    /// A checkpoint of another fit, other settings or another network.
    pub fn resume(&mut self, checkpoint: Checkpoint<FieldRecord>, path: &Path) -> Result<(), TrainError> {
        let wrong = |found: &str| TrainError::Checkpoint {
            path: path.to_owned(),
            found: found.to_owned(),
        };
        let record = &checkpoint.record;
        record
            .check(self.field.data.fit, &self.field.config)
            .map_err(wrong)?;
        self.learner.restore(&checkpoint).map_err(wrong)?;
        self.field.best_rmse = record.best_rmse;
        self.field.prior_seconds = record.prior_seconds;
        Ok(())
    }
}
