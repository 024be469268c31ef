//! Loss and measurements of the encoder and the deformation field.

use super::{measurement, resume::FieldRecord};
use crate::{
    batch::Batch,
    config::{OptimiserConfig, TrainConfig},
    error::TrainError,
    event::{Control, Event},
    field_data::FieldData,
    learner::{Learner, Listen, Training},
    network::{Network, NetworkShape, StepNoise, model_layers},
    rollout::Rollout,
    sizing::Sizing,
    time::TrainingTime,
    validation::{Chosen, Validation, free_running_rmse_of, one_step_rmse_of},
};
use burn::tensor::{Device, Tensor};
use serde_json::json;
use std::{sync::Arc, time::Instant};
use unic_core::{
    config::StateConfig,
    model::{About, Model, ModelParts},
};
use unic_eval::PreparedClip;

/// Training of a model's networks on the data of one fit.
pub(super) struct FieldTraining {
    pub(super) config: TrainConfig,
    pub(super) data: FieldData,
    pub(super) shape: NetworkShape,
    pub(super) device: Device,
    /// Smallest free-running error so far, in metres.
    pub(super) best_rmse: Option<f64>,
    /// Seconds that the prior's training took.
    pub(super) prior_seconds: f64,
    /// Training time of the run's other fits.
    pub(super) other: TrainingTime,
    /// Validation that the model file records.
    pub(super) validation: Option<Validation>,
    /// Choice of the field's size, which the model file records.
    pub(super) sizing: Option<Sizing>,
}

impl Training for FieldTraining {
    type Network = Network;
    type Record = FieldRecord;
    const NETWORK: &'static str = "deformation field";

    fn optimiser(&self) -> &OptimiserConfig {
        &self.config.optimiser
    }

    fn loss(&self, network: &Network, step: u64) -> Result<Tensor<1>, TrainError> {
        let config = &self.config;
        let batch = Batch::gather(&self.data, config, step);
        let noise = StepNoise::draw(
            &self.shape,
            &config.regularisation,
            batch.encoder_rows(),
            config.seed,
            step,
        );
        let rollout = Rollout {
            shape: &self.shape,
            config: &self.data.config,
            loss: &config.loss,
            products: config.optimiser.products,
        };
        rollout.loss(network, &batch, Some(&noise), &self.device)
    }

    fn measures_after(&self, steps_done: u64) -> bool {
        let is_last = steps_done == self.config.optimiser.steps;
        is_last || steps_done.is_multiple_of(self.config.validation.every)
    }

    /// Measures the error of one step, and in free running where clips are held out.
    fn measure(&mut self, learner: &Learner<Network>, listen: &mut Listen) -> Result<Control, TrainError> {
        let (step, parameters) = (learner.step(), learner.kept());
        let model = match self.validates() {
            true => Some(Arc::new(self.model(
                step,
                learner.seconds(),
                &parameters,
                self.chosen(),
            )?)),
            false => None,
        };
        let control = self.measure_one_step(step, &parameters, model.as_ref(), listen)?;
        match model {
            Some(model) => Ok(control.and(self.measure_free_running(step, &model, listen)?)),
            None => Ok(control),
        }
    }

    fn record(&self) -> FieldRecord {
        FieldRecord {
            fit: self.data.fit,
            config: self.config.clone(),
            prior_seconds: self.prior_seconds,
            best_rmse: self.best_rmse,
        }
    }
}

impl FieldTraining {
    /// Values of the model before a validation: the share that a sizing has chosen, else the whole
    /// field.
    pub(super) fn chosen(&self) -> Chosen {
        let share = self.sizing.as_ref().map(|sizing| sizing.share);
        Chosen {
            field_share: share.unwrap_or(Chosen::SETTINGS.field_share),
            ..Chosen::SETTINGS
        }
    }

    /// Returns whether there is any clip to validate on.
    pub(super) fn validates(&self) -> bool {
        !self.data.validation.is_empty()
    }

