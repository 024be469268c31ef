//! Networks of other methods, trained on the same clips, to compare the neural field with.
//!
//! Each predicts coefficients in a fixed subspace of the whole garment: u = ū + Σ_k z_k φ_k. The φ
//! are orthonormal, so the loss in the coefficients is the loss in the vertices, and a step costs
//! no vertex. The settings' [`config::SurfaceKind`] says what u is: displacements from skinning, x_i =
//! LBS_i(rest) + R_i u_i, or positions relative to the root joint, as in the UNIC paper.
//!
//! | [`ComparisonKind`] | reads | subspace |
//! |---|---|---|
//! | `PoseOnly`: ML deformers of game engines and film tools | the pose: local joint rotations, gravity in the root's frame | principal components |
//! | `VirtualBones`: after Pan et al. 2022, "Predicting Loose-Fitting Garment Deformations Using Bone-Driven Motion Networks" | motion vectors of half a second | affine transforms of smoothly weighted bones |
//! | `GlobalFeature`: the paper's ablation "w/o neural field" | categorical code of two motion vectors, one feature of the garment in the frame before | principal components |
//!
//! They depart from their sources only to be comparable. By default all predict displacements from
//! the skinned garment in the heading frame, have about as many parameters as preset `standard`,
//! and learn from mirrored motion where skeleton and garment are symmetric.

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

/// One training of one network.
pub(crate) struct ComparisonTrainer {
    learner: Learner<ComparisonNetwork>,
    training: ComparisonTraining,
}

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
    /// Projects every frame of the training clips to the subspace. The motion vectors of `set` are
    /// those of `spec`, which has the settings' layout and velocity.
    ///
    /// # Errors
    /// Settings out of range, clips too short to train on.
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

    /// Number of trained parameters. The subspace is not trained.
    pub(crate) fn parameter_count(&self) -> usize {
        self.learner.kept().iter().map(Vec::len).sum()
    }

    /// Optimiser steps of the training.
    pub(crate) fn steps(&self) -> u64 {
        self.training.config.optimiser.steps
    }

    /// Sets the number of steps to those that fit into `seconds`, after timing a few; at least one.
    ///
    /// # Errors
    /// The errors of [`ComparisonTrainer::train`].
    pub(crate) fn fill(&mut self, seconds: f64) -> Result<(), TrainError> {
        const STEPS: [u64; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
        let started = Instant::now();
        let pace = Pace {
            step: self.learner.seconds_per_step(&self.training, &STEPS)?,
            validation: 0.0,
            last_validation: 0.0,
        };
        let left = seconds - started.elapsed().as_secs_f64();
        self.training.config.optimiser.steps = pace.steps_within(left, &[Fit::AllClips], 1);
        Ok(())
    }

    /// Trains to the last step.
    ///
    /// # Errors
    /// A training that diverges; [`TrainError::Stopped`] where `watch` answers stop.
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
