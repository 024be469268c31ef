//! One training of one candidate without a fold, and its judgement.

use super::{
    folds::Fold,
    judge::{Judge, MotionErrors},
};
use crate::{
    batch::Batch,
    checkpoint::Checkpoint,
    config::{OptimiserConfig, TrainConfig},
    error::TrainError,
    event::{Control, Event, Outcome},
    field_data::FieldData,
    learner::{Averaging, Learner, Training},
    network::{Network, NetworkShape, StepNoise},
    rollout::Rollout,
};
use burn::tensor::{Device, Tensor};
use serde::{Deserialize, Serialize};
use std::{fs, path::Path};
use unic_core::config::ModelConfig;

/// Trial of a candidate on one fold.
pub(super) struct Trial<'a> {
    pub(super) data: &'a FieldData,
    /// Settings of the run with the candidate's size and steps.
    pub(super) config: TrainConfig,
    pub(super) device: &'a Device,
    pub(super) fold: &'a Fold,
    /// Folder for checkpoints of this trial.
    pub(super) folder: Option<&'a Path>,
}

/// Description of a trial in its checkpoints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TrialRecord {
    config: TrainConfig,
}

impl Trial<'_> {
    /// Trains, from the newest checkpoint on if there is one, and judges. `add` counts steps and
    /// answers whether to go on.
    ///
    /// # Errors
    /// A training that diverges, a stop, a checkpoint of another training.
    pub(super) fn run(&self, add: &dyn Fn(u64) -> Control) -> Result<MotionErrors, TrainError> {
        let model = ModelConfig {
            field: self.config.model.field,
            ..self.data.config.clone()
        };
        let shape = NetworkShape::new(&model, self.data.capture.character.skeleton.len());
        shape.field.validate()?;
        let mut objective = Objective {
            trial: self,
            model: &model,
            shape: &shape,
        };
        let network = Network::new(&shape, self.config.seed, self.device);
        let mut learner = Learner::new(network, Averaging::of(&self.config.regularisation));
        self.resume(&mut learner)?;
        go_on(add(learner.step()))?;
        let mut listen = |event: &Event| match event {
            Event::Step { .. } => add(1),
            _ => Control::Continue,
        };
        if learner.run(&mut objective, self.folder, &mut listen)? == Outcome::Stopped {
            return Err(TrainError::Stopped);
        }
        let judge = Judge {
            data: self.data,
            seed: self.config.seed,
            rollout: objective.rollout(),
            device: self.device,
        };
        let network = Network::with_parameters(&shape, &learner.kept(), self.device);
        let errors = self.fold.held_out.iter().map(|stretch| {
            go_on(add(0))?;
            judge.errors(&network, stretch)
        });
        errors.collect()
    }

    fn resume(&self, learner: &mut Learner<Network>) -> Result<(), TrainError> {
        let Some(folder) = self.folder else { return Ok(()) };
        let wrong = |found: &str| TrainError::Checkpoint {
            path: folder.to_owned(),
            found: found.to_owned(),
        };
        match Checkpoint::<TrialRecord>::newest(folder)? {
            None => Ok(()),
            Some(checkpoint) if checkpoint.record.config.with_products_of(&self.config) != self.config => {
                Err(wrong("one of other settings"))
            }
            Some(checkpoint) => learner.restore(&checkpoint).map_err(wrong),
        }
    }
}

/// Removes the checkpoints of a trial whose result is stored.
pub(super) fn remove(folder: &Path) {
    // Checkpoints that cannot be removed are only in the way.
    let _ = fs::remove_dir_all(folder);
}

fn go_on(control: Control) -> Result<(), TrainError> {
    match control {
        Control::Continue => Ok(()),
        Control::Stop => Err(TrainError::Stopped),
    }
}

/// Loss of a trial, the same as that of a fit, on the fold's training motion.
struct Objective<'a> {
    trial: &'a Trial<'a>,
    model: &'a ModelConfig,
    shape: &'a NetworkShape,
}

impl<'a> Objective<'a> {
    fn rollout(&self) -> Rollout<'a> {
        Rollout {
            shape: self.shape,
            config: self.model,
            loss: &self.trial.config.loss,
            products: self.trial.config.optimiser.products,
        }
    }
}

impl Training for Objective<'_> {
    type Network = Network;
    type Record = TrialRecord;
    const NETWORK: &'static str = "deformation field";

    fn optimiser(&self) -> &OptimiserConfig {
        &self.trial.config.optimiser
    }

    fn loss(&self, network: &Network, step: u64) -> Result<Tensor<1>, TrainError> {
        let config = &self.trial.config;
        let batch = Batch::gather_from(self.trial.data, &self.trial.fold.train, config, step);
        let rows = batch.encoder_rows();
        let noise = StepNoise::draw(self.shape, &config.regularisation, rows, config.seed, step);
        self.rollout()
            .loss(network, &batch, Some(&noise), self.trial.device)
    }

    fn record(&self) -> TrialRecord {
        TrialRecord {
            config: self.trial.config.clone(),
        }
    }
}