    /// Measures single steps from the true frame before. Nothing is dropped out, no noise is added
    /// and intersections are not handled. `model` has the same `parameters`, for the clips held
    /// out.
    fn measure_one_step(
        &self,
        step: u64,
        parameters: &[Vec<f32>],
        model: Option<&Arc<Model>>,
        listen: &mut Listen,
    ) -> Result<Control, TrainError> {
        let started = Instant::now();
        let network = Network::with_parameters(&self.shape, parameters, &self.device);
        let rollout = Rollout {
            shape: &self.shape,
            config: &self.data.config,
            loss: &self.config.loss,
            products: Default::default(),
        };
        let training_rmse =
            measurement::training_rmse(&self.data, self.config.seed, &rollout, &network, &self.device)?;
        let mut proceed = || listen(&Event::Measuring { step });
        let frames = measurement::judged_frames(&self.data);
        let on_held_out = |model| one_step_rmse_of(model, &self.data.validation, frames, &mut proceed);
        let validation_rmse = model.map(on_held_out).transpose()?;
        Ok(listen(&Event::OneStep {
            step,
            training_rmse,
            validation_rmse,
            seconds: started.elapsed().as_secs_f64(),
        }))
    }

    fn measure_free_running(
        &mut self,
        step: u64,
        model: &Arc<Model>,
        listen: &mut Listen,
    ) -> Result<Control, TrainError> {
        let started = Instant::now();
        // The answer is of no interest: the first frame of the measurement asks again.
        let _ = listen(&Event::Previewed { step, model });
        let mut proceed = || listen(&Event::Measuring { step });
        let (clips, intersection) = (&self.data.validation, model.config().intersection);
        let rmse = free_running_rmse_of(model, clips, usize::MAX, intersection, &mut proceed)?;
        // An error that is not finite is no result, and JSON cannot hold it.
        let is_best = rmse.is_finite() && self.best_rmse.is_none_or(|best| rmse < best);
        if is_best {
            self.best_rmse = Some(rmse);
        }
        Ok(listen(&Event::Validated {
            step,
            rmse,
            best: self.best_rmse.unwrap_or(rmse),
            seconds: started.elapsed().as_secs_f64(),
        }))
    }

    /// The model with these parameters and the values that a validation chooses.
    pub(super) fn model(
        &self,
        step: u64,
        seconds: f64,
        parameters: &[Vec<f32>],
        chosen: Chosen,
    ) -> Result<Model, TrainError> {
        let capture = &self.data.capture;
        let (encoder, mut field) = model_layers(&self.shape, parameters);
        let mut config = self.data.config.clone();
        if let Some(projection) = &mut config.projection {
            projection.bending = chosen.bending.unwrap_or(projection.bending);
            projection.order = chosen.order.unwrap_or(projection.order);
        }
        let chord_deviations = chosen
            .chord_deviations
            .unwrap_or_else(|| self.config.projection.first_chord_deviations());
        let mut prior = self.data.prior.clone();
        chosen.scale_replay(&mut prior)?;
        let Chosen { field_share, .. } = chosen;
        if let (StateConfig::Displacement(state), Some(last)) = (&mut config.state, field.last_mut()) {
            last.scale(field_share);
            // The limit applies to the scaled output. Without any output it has no effect and stays
            // above zero.
            state.output_limit *= if field_share > 0.0 { field_share } else { 1.0 };
            // What a field adds has to decay.
            if field_share != 0.0 {
                state.excursion_m = None;
            }
        }
        Ok(Model::new(ModelParts {
            config,
            character: capture.character.clone(),
            garment: capture.garment.clone(),
            prior,
            rest_box: self.data.rest_box,
            normalisation: self.data.normalisation.clone(),
            encoder,
            field,
            strain_limits: self.data.strain.limits(chord_deviations),
            about: About {
                name: capture.manifest.name.clone(),
                provenance: capture.manifest.provenance.clone(),
                training: self.account(step, seconds),
            },
        })?)
    }

    /// Training time of this fit after so many seconds of steps and measurements.
    pub(super) fn time(&self, seconds: f64) -> TrainingTime {
        TrainingTime {
            seconds: self.prior_seconds + seconds,
            prior_seconds: self.prior_seconds,
        }
    }

    /// The model file's record of its training.
    fn account(&self, step: u64, seconds: f64) -> serde_json::Value {
        let time = self.other + self.time(seconds);
        json!({
            "program": concat!("unic ", env!("CARGO_PKG_VERSION")),
            "settings": self.config,
            "fit": self.data.fit,
            "training_clips": names(&self.data.clips),
            "steps": step,
            "seconds": time.seconds,
            "prior_seconds": time.prior_seconds,
            "sizing": self.sizing,
            "validation": self.validation,
        })
    }
}

/// Names of clips.
pub(super) fn names(clips: &[PreparedClip]) -> Vec<String> {
    clips.iter().map(|clip| clip.name().to_owned()).collect()
}
