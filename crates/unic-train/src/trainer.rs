//! The training loop. It emits events; command line, log and tests listen.

mod resume;

use crate::{
    batch::Batch,
    config::{Keep, TrainConfig},
    correction::{Bodies, Correction},
    dataset::Dataset,
    error::TrainError,
    event::{Control, Event, Outcome},
    network::{Network, NetworkShape, StepNoise, model_layers},
    optimiser::{Moments, update},
    rollout::Rollout,
    validation::free_running_rmse,
};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use std::{mem::take, path::Path, sync::Arc, time::Instant};
use unic_core::{
    intersection::PaperIntersection,
    model::{About, Model, ModelParts},
};

/// A run: data, networks, optimiser.
pub struct Trainer {
    config: TrainConfig,
    data: Dataset,
    shape: NetworkShape,
    device: Device,
    network: Network,
    moments: Moments,
    average: Option<Vec<Vec<f32>>>,
    best: Option<Best>,
    step: u64,
    seconds: f64,
    bodies: Bodies,
}

#[derive(Clone)]
struct Best {
    rmse: f64,
    step: u64,
    parameters: Vec<Vec<f32>>,
}

/// Seconds between checkpoints: what a power cut may cost.
const CHECKPOINT_SECONDS: f64 = 120.0;

impl Trainer {
    /// A run at its beginning.
    ///
    /// # Errors
    /// Settings that fit no network, clips too short to train on.
    pub fn new(data: Dataset, config: TrainConfig) -> Result<Self, TrainError> {
        config.check()?;
        if data.longest_unroll() == 0 {
            let frames = data
                .clips
                .iter()
                .map(unic_eval::PreparedClip::len)
                .min()
                .unwrap_or(0);
            return Err(TrainError::ShortClip {
                capture: data.capture.root.clone(),
                frames,
            });
        }
        let shape = NetworkShape::new(&data.config, data.capture.character.skeleton.len());
        shape.field.validate()?;
        let device = Device::flex().autodiff();
        let network = Network::new(&shape, config.seed, &device);
        Ok(Self {
            moments: Moments::new(&network),
            average: (config.regularisation.average > 0.0).then(|| network.values()),
            best: None,
            step: 0,
            seconds: 0.0,
            bodies: Bodies::default(),
            config,
            data,
            shape,
            device,
            network,
        })
    }

    /// The networks as they are now; their sizes are [`NetworkShape::new`] of the data's configuration.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Settings of the run.
    pub fn config(&self) -> &TrainConfig {
        &self.config
    }

    /// Clips and measurements.
    pub fn data(&self) -> &Dataset {
        &self.data
    }

    /// Steps done.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// Training seconds so far, over all resumes.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Steps that fit into a wall-clock budget on this machine, by timing a few of them (they are
    /// not kept). The schedule depends on the number of steps alone, so that a run can be resumed.
    ///
    /// # Errors
    /// As [`Trainer::run`].
    pub fn steps_within(&self, seconds: f64) -> Result<u64, TrainError> {
        const SAMPLES: u64 = 5;
        let steps = self.config.optimiser.steps;
        let (mut network, mut moments) = (self.network.clone(), self.moments.clone());
        let mut total = 0.0;
        for i in 0..SAMPLES {
            let at = steps * (2 * i + 1) / (2 * SAMPLES);
            // Twice: the first one warms caches and allocates.
            self.stepped(&mut network, &mut moments, at)?;
            let started = Instant::now();
            self.stepped(&mut network, &mut moments, at)?;
            total += started.elapsed().as_secs_f64();
        }
        let started = Instant::now();
        free_running_rmse(
            &Arc::new(self.model_of(&self.network.values())?),
            &self.data.validation,
        )?;
        let validation = started.elapsed().as_secs_f64() / self.config.validate_every as f64;
        let per_step = total / SAMPLES as f64 + validation;
        Ok(((seconds / per_step) as u64).max(1))
    }

    /// Runs to the last step, or until a listener says stop. With a folder, checkpoints go there.
    ///
    /// # Errors
    /// A loss that is no number, a folder that cannot be written to.
    pub fn run(
        &mut self,
        folder: Option<&Path>,
        listen: &mut dyn FnMut(&Event) -> Control,
    ) -> Result<Outcome, TrainError> {
        let mut saved_at = Instant::now();
        if self.step == 0 && self.config.keep == Keep::Best && self.best.is_none() {
            // A new displacement model is its prior: training must beat that to be kept.
            let _ = self.validate(listen)?;
        }
        while self.step < self.config.optimiser.steps {
            let mut control = self.advance(listen)?;
            let last = self.step == self.config.optimiser.steps;
            if last || self.step.is_multiple_of(self.config.validate_every) {
                control = control.and(self.validate(listen)?);
            }
            let due = saved_at.elapsed().as_secs_f64() > CHECKPOINT_SECONDS;
            if let Some(folder) = folder.filter(|_| last || due || control == Control::Stop) {
                let path = self.save(folder)?;
                let event = Event::Saved {
                    step: self.step,
                    path: &path,
                };
                control = control.and(listen(&event));
                saved_at = Instant::now();
            }
            if control == Control::Stop && !last {
                return Ok(Outcome::Stopped);
            }
        }
        Ok(Outcome::Finished)
    }

