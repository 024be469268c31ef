//! A recurrent unit while it learns, and how fast it does.

use super::{
    Progress, Sequence,
    unit::{Sizes, Unit},
    windows::{WindowBatch, Windows},
};
use crate::{
    config::{OptimiserConfig, RecurrenceSettings},
    error::TrainError,
    noise::normal,
    optimiser::{Moments, update},
    processor::Processor,
    stream::{Stream, generator},
};
use burn::optim::GradientsParams;
use burn::tensor::Device;
use std::time::Instant;
use unic_core::recurrence::Recurrence;

/// Decay of the running mean of the parameters.
const AVERAGE: f32 = 0.99;

/// One training of one unit.
pub(super) struct UnitFit<'a> {
    pub(super) settings: &'a RecurrenceSettings,
    pub(super) steps: u64,
    pub(super) sequences: Vec<&'a Sequence<'a>>,
    pub(super) seed: u64,
    pub(super) fps: f32,
    pub(super) device: &'a Device,
}

impl UnitFit<'_> {
    /// None without anything to learn.
    pub(super) fn run(&self, progress: &Progress) -> Result<Option<Recurrence>, TrainError> {
        let Some(windows) = Windows::new(&self.sequences, self.settings) else {
            return Ok(None);
        };
        let optimiser = self.settings.optimiser(self.steps);
        let unit = Unit::new(windows.sizes(), self.fps, self.seed, self.device);
        let mut learner = Learner::new(unit);
        for step in 0..self.steps {
            let mut rng = generator(self.seed, Stream::Recurrence, step);
            learner.step(windows.draw(&mut rng), &optimiser, step, self.device)?;
            progress.step()?;
        }
        Ok(Some(
            windows.sizes().recurrence(&learner.average, windows.scale()),
        ))
    }
}

struct Learner {
    unit: Unit,
    moments: Moments,
    /// The running mean of the parameters, which is kept.
    average: Vec<Vec<f32>>,
}

impl Learner {
    fn new(unit: Unit) -> Self {
        let average = unit.values();
        Self {
            moments: Moments::zeros(average.iter().map(Vec::len)),
            average,
            unit,
        }
    }

    fn step(
        &mut self,
        batch: WindowBatch,
        optimiser: &OptimiserConfig,
        step: u64,
        device: &Device,
    ) -> Result<(), TrainError> {
        let diverged = |what, value| TrainError::Diverged { step, what, value };
        let loss = self.unit.loss(batch, device);
        let value = loss.clone().into_scalar::<f32>();
        if !value.is_finite() {
            return Err(diverged("loss of the prior's recurrence", value.into()));
        }
        let gradients = GradientsParams::from_grads(loss.backward(), &self.unit);
        let rate = optimiser.learning_rate(step);
        let norm = update(
            &mut self.unit,
            gradients,
            &mut self.moments,
            optimiser,
            rate,
            step,
        )?;
        if !norm.is_finite() {
            return Err(diverged("gradient's norm of the prior's recurrence", norm));
        }
        for (average, now) in self.average.iter_mut().zip(self.unit.values()) {
            let pairs = average.iter_mut().zip(now);
            pairs.for_each(|(a, x)| *a += (1.0 - AVERAGE) * (x - *a));
        }
        Ok(())
    }
}

impl RecurrenceSettings {
    /// Frames of its windows that the threads of this pool teach a recurrence in a second, from motion vectors of so many
    /// `inputs` to so many coefficients, `outputs`: by a few steps on noise, of which nothing is kept.
    ///
    /// # Errors
    /// A processor that this program or machine does not have.
    pub fn frames_a_second(
        &self,
        [inputs, outputs]: [usize; 2],
        processor: Processor,
    ) -> Result<f64, TrainError> {
        const STEPS: u64 = 4;
        const FPS: f32 = 30.0;
        let device = processor.device()?;
        let sizes = Sizes {
            inputs: 2 * inputs,
            width: self.width,
            oscillators: self.oscillators,
            outputs,
        };
        let optimiser = self.optimiser(STEPS);
        let mut learner = Learner::new(Unit::new(sizes, FPS, 0, &device));
        // The first one warms caches and allocates.
        learner.step(self.noise(sizes, 0), &optimiser, 0, &device)?;
        let started = Instant::now();
        for step in 1..=STEPS {
            learner.step(self.noise(sizes, step), &optimiser, step, &device)?;
        }
        let frames = STEPS as usize * self.windows * self.frames;
        Ok(frames as f64 / started.elapsed().as_secs_f64())
    }

    fn noise(&self, sizes: Sizes, step: u64) -> WindowBatch {
        let mut rng = generator(0, Stream::Recurrence, step);
        let mut numbers = |count: usize| (0..count).map(|_| normal(&mut rng)).collect();
        let frames = self.windows * self.frames;
        WindowBatch {
            frames: self.frames,
            windows: self.windows,
            sizes,
            inputs: numbers(frames * sizes.inputs),
            targets: numbers(frames * sizes.outputs),
            masks: [sizes.width, sizes.width].map(|width| vec![1.0; self.windows * width]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Preset, StateSettings, TrainConfig};

    #[test]
    fn a_wider_recurrence_learns_more_slowly() {
        let config = TrainConfig::preset(Preset::Tiny);
        let StateSettings::Displacement { recurrence, .. } = config.model.state else {
            unreachable!("tiny's state is a displacement");
        };
        let narrow = recurrence.unwrap();
        let wide = RecurrenceSettings {
            width: 16 * narrow.width,
            ..narrow.clone()
        };
        let [narrow, wide] = [narrow, wide].map(|r| r.frames_a_second([60, 16], Processor::Cpu).unwrap());
        assert!(wide > 0.0 && narrow > 2.0 * wide, "{narrow} {wide}");
    }
}
