//! The training loop, one for every network: sample, loss, finite check, update, events,
//! checkpoints.
//!
//! A [`Training`] defines the loss, the measurements and the record in checkpoints. A
//! [`Learner`] holds the network, its optimiser's moments and its position, and runs the loop. A
//! step is a function of the parameters, the moments, the seed and the step's number, so a resumed
//! run ends where an uninterrupted one does.

mod average;

pub use average::Averaging;

use crate::{
    checkpoint::{Checkpoint, Position},
    config::OptimiserConfig,
    error::{Quantity, TrainError},
    event::{Control, Event, Outcome},
    optimiser::{Moments, update},
    parameters::{replaced, values},
};
use average::Average;
use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::Tensor;
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// A listener's callback. It is called after every event, on the thread that trains.
pub type Listen<'a> = dyn FnMut(&Event) -> Control + 'a;

/// A training of one network: its loss, its measurements and what its checkpoints record.
pub trait Training {
    /// The trained network.
    type Network: Module + Default + Clone;
    /// Description of the training in its checkpoints, by which a resumed run knows its own.
    type Record: Serialize;
    /// Name of the network in errors, such as "deformation field".
    const NETWORK: &'static str;

    /// AdamW's settings and the number of steps.
    fn optimiser(&self) -> &OptimiserConfig;

    /// Samples the batch of a step, counted from 0, and computes its loss.
    ///
    /// # Errors
    /// Sizes that do not fit the network.
    fn loss(&self, network: &Self::Network, step: u64) -> Result<Tensor<1>, TrainError>;

    /// Returns whether a measurement is due once so many steps are done.
    fn measures_after(&self, _steps_done: u64) -> bool {
        false
    }

    /// Measures the network and reports to the listener.
    ///
    /// # Errors
    /// [`TrainError::Stopped`] where the listener ends the measurement; it then stays due.
    fn measure(
        &mut self,
        _learner: &Learner<Self::Network>,
        _listen: &mut Listen,
    ) -> Result<Control, TrainError> {
        Ok(Control::Continue)
    }

    /// Returns the checkpoint's description of this training.
    fn record(&self) -> Self::Record;
}

/// A network in training: its parameters, the optimiser's moments, the running mean of the parameters
/// over the steps (where one is kept), and the position.
#[derive(Clone)]
pub struct Learner<N> {
    network: N,
    moments: Moments,
    average: Option<Average>,
    position: Position,
}

/// Loss and gradient of one step.
struct Stepped {
    loss: f32,
    gradient_norm: f64,
}

/// Seconds between checkpoints: the work that a power cut may cost.
const CHECKPOINT_SECONDS: f64 = 120.0;

impl<N: Module + Default + Clone> Learner<N> {
    /// Starts at step 0.
    pub fn new(network: N, averaging: Averaging) -> Self {
        Self {
            moments: Moments::new(&network),
            average: Average::new(averaging, || values(&network)),
            position: Position::default(),
            network,
        }
    }

    /// The network with the parameters of the newest step.
    pub fn network(&self) -> &N {
        &self.network
    }

    /// Number of steps done.
    pub fn step(&self) -> u64 {
        self.position.step
    }

    /// Seconds of steps and measurements so far, over all resumes.
    pub fn seconds(&self) -> f64 {
        self.position.seconds
    }

    /// Parameters of the finished model: the mean over steps where one is kept, else the newest
    /// ones.
    pub fn kept(&self) -> Vec<Vec<f32>> {
        match &self.average {
            Some(average) => average.values.clone(),
            None => values(&self.network),
        }
    }

    /// Runs to the last step, or until the listener stops the run. Checkpoints go to `folder`, if
    /// there is one.
    ///
    /// # Errors
    /// A loss or a gradient that is not finite, a folder that cannot be written to.
    pub fn run<T: Training<Network = N>>(
        &mut self,
        training: &mut T,
        folder: Option<&Path>,
        listen: &mut Listen,
    ) -> Result<Outcome, TrainError> {
        let mut saved_at = Instant::now();
        let steps = training.optimiser().steps;
        while self.position.measurement_is_due || self.position.step < steps {
            let mut control = Control::Continue;
            if !self.position.measurement_is_due {
                control = self.advance(training, listen)?;
                self.position.measurement_is_due = training.measures_after(self.position.step);
            }
            // A stop asks for an end soon: the measurement stays due, and the resumed run makes it.
            if self.position.measurement_is_due && control == Control::Continue {
                control = self.measure(training, listen)?;
            }
            let is_last = self.position.step == steps && !self.position.measurement_is_due;
            let is_old = saved_at.elapsed().as_secs_f64() > CHECKPOINT_SECONDS;
            if let Some(folder) = folder.filter(|_| is_last || is_old || control == Control::Stop) {
                let path = self.save(training, folder)?;
                let event = Event::Saved {
                    step: self.position.step,
                    path: &path,
                };
                control = control.and(listen(&event));
                saved_at = Instant::now();
            }
            // A stop after the last step changes nothing: the run is finished.
            if control == Control::Stop && !is_last {
                return Ok(Outcome::Stopped);
            }
        }
        Ok(Outcome::Finished)
    }

