//! The training loop. It emits events; command line, log and tests listen.

use crate::{
    batch::Batch,
    checkpoint::{Checkpoint, Progress},
    config::{Keep, TrainConfig},
    correction::{Bodies, Correction},
    dataset::Dataset,
    error::TrainError,
    network::{Network, NetworkShape, StepNoise, model_layers},
    optimiser::{Moments, update},
    rollout::Rollout,
    validation::free_running_rmse,
};
use burn::optim::GradientsParams;
use burn::tensor::Device;
use std::{path::Path, path::PathBuf, sync::Arc, time::Instant};
use unic_core::{
    intersection::PaperIntersection,
    model::{About, Model, ModelParts},
};

/// What a run tells its listeners.
#[derive(Clone, Debug)]
pub enum Event<'a> {
    /// A step is done.
    Step {
        /// Steps done so far.
        step: u64,
        /// Loss of the step.
        loss: f32,
        /// Global norm of the gradient before clipping.
        gradient_norm: f64,
        /// Learning rate of the step.
        learning_rate: f64,
        /// Seconds that the step took.
        seconds: f64,
    },
    /// The free-running error on the validation clips.
    Validated {
        /// Steps done so far.
        step: u64,
        /// RMSE, metres.
        rmse: f64,
        /// Smallest so far, metres.
        best: f64,
        /// Seconds that the validation took.
        seconds: f64,
    },
    /// A checkpoint is on disk.
    Saved {
        /// Steps done so far.
        step: u64,
        /// The file.
        path: &'a Path,
    },
}

/// A listener's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    Continue,
    /// Save a checkpoint and return.
    Stop,
}

