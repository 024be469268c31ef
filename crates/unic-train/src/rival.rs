//! Networks to compare with: what others do instead of a neural field, trained on the same clips.
//!
//! All of them give coefficients in a fixed subspace, the whole garment at once: u = ū + Σ_k z_k φ_k. The φ are
//! orthonormal, so that the loss in the coefficients is the loss in the vertices, and a step costs no vertex. What u
//! holds of the garment is the settings' [`SurfaceKind`]: displacements from skinning, x_i = LBS_i(rest) + R_i u_i, or
//! positions relative to the root joint, as the paper has them.
//!
//! | [`RivalKind`] | reads | subspace |
//! |---|---|---|
//! | `PoseOnly`: ML deformers of game engines and film tools | the pose: local joint rotations, gravity in the root's frame | principal components |
//! | `VirtualBones`: after Pan et al. 2022, "Predicting Loose-Fitting Garment Deformations Using Bone-Driven Motion Networks" | motion vectors of half a second | affine transforms of smoothly weighted bones |
//! | `GlobalFeature`: the paper's ablation "w/o neural field" | categorical code of two motion vectors, a feature of the garment before | principal components |
//!
//! Where they depart from their sources, it is to be comparable. By default all stand on the skinned garment in the
//! heading frame, have about as many parameters as preset `standard`, and learn from mirrored motion where
//! skeleton and garment are symmetric.

mod bones;
mod config;
mod features;
mod network;
mod predictor;
mod samples;
mod space;
mod surface;

pub use config::{GlobalFeatureSettings, MotionElements, RivalConfig, RivalKind, SpaceSettings, SurfaceKind};
pub use predictor::RivalPredictor;

use crate::{
    error::TrainError,
    event::Control,
    fit::Fit,
    optimiser::{Moments, update},
    recurrence::Watch,
    trainer::Pace,
};
use burn::optim::GradientsParams;
use burn::tensor::Device;
use network::{RivalNetwork, Shape};
use predictor::Trained;
use samples::Samples;
use std::{sync::Arc, time::Instant};
use unic_core::{motion::MotionSpec, skeleton::Skeleton};
use unic_eval::TrainingSet;

/// One training of one network.
pub struct RivalTrainer {
    config: RivalConfig,
    samples: Samples,
    shape: Shape,
    network: RivalNetwork,
    moments: Moments,
    device: Device,
}

impl RivalTrainer {
    /// Reads every frame of the training clips once. The motion vectors of `set` are those of `spec`, which has the
    /// settings' layout and velocity.
    ///
    /// # Errors
    /// Settings out of range, clips too short to train on.
    pub fn new(
        set: &TrainingSet,
        spec: &MotionSpec,
        skeleton: &Skeleton,
        config: RivalConfig,
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
        let network = RivalNetwork::new(&shape, config.seed, &device);
        Ok(Self {
            moments: Moments::zeros(network.values().iter().map(Vec::len)),
            network,
            shape,
            samples,
            config,
            device,
        })
    }

    /// Numbers that training moves; the subspace is none of them.
    pub fn parameter_count(&self) -> usize {
        self.network.values().iter().map(Vec::len).sum()
    }

    /// Optimiser steps of the training.
    pub fn steps(&self) -> u64 {
        self.config.optimiser.steps
    }

    /// Takes as many steps as fit into `seconds`, one at least: times a few, which are not kept.
    ///
    /// # Errors
    /// As [`RivalTrainer::train`].
    pub fn fill(&mut self, seconds: f64) -> Result<(), TrainError> {
        const SAMPLES: u64 = 8;
        let started = Instant::now();
        let (mut network, mut moments) = (self.network.clone(), self.moments.clone());
        self.step(&mut network, &mut moments, 0)?;
        let timed = Instant::now();
        for step in 1..=SAMPLES {
            self.step(&mut network, &mut moments, step)?;
        }
        let pace = Pace {
            step: timed.elapsed().as_secs_f64() / SAMPLES as f64,
            validation: 0.0,
            last_validation: 0.0,
        };
        let left = seconds - started.elapsed().as_secs_f64();
        self.config.optimiser.steps = pace.steps_within(left, &[Fit::AllClips], 1);
        Ok(())
    }

    /// Trains to the last step.
    ///
    /// # Errors
    /// A loss that is no number, a watch that says stop.
    pub fn train(mut self, watch: &Watch) -> Result<RivalPredictor, TrainError> {
        let steps = self.steps();
        for step in 0..steps {
            let (mut network, mut moments) = (
                std::mem::take(&mut self.network),
                std::mem::take(&mut self.moments),
            );
            self.step(&mut network, &mut moments, step)?;
            (self.network, self.moments) = (network, moments);
            if watch(step + 1, steps) == Control::Stop {
                return Err(TrainError::Stopped);
            }
        }
        let trained = Trained::new(&self.shape, &self.network.values(), self.samples)?;
        Ok(RivalPredictor::new(Arc::new(trained)))
    }

    /// A function of the parameters, the moments, the seed and the step.
    fn step(&self, network: &mut RivalNetwork, moments: &mut Moments, step: u64) -> Result<(), TrainError> {
        let batch = self.samples.draw(&self.config, &self.shape, step);
        let loss = network.loss(&self.shape, &batch, &self.device);
        let value = loss.clone().into_scalar::<f32>();
        let diverged = |what, value| TrainError::Diverged { step, what, value };
        if !value.is_finite() {
            return Err(diverged("loss", value.into()));
        }
        let gradients = GradientsParams::from_grads(loss.backward(), network);
        let optimiser = &self.config.optimiser;
        let rate = optimiser.learning_rate(step);
        let norm = update(network, gradients, moments, optimiser, rate, step)?;
        match norm.is_finite() {
            true => Ok(()),
            false => Err(diverged("gradient's norm", norm)),
        }
    }
}