    fn advance(&mut self, listen: &mut dyn FnMut(&Event) -> Control) -> Result<Control, TrainError> {
        let started = Instant::now();
        let (mut network, mut moments) = (take(&mut self.network), take(&mut self.moments));
        let stepped = self.stepped(&mut network, &mut moments, self.step);
        (self.network, self.moments) = (network, moments);
        let Stepped { loss, gradient_norm } = stepped?;
        self.update_average();
        let learning_rate = self.config.learning_rate(self.step);
        self.step += 1;
        let seconds = started.elapsed().as_secs_f64();
        self.seconds += seconds;
        Ok(listen(&Event::Step {
            step: self.step,
            loss,
            gradient_norm,
            learning_rate,
            seconds,
        }))
    }

    /// One optimiser step: a function of the parameters, the moments, the seed and the step.
    fn stepped(
        &self,
        network: &mut Network,
        moments: &mut Moments,
        step: u64,
    ) -> Result<Stepped, TrainError> {
        let loss = self.loss(network, step)?;
        let value = loss.clone().into_scalar::<f32>();
        let diverged = |what, value| TrainError::Diverged { step, what, value };
        if !value.is_finite() {
            return Err(diverged("loss", value.into()));
        }
        let gradients = GradientsParams::from_grads(loss.backward(), network);
        let rate = self.config.learning_rate(step);
        let norm = update(network, gradients, moments, &self.config.optimiser, rate, step)?;
        match norm.is_finite() {
            true => Ok(Stepped {
                loss: value,
                gradient_norm: norm,
            }),
            false => Err(diverged("gradient's norm", norm)),
        }
    }

    fn loss(&self, network: &Network, step: u64) -> Result<Tensor<1>, TrainError> {
        let config = &self.config;
        let batch = Batch::gather(&self.data, config, step);
        let sizes = [batch.frames, batch.windows.len()];
        let noise = StepNoise::draw(&self.shape, &config.regularisation, sizes, [config.seed, step]);
        let correction = Correction {
            data: &self.data,
            bodies: &self.bodies,
            rule: PaperIntersection {
                relaxation_m: config.intersection.relaxation_m,
            },
        };
        let corrects = config.intersection.from_step.is_some_and(|from| step >= from);
        let rollout = Rollout {
            shape: &self.shape,
            config: &self.data.config,
            loss: &config.loss,
            correction: corrects.then_some(&correction),
        };
        rollout.loss(network, &batch, Some(&noise), &self.device)
    }

    fn update_average(&mut self) {
        let Some(average) = &mut self.average else { return };
        // Early on the mean is over the steps so far, so that it forgets the random start.
        let decay = self
            .config
            .regularisation
            .average
            .min((self.step as f64 + 1.0) / (self.step as f64 + 10.0));
        for (average, now) in average.iter_mut().zip(self.network.values()) {
            let pairs = average.iter_mut().zip(now);
            pairs.for_each(|(a, x)| *a += (1.0 - decay as f32) * (x - *a));
        }
    }

    fn validate(&mut self, listen: &mut dyn FnMut(&Event) -> Control) -> Result<Control, TrainError> {
        let started = Instant::now();
        let parameters = self.average.clone().unwrap_or_else(|| self.network.values());
        let model = Arc::new(self.model_of(&parameters)?);
        let rmse = free_running_rmse(&model, &self.data.validation)?;
        // A free run that has left the numbers is no result to keep, nor one that JSON can hold.
        let smaller = rmse.is_finite() && self.best.as_ref().is_none_or(|best| rmse < best.rmse);
        if smaller {
            self.best = Some(Best {
                rmse,
                step: self.step,
                parameters,
            });
        }
        let best = self.best.as_ref().map_or(rmse, |b| b.rmse);
        let seconds = started.elapsed().as_secs_f64();
        self.seconds += seconds;
        Ok(listen(&Event::Validated {
            step: self.step,
            rmse,
            best,
            seconds,
        }))
    }

    /// The model as the settings want it kept: the last or the best parameters, averaged or not.
    ///
    /// # Errors
    /// None for a run that has not diverged.
    pub fn model(&self) -> Result<Model, TrainError> {
        match (&self.best, self.config.keep) {
            (Some(best), Keep::Best) => self.model_of(&best.parameters),
            _ => match &self.average {
                Some(average) => self.model_of(average),
                None => self.model_of(&self.network.values()),
            },
        }
    }

    fn model_of(&self, parameters: &[Vec<f32>]) -> Result<Model, TrainError> {
        let capture = &self.data.capture;
        let (encoder, field) = model_layers(&self.shape, parameters);
        let training = serde_json::json!({
            "settings": self.config,
            "steps": self.step,
            "seconds": self.seconds,
            "validation_clips": self.data.validation.iter().map(|c| c.name()).collect::<Vec<_>>(),
            "best_validation_rmse_mm": self.best.as_ref().map(|b| 1e3 * b.rmse),
            "best_validation_step": self.best.as_ref().map(|b| b.step),
        });
        Ok(Model::new(ModelParts {
            config: self.data.config.clone(),
            character: capture.character.clone(),
            garment: capture.garment.clone(),
            prior: self.data.prior.clone(),
            rest_box: self.data.rest_box,
            normalisation: self.data.normalisation.clone(),
            encoder,
            field,
            about: About {
                name: capture.manifest.name.clone(),
                provenance: capture.manifest.provenance.clone(),
                training,
            },
        })?)
    }
}

struct Stepped {
    loss: f32,
    gradient_norm: f64,
}
