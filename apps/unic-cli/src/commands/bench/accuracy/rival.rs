//! Training and timing of networks to compare with.

use crate::{commands::eval::timing::median_of_frames, interrupt, progress::Progress};
use anyhow::{Result, bail};
use std::{
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};
use unic_core::motion::{MotionLayout, MotionSpec, VelocityScheme};
use unic_eval::{Mode, Predictor, PreparedClip, training_set_of};
use unic_io::{Capture, Split};
use unic_train::{RivalConfig, RivalPredictor, RivalTrainer, TrainError};

/// What a training may take.
#[derive(Clone, Copy, Debug)]
pub(super) enum Budget {
    /// Optimiser steps.
    Steps(u64),
    /// Wall-clock time, loading included.
    Time(Duration),
}

/// What came of a training.
pub(super) struct TrainedRival {
    pub(super) predictor: RivalPredictor,
    pub(super) steps: u64,
    /// Training alone, without loading.
    pub(super) seconds: f64,
    pub(super) parameters: usize,
}

/// Trains on the training clips. Nothing of it is kept when it is stopped: it takes minutes.
pub(super) fn train(
    config: &RivalConfig,
    seed: u64,
    budget: Budget,
    capture: &Capture,
) -> Result<TrainedRival> {
    let started = Instant::now();
    let mut config = RivalConfig {
        seed,
        ..config.clone()
    };
    if let Budget::Steps(steps) = budget {
        config.optimiser.steps = steps;
    }
    let character = &capture.character;
    let spec = MotionSpec::new(config.layout, config.velocity, capture.contact_joints, character)?;
    let set = training_set_of(capture, &spec)?;
    let mut trainer = RivalTrainer::new(&set, &spec, &character.skeleton, config)?;
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
    Ok(TrainedRival {
        predictor,
        steps,
        seconds: begun.elapsed().as_secs_f64(),
        parameters,
    })
}

/// Median of a frame in free running on the first test clip, milliseconds; joints and motion vectors are
/// made before.
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
