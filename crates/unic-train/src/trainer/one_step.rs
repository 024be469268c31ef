//! The error of single steps from ground truth, on clips that are trained on and on those held out.

use super::Trainer;
use crate::{
    batch::{Batch, Sample},
    config::Products,
    error::TrainError,
    event::{Control, Event},
    network::Network,
    rollout::Rollout,
    validation::one_step_rmse_of,
};
use burn::tensor::Tensor;
use std::{sync::Arc, time::Instant};
use unic_core::model::Model;

/// Pairs of frames, and vertices of each, that the error on training clips is measured on: always the same ones.
const SAMPLE: Sample = Sample {
    windows: 512,
    points: 64,
    frames: 1,
};

impl Trainer {
    /// Measures and tells. Nothing is dropped out and no noise is added; intersections are not handled.
    /// `model` has the same `parameters`, for the clips held out.
    pub(super) fn measure_one_step(
        &mut self,
        parameters: &[Vec<f32>],
        model: Option<&Arc<Model>>,
        listen: &mut dyn FnMut(&Event) -> Control,
    ) -> Result<Control, TrainError> {
        let started = Instant::now();
        let training_rmse = self.one_step_in_training(parameters)?;
        let mut proceed = || listen(&Event::Measuring { step: self.step });
        let on_held_out =
            |model| one_step_rmse_of(model, &self.data.validation, self.judged_frames(), &mut proceed);
        let validation_rmse = model.map(on_held_out).transpose()?;
        let seconds = started.elapsed().as_secs_f64();
        self.time.seconds += seconds;
        Ok(listen(&Event::OneStep {
            step: self.step,
            training_rmse,
            validation_rmse,
            seconds,
        }))
    }

    /// RMSE in metres over [`SAMPLE`].
    fn one_step_in_training(&self, parameters: &[Vec<f32>]) -> Result<f64, TrainError> {
        let batch = Batch::sample(&self.data, self.config.seed, SAMPLE);
        let network = Network::with_parameters(&self.shape, parameters, &self.device);
        let rollout = Rollout {
            shape: &self.shape,
            config: &self.data.config,
            loss: &self.config.loss,
            products: Products::F32,
            correction: None,
        };
        let states = rollout.states(&network, &batch, None, &self.device)?;
        // States are made of f32 tensors alone.
        let values = |state: Tensor<2>| state.inner().try_into_vec_as::<f32>().expect("f32 states");
        let predicted = states.into_iter().flat_map(values);
        let pairs = predicted.zip(batch.targets.iter().flatten());
        let squares: f64 = pairs.map(|(x, target)| f64::from(x - target).powi(2)).sum();
        Ok((squares / batch.rows().max(1) as f64).sqrt())
    }
}
