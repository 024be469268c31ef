//! Training of one recurrent unit.

use super::{
    head::{Head, HeadStart},
    pretrained::UnitStart,
    sequence::Sequence,
    sizes::Sizes,
    unit::Unit,
    watch::Progress,
    windows::{WindowBatch, Windows},
};
use crate::{
    checkpoint::Checkpoint,
    config::{OptimiserConfig, RecurrenceSettings},
    device,
    error::TrainError,
    event::{Control, Event, Outcome},
    learner::{Averaging, Learner, Training},
    noise::normal,
    parameters::values,
    processor::Processor,
    stream::{Stream, generator},
};
use burn::tensor::{Device, Tensor};
use serde::{Deserialize, Serialize};
use std::path::Path;
use unic_core::recurrence::Recurrence;

/// Decay of the running mean of the parameters.
const AVERAGE: f64 = 0.99;

/// One training of one unit: on all motions, or without some of them.
pub(super) struct UnitTraining<'a> {
    pub(super) settings: &'a RecurrenceSettings,
    /// First values of the parameters, of the unit's sizes. Random ones without.
    pub(super) start: Option<&'a UnitStart>,
    /// First values of the last map; random ones without a start.
    pub(super) head: HeadStart,
    pub(super) steps: u64,
    pub(super) seed: u64,
    /// Ticks per second.
    pub(super) fps: f32,
    pub(super) device: &'a Device,
    /// Number of trainings that run at once. Each takes its share of the wall-clock time.
    pub(super) at_once: usize,
    /// Folder for the unit's checkpoints.
    pub(super) folder: Option<&'a Path>,
}

/// Parameters of a unit after its training.
pub(super) struct TrainedUnit {
    /// Values of the parameters, in the order of [`Unit`]'s fields.
    pub(super) values: Vec<Vec<f32>>,
    sizes: Sizes,
    /// Metres in one unit of output.
    scale: f32,
}

impl TrainedUnit {
    /// The unit as the runtime reads it.
    pub(super) fn recurrence(&self) -> Recurrence {
        self.sizes.recurrence(&self.values, self.scale)
    }
}

/// Description of a unit's training in its checkpoints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct UnitRecord {
    settings: RecurrenceSettings,
    steps: u64,
    seed: u64,
    fps: f32,
    #[serde(default)]
    head: HeadStart,
}

impl UnitTraining<'_> {
    /// Trains on `sequences`, from the newest checkpoint on if there is one. Returns none where
    /// there is nothing to learn.
    ///
    /// # Errors
    /// A training that diverges, a stop, a checkpoint of another training.
    pub(super) fn run(
        &self,
        sequences: &[&Sequence],
        progress: &Progress,
    ) -> Result<Option<TrainedUnit>, TrainError> {
        let Some(windows) = Windows::new(sequences, self.settings) else {
            // The steps that are left out count as done, or the progress would never end.
            return match stop_or_continue(progress.add(self.steps)) {
                Outcome::Stopped => Err(TrainError::Stopped),
                Outcome::Finished => Ok(None),
            };
        };
        let mut objective = Objective {
            optimiser: self.settings.optimiser(self.steps),
            record: UnitRecord {
                settings: self.settings.clone(),
                steps: self.steps,
                seed: self.seed,
                fps: self.fps,
                head: self.head,
            },
            device: self.device,
            draw: |step| windows.draw(&mut generator(self.seed, Stream::Recurrence, step)),
        };
        let mut unit = Unit::new(windows.sizes(), self.fps, self.seed, self.device);
        if let Some(start) = self.start {
            debug_assert!(start.fits(windows.sizes()), "the trainer has compared the sizes");
            unit = unit.started(start);
        }
        let checkpoint = self.checkpoint(&objective.record)?;
        if checkpoint.is_none() && self.head == HeadStart::Regressed {
            let recurrence = windows.sizes().recurrence(&values(&unit), 1.0);
            if let Some(head) = Head::fit(&recurrence, sequences, windows.scale(), windows.frames()) {
                unit = unit.with_head(head);
            }
        }
        let mut learner = Learner::new(unit, Averaging::Decay(AVERAGE));
        if let Some(checkpoint) = checkpoint {
            let restored = learner.restore(&checkpoint);
            restored.map_err(|found| self.wrong_checkpoint(found))?;
        }
        let before = learner.step();
        progress.add_restored(learner.seconds() / self.at_once as f64);
        // A stop is asked for once per unit, also where nothing of the unit is left to train.
        let mut outcome = stop_or_continue(progress.add(before));
        if outcome == Outcome::Finished {
            let mut listen = |event: &Event| match event {
                Event::Step { .. } => progress.add(1),
                _ => Control::Continue,
            };
            outcome = learner.run(&mut objective, self.folder, &mut listen)?;
        }
        match outcome {
            Outcome::Stopped => Err(TrainError::Stopped),
            Outcome::Finished => Ok(Some(TrainedUnit {
                values: learner.kept(),
                sizes: windows.sizes(),
                scale: windows.scale(),
            })),
        }
    }

    /// Reads the newest checkpoint of the training, if there is one.
    fn checkpoint(&self, record: &UnitRecord) -> Result<Option<Checkpoint<UnitRecord>>, TrainError> {
        let Some(folder) = self.folder else {
            return Ok(None);
        };
        match Checkpoint::<UnitRecord>::newest(folder)? {
            Some(checkpoint) if checkpoint.record != *record => {
                Err(self.wrong_checkpoint("one of other settings"))
            }
            checkpoint => Ok(checkpoint),
        }
    }

    fn wrong_checkpoint(&self, found: &str) -> TrainError {
        TrainError::Checkpoint {
            path: self.folder.unwrap_or(Path::new("")).to_owned(),
            found: found.to_owned(),
        }
    }
}