    /// Measures the seconds of a step: the mean over the step numbers `at`. Nothing of it is kept.
    ///
    /// # Errors
    /// The errors of [`Learner::run`].
    pub fn seconds_per_step<T: Training<Network = N>>(
        &self,
        training: &T,
        at: &[u64],
    ) -> Result<f64, TrainError> {
        let mut copy = self.clone();
        let mut total = 0.0;
        for &step in at {
            // The first of two equal steps warms caches and allocates memory.
            copy.update(training, step)?;
            let started = Instant::now();
            copy.update(training, step)?;
            total += started.elapsed().as_secs_f64();
        }
        Ok(total / at.len().max(1) as f64)
    }

    fn advance<T: Training<Network = N>>(
        &mut self,
        training: &T,
        listen: &mut Listen,
    ) -> Result<Control, TrainError> {
        let started = Instant::now();
        let step = self.position.step;
        let Stepped { loss, gradient_norm } = self.update(training, step)?;
        if let Some(average) = &mut self.average {
            average.add(step, values(&self.network));
        }
        self.position.step += 1;
        let seconds = started.elapsed().as_secs_f64();
        self.position.seconds += seconds;
        Ok(listen(&Event::Step {
            step: self.position.step,
            loss,
            gradient_norm,
            learning_rate: training.optimiser().learning_rate(step),
            seconds,
        }))
    }

    /// One optimiser step.
    fn update<T: Training<Network = N>>(&mut self, training: &T, step: u64) -> Result<Stepped, TrainError> {
        let diverged = |quantity, value| TrainError::Diverged {
            network: T::NETWORK,
            quantity,
            step,
            value,
        };
        let loss = training.loss(&self.network, step)?;
        let value = loss.clone().into_scalar::<f32>();
        // Checked before the update: a loss that is not finite would spoil every parameter.
        if !value.is_finite() {
            return Err(diverged(Quantity::Loss, value.into()));
        }
        let gradients = GradientsParams::from_grads(loss.backward(), &self.network);
        let optimiser = training.optimiser();
        let rate = optimiser.learning_rate(step);
        let gradient_norm = update(
            &mut self.network,
            gradients,
            &mut self.moments,
            optimiser,
            rate,
            step,
        )?;
        // `update` has changed nothing where the norm is not finite.
        match gradient_norm.is_finite() {
            true => Ok(Stepped {
                loss: value,
                gradient_norm,
            }),
            false => Err(diverged(Quantity::GradientNorm, gradient_norm)),
        }
    }

    /// Makes the measurement that is due. It stays due where the listener ends it.
    fn measure<T: Training<Network = N>>(
        &mut self,
        training: &mut T,
        listen: &mut Listen,
    ) -> Result<Control, TrainError> {
        let started = Instant::now();
        let measured = training.measure(self, listen);
        // Interrupted measurements count too: their time is spent.
        self.position.seconds += started.elapsed().as_secs_f64();
        match measured {
            Err(TrainError::Stopped) => Ok(Control::Stop),
            measured => {
                self.position.measurement_is_due = false;
                measured
            }
        }
    }

    fn save<T: Training<Network = N>>(&self, training: &T, folder: &Path) -> Result<PathBuf, TrainError> {
        let mut groups = vec![
            ("parameters".to_owned(), values(&self.network)),
            ("first_moments".to_owned(), self.moments.first.clone()),
            ("second_moments".to_owned(), self.moments.second.clone()),
        ];
        groups.extend(
            self.average
                .iter()
                .map(|a| ("average".to_owned(), a.values.clone())),
        );
        // A file returns its groups sorted by name: a checkpoint equals its copy from disk.
        groups.sort_by(|a, b| a.0.cmp(&b.0));
        let checkpoint = Checkpoint {
            position: self.position,
            record: training.record(),
            groups,
        };
        checkpoint.write(folder)
    }

    /// Continues from a checkpoint of the same training, which the caller has compared with its
    /// own.
    ///
    /// # Errors
    /// A few words about the checkpoint: of another network, or without all its tensors.
    pub(crate) fn restore<R>(&mut self, checkpoint: &Checkpoint<R>) -> Result<(), &'static str> {
        // All groups are checked before anything is replaced: after an error the learner is
        // unchanged.
        let lengths: Vec<usize> = values(&self.network).iter().map(Vec::len).collect();
        let group = |name: &str| match checkpoint.group(name) {
            Some(g) if g.iter().map(Vec::len).eq(lengths.iter().copied()) => Ok(g.clone()),
            Some(_) => Err("one of a network of other sizes"),
            None => Err("one without all its tensors"),
        };
        let parameters = group("parameters")?;
        let moments = Moments {
            first: group("first_moments")?,
            second: group("second_moments")?,
        };
        if let Some(average) = &mut self.average {
            average.values = group("average")?;
        }
        self.network = replaced(std::mem::take(&mut self.network), &parameters);
        self.moments = moments;
        self.position = checkpoint.position;
        Ok(())
    }
}