/// How a call of [`Trainer::run`] ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All steps are done.
    Finished,
    /// A listener stopped the run; a checkpoint is on disk.
    Stopped,
}

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
            let frames = data.clips.iter().map(unic_eval::PreparedClip::len).min().unwrap_or(0);
            return Err(TrainError::ShortClip { capture: data.capture.root.clone(), frames });
        }
        let shape = NetworkShape::new(&data.config, data.capture.character.skeleton.len());
        shape.field.validate()?;
        let device = Device::flex().autodiff();
        let network = Network::new(&shape, config.seed, &device);
        Ok(Self {
            moments: Moments::new(&network),
            average: (config.regularisation.average > 0.0).then(|| values(&network)),
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

    /// Goes on from a checkpoint of a run with the same settings, to the same result as if the run
    /// had never stopped.
    ///
    /// # Errors
    /// A checkpoint of other settings or another network.
    pub fn resume(&mut self, checkpoint: Checkpoint, path: &Path) -> Result<(), TrainError> {
        let wrong = |found: &str| TrainError::Checkpoint { path: path.to_owned(), found: found.to_owned() };
        if checkpoint.progress.config != self.config {
            return Err(wrong("one of other settings"));
        }
        let lengths: Vec<usize> = values(&self.network).iter().map(Vec::len).collect();
        let group = |name: &str| match checkpoint.group(name) {
            Some(g) if g.iter().map(Vec::len).eq(lengths.iter().copied()) => Ok(g.clone()),
            Some(_) => Err(wrong("one of a network of other sizes")),
            None => Err(wrong("one without all its tensors")),
        };
        let parameters = group("parameters")?;
        let moments = Moments { first: group("first_moments")?, second: group("second_moments")? };
        let average = self.average.is_some().then(|| group("average")).transpose()?;
        let best = match checkpoint.progress.best {
            Some((rmse, step)) => Some(Best { rmse, step, parameters: group("best")? }),
            None => None,
        };
        self.network = Network::with_parameters(&self.shape, &parameters, &self.device);
        (self.moments, self.average, self.best) = (moments, average, best);
        self.step = checkpoint.progress.step;
        self.seconds = checkpoint.progress.seconds;
        Ok(())
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
        let mut total = 0.0;
        for i in 0..SAMPLES {
            let at = steps * (2 * i + 1) / (2 * SAMPLES);
            // Twice: the first one warms caches and allocates.
            let (_, mut moments) = (self.trial(at)?, self.moments.clone());
            let started = Instant::now();
            self.stepped(self.network.clone(), &mut moments, at)?;
            total += started.elapsed().as_secs_f64();
        }
        let started = Instant::now();
        free_running_rmse(&Arc::new(self.model_of(&values(&self.network))?), &self.data.validation)?;
        let validation = started.elapsed().as_secs_f64() / self.config.validate_every as f64;
        let per_step = total / SAMPLES as f64 + validation;
        Ok(((seconds / per_step) as u64).max(1))
    }

    fn trial(&self, at: u64) -> Result<(), TrainError> {
        self.stepped(self.network.clone(), &mut self.moments.clone(), at).map(|_| ())
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
        while self.step < self.config.optimiser.steps {
            let mut control = self.advance(listen)?;
            let last = self.step == self.config.optimiser.steps;
            if last || self.step.is_multiple_of(self.config.validate_every) {
                control = stop_if_any(control, self.validate(listen)?);
            }
            let due = saved_at.elapsed().as_secs_f64() > CHECKPOINT_SECONDS;
            if let Some(folder) = folder.filter(|_| last || due || control == Control::Stop) {
                let path = self.save(folder)?;
                let event = Event::Saved { step: self.step, path: &path };
                control = stop_if_any(control, listen(&event));
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
        let mut moments = std::mem::take(&mut self.moments);
        let stepped = self.stepped(self.network.clone(), &mut moments, self.step);
        self.moments = moments;
        let Stepped { network, loss, gradient_norm } = stepped?;
        self.network = network;
        self.update_average();
        let learning_rate = self.config.learning_rate(self.step);
        self.step += 1;
        let seconds = started.elapsed().as_secs_f64();
        self.seconds += seconds;
        Ok(listen(&Event::Step { step: self.step, loss, gradient_norm, learning_rate, seconds }))
    }

    /// One optimiser step from given parameters and moments: a function of seed and step.
    fn stepped(&self, network: Network, moments: &mut Moments, step: u64) -> Result<Stepped, TrainError> {
        let config = &self.config;
        let batch = Batch::gather(&self.data, config, step);
        let sizes = [batch.frames, batch.windows.len()];
        let noise = StepNoise::draw(&self.shape, &config.regularisation, sizes, [config.seed, step]);
        let correction = Correction {
            data: &self.data,
            bodies: &self.bodies,
            rule: PaperIntersection { relaxation_m: config.intersection.relaxation_m },
        };
        let corrects = config.intersection.from_step.is_some_and(|from| step >= from);
        let rollout = Rollout {
            shape: &self.shape,
            config: &self.data.config,
            loss: &config.loss,
            correction: corrects.then_some(&correction),
        };
        let loss = rollout.loss(&network, &batch, Some(&noise), &self.device)?;
        let value = loss.clone().into_scalar::<f32>();
        if !value.is_finite() {
            return Err(TrainError::Diverged { step, loss: value });
        }
        let gradients = GradientsParams::from_grads(loss.backward(), &network);
        let rate = config.learning_rate(step);
        let (network, gradient_norm) = update(network, gradients, moments, &config.optimiser, rate, step)?;
        Ok(Stepped { network, loss: value, gradient_norm })
    }

    fn update_average(&mut self) {
        let Some(average) = &mut self.average else { return };
        // Early on the mean is over the steps so far, so that it forgets the random start.
        let decay = self.config.regularisation.average.min((self.step as f64 + 1.0) / (self.step as f64 + 10.0));
        for (average, now) in average.iter_mut().zip(values(&self.network)) {
            let pairs = average.iter_mut().zip(now);
            pairs.for_each(|(a, x)| *a += (1.0 - decay as f32) * (x - *a));
        }
    }

    fn validate(&mut self, listen: &mut dyn FnMut(&Event) -> Control) -> Result<Control, TrainError> {
        let started = Instant::now();
        let parameters = self.average.clone().unwrap_or_else(|| values(&self.network));
        let model = Arc::new(self.model_of(&parameters)?);
        let rmse = free_running_rmse(&model, &self.data.validation)?;
        let smaller = self.best.as_ref().is_none_or(|best| rmse < best.rmse);
        if smaller {
            self.best = Some(Best { rmse, step: self.step, parameters });
        }
        let best = self.best.as_ref().map_or(rmse, |b| b.rmse);
        let seconds = started.elapsed().as_secs_f64();
        self.seconds += seconds;
        Ok(listen(&Event::Validated { step: self.step, rmse, best, seconds }))
    }

    fn save(&self, folder: &Path) -> Result<PathBuf, TrainError> {
        let mut groups = vec![
            ("parameters".to_owned(), values(&self.network)),
            ("first_moments".to_owned(), self.moments.first.clone()),
            ("second_moments".to_owned(), self.moments.second.clone()),
        ];
        groups.extend(self.average.clone().map(|a| ("average".to_owned(), a)));
        groups.extend(self.best.clone().map(|b| ("best".to_owned(), b.parameters)));
        groups.sort_by(|a, b| a.0.cmp(&b.0));
        let progress = Progress {
            step: self.step,
            config: self.config.clone(),
            seconds: self.seconds,
            best: self.best.as_ref().map(|b| (b.rmse, b.step)),
        };
        Checkpoint { progress, groups }.write(folder)
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
                None => self.model_of(&values(&self.network)),
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
            "validation_rmse_mm": self.best.as_ref().map(|b| 1e3 * b.rmse),
        });
        Ok(Model::new(ModelParts {
            config: self.data.config.clone(),
            character: capture.character.clone(),
            garment: capture.garment.clone(),
            mean_displacement: self.data.mean_displacement.clone(),
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
    network: Network,
    loss: f32,
    gradient_norm: f64,
}

fn values(network: &Network) -> Vec<Vec<f32>> {
    network.parameters().into_iter().map(|p| p.values).collect()
}

fn stop_if_any(a: Control, b: Control) -> Control {
    if a == Control::Stop { a } else { b }
}