fn stop_or_continue(control: Control) -> Outcome {
    match control {
        Control::Continue => Outcome::Finished,
        Control::Stop => Outcome::Stopped,
    }
}

/// Loss of a unit on windows that `draw` returns for a step.
struct Objective<'a, D> {
    optimiser: OptimiserConfig,
    record: UnitRecord,
    device: &'a Device,
    draw: D,
}

impl<D: Fn(u64) -> WindowBatch> Training for Objective<'_, D> {
    type Network = Unit;
    type Record = UnitRecord;
    const NETWORK: &'static str = "prior's recurrence";

    fn optimiser(&self) -> &OptimiserConfig {
        &self.optimiser
    }

    fn loss(&self, unit: &Unit, step: u64) -> Result<Tensor<1>, TrainError> {
        Ok(unit.loss((self.draw)(step), self.device))
    }

    fn record(&self) -> UnitRecord {
        self.record.clone()
    }
}

/// Sizes of a prior that a training's rate is measured for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PriorSizes {
    /// Numbers in a motion vector.
    pub(crate) motion_len: usize,
    /// Number K of coefficients.
    pub(crate) coefficients: usize,
}

/// Measures how many frames of windows per second this thread pool trains a recurrence on, by a few
/// steps on noise of which nothing is kept.
///
/// # Errors
/// A processor that this program or machine does not have.
pub(crate) fn frames_per_second(
    settings: &RecurrenceSettings,
    prior: PriorSizes,
    processor: Processor,
) -> Result<f64, TrainError> {
    const STEPS: [u64; 4] = [1, 2, 3, 4];
    const FPS: f32 = 30.0;
    let device = device::open(processor)?;
    let sizes = Sizes {
        inputs: 2 * prior.motion_len,
        width: settings.width,
        oscillators: settings.oscillators,
        outputs: prior.coefficients,
    };
    let objective = Objective {
        optimiser: settings.optimiser(STEPS.len() as u64),
        record: UnitRecord {
            settings: settings.clone(),
            steps: STEPS.len() as u64,
            seed: 0,
            fps: FPS,
            head: HeadStart::Random,
        },
        device: &device,
        draw: |step| noise(settings, sizes, step),
    };
    let learner = Learner::new(Unit::new(sizes, FPS, 0, &device), Averaging::Decay(AVERAGE));
    let seconds = learner.seconds_per_step(&objective, &STEPS)?;
    Ok((settings.windows * settings.frames) as f64 / seconds)
}

fn noise(settings: &RecurrenceSettings, sizes: Sizes, step: u64) -> WindowBatch {
    let mut rng = generator(0, Stream::Recurrence, step);
    let mut numbers = |count: usize| (0..count).map(|_| normal(&mut rng)).collect();
    let frames = settings.windows * settings.frames;
    WindowBatch {
        frames: settings.frames,
        windows: settings.windows,
        sizes,
        inputs: numbers(frames * sizes.inputs),
        targets: numbers(frames * sizes.outputs),
        masks: [sizes.width, sizes.width].map(|width| vec![1.0; settings.windows * width]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Preset, StateSettings, TrainConfig};

    #[test]
    fn a_wider_recurrence_trains_more_slowly() {
        let config = TrainConfig::preset(Preset::Tiny);
        let StateSettings::Displacement { recurrence, .. } = config.model.state else {
            unreachable!("tiny's state is a displacement");
        };
        let narrow = recurrence.unwrap();
        let wide = RecurrenceSettings {
            width: 16 * narrow.width,
            ..narrow.clone()
        };
        let prior = PriorSizes {
            motion_len: 60,
            coefficients: 16,
        };
        let [narrow, wide] = [narrow, wide].map(|r| frames_per_second(&r, prior, Processor::Cpu).unwrap());
        assert!(wide > 0.0 && narrow > 2.0 * wide, "{narrow} {wide}");
    }
}
