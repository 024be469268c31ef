//! Training and timing of networks of other methods.

use crate::comparison::{ComparisonConfig, ComparisonPredictor, ComparisonTrainer};
use anyhow::{Result, bail};
use std::{
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};
use unic_cli::{interrupt, progress::Progress, timing::median_of_frames};
use unic_core::motion::{MotionLayout, MotionSpec, VelocityScheme};
use unic_eval::{Mode, Predictor, PreparedClip, training_set_of};
use unic_io::{Capture, Split};
use unic_train::TrainError;

/// Budget of a training.
#[derive(Clone, Copy, Debug)]
pub(super) enum Budget {
    /// Number of optimiser steps.
    Steps(u64),
    /// Wall-clock time, with loading.
    Time(Duration),
}

/// Trained network of another method.
pub(super) struct TrainedNetwork {
    pub(super) predictor: ComparisonPredictor,
    /// Number of optimiser steps.
    pub(super) steps: u64,
    /// Duration of the training without loading, seconds.
    pub(super) seconds: f64,
    /// Number of trained parameters.
    pub(super) parameters: usize,
}

/// Trains a network on the training clips. A training that is stopped leaves nothing, since it
/// takes only minutes.
pub(super) fn train(
    config: &ComparisonConfig,
    seed: u64,
    budget: Budget,
    capture: &Capture,
) -> Result<TrainedNetwork> {
    let started = Instant::now();
    let mut config = ComparisonConfig {
        seed,
        ..config.clone()
    };
    if let Budget::Steps(steps) = budget {
        config.optimiser.steps = steps;
    }
    let character = &capture.character;
    let spec = MotionSpec::new(config.layout, config.velocity, capture.contact_joints, character)?;
    let set = training_set_of(capture, &spec)?;
    let mut trainer = ComparisonTrainer::new(&set, &spec, &character.skeleton, config)?;
    interrupt::check()?;
    if let Budget::Time(time) = budget {
        trainer.fill(time.saturating_sub(started.elapsed()).as_secs_f64())?;
    }
    let (steps, parameters) = (trainer.steps(), trainer.parameter_count());
    let progress = Mutex::new(Progress::new("training", 0, steps));
    let watch = |done: u64, _: u64| {
        let mut progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
        progress.set(done, String::new);
        interrupt::control()
    };
    let begun = Instant::now();
    let predictor = match trainer.train(&watch) {
        Err(TrainError::Stopped) => {
            interrupt::check()?;
            return Err(TrainError::Stopped.into());
        }
        result => result?,
    };
    Ok(TrainedNetwork {
        predictor,
        steps,
        seconds: begun.elapsed().as_secs_f64(),
        parameters,
    })
}

/// Returns the median time of a frame in free running on the first test clip, milliseconds. Joints
/// and motion vectors are computed before.
pub(super) fn frame_ms(predictor: &mut dyn Predictor, capture: &Capture) -> Result<f64> {
    let Some(name) = capture.clip_names(Split::Test).first() else {
        bail!("expected clips to time the network on, found none")
    };
    let (layout, velocity) = (MotionLayout::Heading, VelocityScheme::Backward);
    let spec = MotionSpec::new(layout, velocity, capture.contact_joints, &capture.character)?;
    let clip = PreparedClip::new(&spec, &capture.character.skeleton, capture.load_clip(name)?);
    let failed = |e: unic_eval::PredictorError| anyhow::anyhow!("{e}");
    predictor.start(&clip, Mode::FreeRunning).map_err(failed)?;
    let mut positions = Vec::new();
    median_of_frames(clip.len(), |t| {
        predictor.predict(&clip, t, &mut positions).map_err(failed)
    })
}
