//! Networks of other methods, trained on the same clips, to compare the neural field with.
//!
//! Each network predicts coefficients z_k in a fixed subspace of the whole garment: u = ū + Σ_k z_k
//! φ_k. The φ_k are orthonormal, so that the error in the coefficients is the error in the
//! vertices, and the cost of a step does not depend on the number of vertices.
//! [`config::SurfaceKind`] defines u: displacements from skinning, x_i = LBS_i(rest) + R_i u_i, or
//! positions relative to the root joint, as in the UNIC paper.
//!
//! | [`ComparisonKind`] | inputs | subspace |
//! |---|---|---|
//! | `PoseOnly` | local joint rotations, and gravity in the root's frame | principal components |
//! | `VirtualBones` | motion vectors of half a second | affine transforms of bones |
//! | `GlobalFeature` | code of two motion vectors, garment feature | principal components |
//!
//! - `PoseOnly` stands for the ML deformers of game engines and film tools.
//! - `VirtualBones` follows Pan et al. 2022, "Predicting Loose-Fitting Garment Deformations Using
//!   Bone-Driven Motion Networks".
//! - `GlobalFeature` is the paper's ablation "w/o neural field".
//!
//! The networks differ from their sources where a comparison needs it. By default all predict
//! displacements from the skinned garment in the heading frame, have about as many parameters as
//! preset `standard`, and learn from mirrored motion where skeleton and garment are symmetric.

mod bones;
mod config;
mod features;
mod network;
mod predictor;
mod samples;
mod space;
mod surface;
#[cfg(test)]
mod tests;

pub(crate) use config::{ComparisonConfig, ComparisonKind};
#[cfg(test)]
use config::{MotionElements, SpaceSettings, SurfaceKind};
pub(crate) use predictor::ComparisonPredictor;

use burn::tensor::{Device, Tensor};
use network::{ComparisonNetwork, Shape};
use predictor::Trained;
use samples::Samples;
use std::{sync::Arc, time::Instant};
use unic_core::{motion::MotionSpec, skeleton::Skeleton};
use unic_eval::TrainingSet;
use unic_train::{
    Averaging, Control, Event, Fit, Learner, OptimiserConfig, Outcome, Pace, TrainError, Training, Watch,
};

/// Training of one network.
pub(crate) struct ComparisonTrainer {
    learner: Learner<ComparisonNetwork>,
    training: ComparisonTraining,
}

/// Samples and settings of a training, as the shared training loop needs them.
struct ComparisonTraining {
    config: ComparisonConfig,
    samples: Samples,
    shape: Shape,
    device: Device,
}

impl Training for ComparisonTraining {
    type Network = ComparisonNetwork;
    type Record = ();
    const NETWORK: &'static str = "network of another method";

    fn optimiser(&self) -> &OptimiserConfig {
        &self.config.optimiser
    }

    fn loss(&self, network: &ComparisonNetwork, step: u64) -> Result<Tensor<1>, TrainError> {
        let batch = self.samples.draw(&self.config, &self.shape, step);
        Ok(network.loss(&self.shape, &batch, &self.device))
    }

    fn record(&self) {}
}

impl ComparisonTrainer {
    /// Prepares a training: projects every frame of the training clips onto the subspace. The
    /// motion vectors of `set` follow `spec`, which must have the layout and the velocities of the
    /// settings.
    ///
    /// # Errors
    /// Settings out of range, another `spec`, and clips too short to train on.
    pub(crate) fn new(
        set: &TrainingSet,
        spec: &MotionSpec,
        skeleton: &Skeleton,
        config: ComparisonConfig,
    ) -> Result<Self, TrainError> {
        config.check()?;
        let (expected, found) = ((config.layout, config.velocity), (spec.layout, spec.velocity));
        if expected != found {
            return Err(TrainError::MotionSpec {
                expected: format!("{expected:?}"),
                found: format!("{found:?}"),
            });
        }
        let samples = Samples::new(set, spec, skeleton, &config)?;
        let shape = Shape::new(&config, samples.features.len(), samples.space.dimensions());
        let device = Device::flex().autodiff();
        let network = ComparisonNetwork::new(&shape, config.seed, &device);
        Ok(Self {
            learner: Learner::new(network, Averaging::Off),
            training: ComparisonTraining {
                shape,
                samples,
                config,
                device,
            },
        })
    }

    /// Returns the number of trained parameters. The subspace is not trained.
    pub(crate) fn parameter_count(&self) -> usize {
        self.learner.kept().iter().map(Vec::len).sum()
    }

    /// Returns the number of optimiser steps.
    pub(crate) fn steps(&self) -> u64 {
        self.training.config.optimiser.steps
    }

    /// Sets the number of steps that fit into `seconds`, at least one. It times a few steps.
    ///
    /// # Errors
    /// A training that diverges.
    pub(crate) fn fill(&mut self, seconds: f64) -> Result<(), TrainError> {
        const STEPS: [u64; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
        let started = Instant::now();
        let pace = Pace {
            step: self.learner.seconds_per_step(&self.training, &STEPS)?,
            validation: 0.0,
            last_validation: 0.0,
            judging: 0.0,
        };
        let left = seconds - started.elapsed().as_secs_f64();
        self.training.config.optimiser.steps = pace.steps_within(left, &[Fit::AllClips], 1);
        Ok(())
    }

    /// Trains to the last step.
    ///
    /// # Errors
    /// A training that diverges, and [`TrainError::Stopped`] where `watch` asks to stop.
    pub(crate) fn train(mut self, watch: &Watch) -> Result<ComparisonPredictor, TrainError> {
        let steps = self.steps();
        let mut listen = |event: &Event| match event {
            Event::Step { step, .. } => watch(*step, steps),
            _ => Control::Continue,
        };
        match self.learner.run(&mut self.training, None, &mut listen)? {
            Outcome::Stopped => Err(TrainError::Stopped),
            Outcome::Finished => {
                let training = self.training;
                let trained = Trained::new(&training.shape, &self.learner.kept(), training.samples)?;
                Ok(ComparisonPredictor::new(Arc::new(trained)))
            }
        }
    }
}
