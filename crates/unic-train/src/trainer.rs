//! The training loop. It emits events; command line, log and tests listen.

mod export;
mod one_step;
mod pace;
mod resume;

pub use pace::Pace;

use crate::{
    batch::Batch,
    config::{Keep, TrainConfig},
    correction::{Bodies, Correction},
    dataset::Dataset,
    error::TrainError,
    event::{Control, Event, Outcome},
    network::{Network, NetworkShape, StepNoise},
    optimiser::{Moments, update},
    rollout::Rollout,
    time::TrainingTime,
    validation::{Validation, free_running_rmse_of},
};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use std::{mem::take, path::Path, sync::Arc, time::Instant};
use unic_core::{intersection::Handling, model::Model};

/// One fit of a run: data, networks, optimiser.
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
    /// Training time of this fit.
    time: TrainingTime,
    /// Training time of the run beside this fit.
    other: TrainingTime,
    /// A measurement is due after the last step and not made yet.
    owes_measurement: bool,
    bodies: Bodies,
    /// Intersection handling in training.
    rule: Handling,
    validation: Option<Validation>,
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
    /// A fit at its beginning.
    ///
    /// # Errors
    /// Settings that fit no network, clips too short to train on.
    pub fn new(data: Dataset, config: TrainConfig) -> Result<Self, TrainError> {
        config.check()?;
        let config = config.for_pairs(data.frame_pairs());
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
        let device = data.device.clone();
        let network = Network::new(&shape, config.seed, &device);
        Ok(Self {
            moments: Moments::new(&network),
            average: (config.regularisation.average > 0.0).then(|| network.values()),
            best: None,
            step: 0,
            time: TrainingTime {
                seconds: data.prior_seconds,
                prior_seconds: data.prior_seconds,
            },
            other: TrainingTime::default(),
            owes_measurement: false,
            bodies: Bodies::default(),
            rule: Handling::new(
                config.intersection.in_training(),
                &data.capture.character,
                &data.capture.garment,
            ),
            validation: None,
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

    /// Settings of the run, which all of its fits share.
    pub fn config(&self) -> &TrainConfig {
        &self.config
    }

    /// Clips and measurements.
    pub fn data(&self) -> &Dataset {
        &self.data
    }

    /// Clips and measurements, for another run on the same data.
    pub fn into_data(self) -> Dataset {
        self.data
    }

    /// Steps done.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// Training time of this fit so far, over all resumes, with that of its prior.
    pub fn time(&self) -> TrainingTime {
        self.time
    }

    /// Training time that the run has taken beside this fit, in fits before and in the last validation: the
    /// model file tells the sum.
    pub fn set_other_time(&mut self, other: TrainingTime) {
        self.other = other;
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
        if self.step == 0 && self.config.keep == Keep::Best && self.best.is_none() && self.validates() {
            // A new displacement model is its prior: training must beat that to be kept.
            self.owes_measurement = true;
        }
        while self.owes_measurement || self.step < self.config.optimiser.steps {
            let mut control = Control::Continue;
            if !self.owes_measurement {
                control = self.advance(listen)?;
                let is_last = self.step == self.config.optimiser.steps;
                self.owes_measurement = is_last || self.step.is_multiple_of(self.config.validation.every);
            }
            if self.owes_measurement && control == Control::Continue {
                control = self.measure_unless_stopped(listen)?;
            }
            let last = self.step == self.config.optimiser.steps && !self.owes_measurement;
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

    /// Makes the measurement that is due, unless a listener cuts it off: then it stays due.
    fn measure_unless_stopped(
        &mut self,
        listen: &mut dyn FnMut(&Event) -> Control,
    ) -> Result<Control, TrainError> {
        match self.measure(listen) {
            Err(TrainError::Stopped) => Ok(Control::Stop),
            measured => {
                self.owes_measurement = false;
                measured
            }
        }
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
        self.time.seconds += seconds;
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
            rule: &self.rule,
        };
        let corrects = config.intersection.from_step.is_some_and(|from| step >= from);
        let rollout = Rollout {
            shape: &self.shape,
            config: &self.data.config,
            loss: &config.loss,
            products: config.optimiser.products,
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

    /// Is there any clip to validate on?
    fn validates(&self) -> bool {
        !self.data.validation.is_empty()
    }

    /// Tells the error of one step, and in free running where clips are held out.
    fn measure(&mut self, listen: &mut dyn FnMut(&Event) -> Control) -> Result<Control, TrainError> {
        let parameters = self.averaged();
        let model = match self.validates() {
            true => Some(Arc::new(self.model_of(&parameters, 1.0)?)),
            false => None,
        };
        let control = self.measure_one_step(&parameters, model.as_ref(), listen)?;
        match model {
            Some(model) => Ok(control.and(self.validate(parameters, &model, listen)?)),
            None => Ok(control),
        }
    }

    fn validate(
        &mut self,
        parameters: Vec<Vec<f32>>,
        model: &Arc<Model>,
        listen: &mut dyn FnMut(&Event) -> Control,
    ) -> Result<Control, TrainError> {
        let started = Instant::now();
        let mut proceed = || listen(&Event::Measuring { step: self.step });
        let (clips, intersection) = (&self.data.validation, model.config().intersection);
        let rmse = free_running_rmse_of(model, clips, usize::MAX, intersection, &mut proceed)?;
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
        self.time.seconds += seconds;
        Ok(listen(&Event::Validated {
            step: self.step,
            rmse,
            best,
            seconds,
        }))
    }
}

struct Stepped {
    loss: f32,
    gradient_norm: f64,
}
