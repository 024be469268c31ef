//! Shortens a run so that it fits into a given time on this machine.

mod field_plan;

use crate::{
    config::{RecurrenceSettings, StateSettings, TrainConfig},
    dataset::joint_springs,
    error::TrainError,
    fit::Fit,
    processor::Processor,
    recurrence::{MOST_FOLDS, PriorSizes, frames_per_second},
    sizing::fold_count,
    trainer::{Pace, Trainer},
};
use field_plan::FieldPace;
use std::time::{Duration, Instant};
use unic_core::motion::motion_len;
use unic_io::{Capture, Split};

/// Time that a run may take on this machine, counted from a moment on.
///
/// Plan a run in two steps: [`Budget::shorten_prior`] before the prior is trained,
/// [`Budget::set_steps`] after it.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Time for the whole run.
    pub duration: Duration,
    /// Start of the run.
    pub started: Instant,
}

/// Share of the budget that goes to the recurrence's steps. Loading, the rest of the prior and the
/// field's few steps take less than the other half.
const RECURRENCE_SHARE: f64 = 0.5;

/// Windows of a recurrence's step where time is short: many small steps do better then.
const SHORT_WINDOWS: usize = 8;

/// Frames of such a window.
const SHORT_FRAMES: usize = 64;

/// Time is short where it is enough for less than one in this many of the training samples that the
/// settings ask for. Little motion, whose frames are sampled more often in the same time, does
/// better with few large steps.
const SHORT_SHARE: u64 = 2;

impl Budget {
    /// Shortens the training of the prior's recurrence, after timing a few of its steps. Settings
    /// without a recurrence, or with one that fits, stay as they are.
    ///
    /// # Errors
    /// Clips that cannot be read, a processor that is not there.
    pub fn shorten_prior(
        &self,
        config: &mut TrainConfig,
        capture: &Capture,
        processor: Processor,
    ) -> Result<(), TrainError> {
        let skeleton = &capture.character.skeleton;
        let springs = joint_springs(&config.model.springs, skeleton);
        let views = if config.regularisation.mirror { 2 } else { 1 };
        let StateSettings::Displacement {
            recurrence: Some(recurrence),
            prior_shapes,
            ..
        } = &mut config.model.state
        else {
            return Ok(());
        };
        let motion = MotionSize::of(capture, views)?;
        let sizes = PriorSizes {
            motion_len: motion_len(skeleton.len()) + springs.numbers(),
            coefficients: *prior_shapes,
        };
        // A device elsewhere is no faster for more threads here.
        let threads = match processor {
            Processor::Cpu => rayon::current_num_threads(),
            _ => 1,
        };
        let rate = on_one_thread(|| frames_per_second(recurrence, sizes, processor))?;
        let samples = rate * self.duration.as_secs_f64();
        shorten(recurrence, &motion, samples, threads);
        Ok(())
    }

    /// Sets the steps of every fit to those that the rest of the budget has time for, after timing
    /// a few. With a prior, they never exceed the settings' own number: more steps make the field
    /// memorise the training motions.
    ///
    /// Where a sizing chooses the field, the budget holds for its trials too: fewer steps, then
    /// fewer sizes, the smallest ones. Where the time is too short for any, nothing is chosen.
    ///
    /// # Errors
    /// The errors of [`Trainer::pace`].
    pub fn set_steps(
        &self,
        config: &mut TrainConfig,
        trainer: &mut Trainer,
        fits: &[Fit],
    ) -> Result<(), TrainError> {
        let pace = trainer.pace()?;
        let field = field_pace(config, &pace, trainer, fits)?;
        // After all measurements, which take from the budget. The prior's time counts what an interrupted process before this one has spent on it.
        let spent = self
            .started
            .elapsed()
            .as_secs_f64()
            .max(trainer.time().prior_seconds);
        let left = self.duration.as_secs_f64() - spent;
        let most = trainer.config().optimiser.steps;
        if let Some(field) = field {
            let Some(plan) = field.plan(left, most) else {
                config.sizing.sizes.clear();
                let steps = pace.steps_within(left, fits, config.validation.every);
                config.set_steps(steps.min(UNSIZED_STEPS.min(most)));
                return Ok(());
            };
            config.sizing.sizes.truncate(plan.sizes);
            config.set_steps(plan.steps);
            return Ok(());
        }
        let steps = pace.steps_within(left, fits, config.validation.every);
        config.set_steps(match config.has_prior() {
            true => steps.min(trainer.config().optimiser.steps),
            false => steps,
        });
        Ok(())
    }
}

/// Largest number of steps of a field whose size and steps no sizing could choose in time.
const UNSIZED_STEPS: u64 = 100;

/// Times the steps of each size that a sizing would try. Returns none for a run without a sizing.
fn field_pace(
    config: &TrainConfig,
    pace: &Pace,
    trainer: &mut Trainer,
    fits: &[Fit],
) -> Result<Option<FieldPace>, TrainError> {
    let folds = trainer.on_all_known_clips(|data| (fold_count(&data.clips), data.clips.len()));
    let (folds, clips) = folds;
    if config.sizing.sizes.is_empty() || !config.has_prior() || folds == 0 {
        return Ok(None);
    }
    let mut step_by_size = Vec::new();
    for size in &config.sizing.sizes {
        step_by_size.push(trainer.seconds_per_step_of(*size)?);
    }
    let validated = trainer.data().validation.len().max(1);
    let validations = match fits.contains(&Fit::HeldOut) {
        true => 1.0 + trainer.config().optimiser.steps as f64 / config.validation.every as f64,
        false => 0.0,
    };
    Ok(Some(FieldPace {
        step_by_size,
        // A candidate is judged on fewer vertices than a model is, with all shares side by side.
        judgement: pace.judging * clips as f64 / validated as f64,
        validation: validations * pace.validation + pace.last_validation,
        folds,
        fits: fits.len(),
    }))
}

/// Runs on a thread pool of one thread, as each fold's training does.
fn on_one_thread<T: Send>(run: impl FnOnce() -> Result<T, TrainError> + Send) -> Result<T, TrainError> {
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(run),
        // A machine that starts no more threads: the measurement then uses the present ones.
        Err(_) => run(),
    }
}

/// Amount of motion to train on.
struct MotionSize {
    clips: usize,
    /// Frames in all views: mirrored ones count too.
    frames: u64,
}

impl MotionSize {
    fn of(capture: &Capture, views: u64) -> Result<Self, TrainError> {
        let names = capture.clip_names(Split::Train);
        let mut frames = 0;
        for name in names {
            frames += views * capture.summarise_clip(name)?.pose_frames as u64;
        }
        Ok(Self {
            clips: names.len(),
            frames,
        })
    }
}

/// Shortens the recurrence's training to its share of a budget in which one thread could compute so
/// many training samples.
fn shorten(recurrence: &mut RecurrenceSettings, motion: &MotionSize, samples: f64, threads: usize) {
    let folds = motion.clips.clamp(2, MOST_FOLDS);
    // All folds, each without a part of the motion, run at once on the threads; then one training
    // on all of it.
    let rounds = (folds - 1) as f64 / threads.clamp(1, folds) as f64 + 1.0;
    let affordable = (RECURRENCE_SHARE * samples / rounds) as u64;
    let in_a_step = (recurrence.windows * recurrence.frames) as u64;
    let all = recurrence.epochs.saturating_mul(motion.frames);
    let wanted = recurrence.steps.saturating_mul(in_a_step).min(all);
    if affordable >= wanted {
        return;
    }
    if affordable < wanted / SHORT_SHARE {
        recurrence.windows = recurrence.windows.min(SHORT_WINDOWS);
        recurrence.frames = recurrence.frames.min(SHORT_FRAMES);
    }
    let in_a_step = (recurrence.windows * recurrence.frames).max(1) as u64;
    recurrence.steps = (affordable / in_a_step).max(1);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Preset;

    /// Steps, and training samples in each.
    fn shortened(motion: &MotionSize, seconds: u64, threads: usize) -> (u64, u64) {
        let config = TrainConfig::preset(Preset::Standard);
        let StateSettings::Displacement { recurrence, .. } = config.model.state else {
            unreachable!("standard's state is a displacement");
        };
        let mut recurrence = recurrence.unwrap();
        shorten(&mut recurrence, motion, 25_000.0 * seconds as f64, threads);
        (recurrence.steps, (recurrence.windows * recurrence.frames) as u64)
    }

    #[test]
    fn short_budget_shortens_the_prior_with_all_its_folds() {
        let steps = |clips: usize, seconds: u64, threads: usize| {
            let frames = 1_000_000;
            let (steps, in_a_step) = shortened(&MotionSize { clips, frames }, seconds, threads);
            assert_eq!(in_a_step, 8 * 64);
            steps
        };
        // Half of 512 s makes 6.4 million frames at 25,000 a second, 12,500 steps, which five folds
        // share.
        assert_eq!(steps(20, 512, 1), 2_500);
        assert_eq!(steps(5, 512, 1), 2_500);
        assert_eq!(steps(2, 512, 1), 6_250);
        // Folds train at once, the last training alone; more threads than folds are of no use.
        assert_eq!(steps(20, 512, 4), 6_250);
        assert_eq!(steps(20, 512, 5), steps(20, 512, 64));
        assert_eq!(steps(20, 0, 1), 1);
    }

    #[test]
    fn shortened_prior_depends_on_the_amount_of_motion() {
        let (steps, in_a_step) = (3000, 32 * 96);
        let much = MotionSize {
            clips: 20,
            frames: 1_000_000,
        };
        assert_eq!(shortened(&much, 1_000_000, 1), (steps, in_a_step));
        // Little motion asks for 600 thousand training samples: 240 s.
        let little = MotionSize {
            clips: 20,
            frames: 4_000,
        };
        assert_eq!(shortened(&little, 241, 1), (steps, in_a_step));
        // A little less time makes fewer steps, half of it small ones.
        assert_eq!(shortened(&little, 239, 1), (597_500 / in_a_step, in_a_step));
        assert_eq!(shortened(&little, 121, 1).1, in_a_step);
        assert_eq!(shortened(&little, 119, 1), (297_500 / 512, 512));
    }
}
