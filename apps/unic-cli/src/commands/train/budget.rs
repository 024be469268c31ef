//! What fits into a time.

use super::load;
use crate::{args::TrainArgs, interrupt, output::say, settings};
use anyhow::Result;
use std::time::{Duration, Instant};
use unic_core::motion::motion_len;
use unic_io::{Capture, Split};
use unic_train::{
    Dataset, Fit, MOST_FOLDS, Processor, RecurrenceSettings, StateSettings, TrainConfig, Trainer,
};

/// Settings, and the data of the first fit where a budget has asked for it.
pub(super) fn settings_of_a_new_run(
    args: &TrainArgs,
    capture: &Capture,
    started: Instant,
) -> Result<(TrainConfig, Option<Dataset>)> {
    let mut config = settings::of_new_run(args)?;
    let Some(budget) = args.budget else {
        return Ok((config, None));
    };
    let views = if config.regularisation.mirror { 2 } else { 1 };
    if let StateSettings::Displacement {
        recurrence: Some(recurrence),
        prior_shapes,
        ..
    } = &mut config.model.state
    {
        let motion = Motion::of(capture, views)?;
        let sizes = [motion_len(capture.character.skeleton.len()), *prior_shapes];
        let processor = args.device.into();
        // A device elsewhere is no faster for more threads here.
        let threads = match processor {
            Processor::Cpu => rayon::current_num_threads(),
            _ => 1,
        };
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let rate = alone.install(|| recurrence.frames_a_second(sizes, processor))?;
        shorten(recurrence, &motion, rate * budget.as_secs_f64(), threads);
    }
    let (steps, most, data) = steps_within(args.device.into(), capture, &config, budget, started)?;
    config.set_steps(match config.has_prior() {
        // More of them teach the field the training motions by heart.
        true => steps.min(most),
        false => steps,
    });
    Ok((config, Some(data)))
}

/// Part of a short budget that goes to the recurrence's steps. Loading, the rest of the prior and the field's few steps
/// take less than what is left.
const RECURRENCE_SHARE: f64 = 0.5;

/// Windows of a step where time is short, and their frames: many small steps do better then.
const SHORT_WINDOWS: [usize; 2] = [8, 64];

/// Time is that short where it is enough for less than one in this many of the looks at frames that are asked
/// for. Half a minute of motion, which is looked at more often in little time, teaches better in few large steps.
const SHORT_SHARE: u64 = 2;

/// What there is to train on.
struct Motion {
    clips: usize,
    /// In all views: mirrored ones count too.
    frames: u64,
}

impl Motion {
    fn of(capture: &Capture, views: u64) -> Result<Self> {
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

/// Leaves a part of a budget, where it is short, to all beside the recurrence. `looks` are the frames that one
/// thread could teach the recurrence in the whole of it.
fn shorten(recurrence: &mut RecurrenceSettings, motion: &Motion, looks: f64, threads: usize) {
    let folds = motion.clips.clamp(2, MOST_FOLDS);
    // Of the folds, each a little shorter, and then of all clips.
    let rounds = (folds - 1) as f64 / threads.clamp(1, folds) as f64 + 1.0;
    let affordable = (RECURRENCE_SHARE * looks / rounds) as u64;
    let in_a_step = (recurrence.windows * recurrence.frames) as u64;
    let all = recurrence.epochs.saturating_mul(motion.frames);
    let wanted = recurrence.steps.saturating_mul(in_a_step).min(all);
    if affordable >= wanted {
        return;
    }
    if affordable < wanted / SHORT_SHARE {
        let [windows, frames] = SHORT_WINDOWS;
        recurrence.windows = recurrence.windows.min(windows);
        recurrence.frames = recurrence.frames.min(frames);
    }
    let in_a_step = (recurrence.windows * recurrence.frames).max(1) as u64;
    recurrence.steps = (affordable / in_a_step).max(1);
}

/// Steps of every fit that the rest of the budget has time for, and those that the settings ask for.
fn steps_within(
    processor: Processor,
    capture: &Capture,
    config: &TrainConfig,
    budget: Duration,
    started: Instant,
) -> Result<(u64, u64, Dataset)> {
    say("timing a few steps to fill the budget");
    let fits = Fit::of_run(capture, config);
    let data = load(capture, config, fits[0], processor)?;
    interrupt::check()?;
    let trainer = Trainer::new(data, config.clone())?;
    let pace = trainer.pace()?;
    interrupt::check()?;
    let left = budget.saturating_sub(started.elapsed()).as_secs_f64();
    let steps = pace.steps_within(left, fits, config.validation.every);
    Ok((steps, trainer.config().optimiser.steps, trainer.into_data()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_train::Preset;

    fn shortened(motion: &Motion, seconds: u64, threads: usize) -> [u64; 2] {
        let config = TrainConfig::preset(Preset::Standard);
        let StateSettings::Displacement { recurrence, .. } = config.model.state else {
            unreachable!("standard's state is a displacement");
        };
        let mut recurrence = recurrence.unwrap();
        shorten(&mut recurrence, motion, 25_000.0 * seconds as f64, threads);
        [recurrence.steps, (recurrence.windows * recurrence.frames) as u64]
    }

    #[test]
    fn a_short_budget_shortens_the_prior_by_what_its_folds_take() {
        let steps = |clips: usize, seconds: u64, threads: usize| {
            let frames = 1_000_000;
            let [steps, in_a_step] = shortened(&Motion { clips, frames }, seconds, threads);
            assert_eq!(in_a_step, 8 * 64);
            steps
        };
        // Half of 512 s makes 6.4 million frames at 25,000 a second, 12,500 steps, which five folds share.
        assert_eq!(steps(20, 512, 1), 2_500);
        assert_eq!(steps(5, 512, 1), 2_500);
        assert_eq!(steps(2, 512, 1), 6_250);
        // Folds train at once, the last training alone; more threads than folds are of no use.
        assert_eq!(steps(20, 512, 4), 6_250);
        assert_eq!(steps(20, 512, 5), steps(20, 512, 64));
        assert_eq!(steps(20, 0, 1), 1);
    }

    #[test]
    fn what_a_budget_leaves_of_the_prior_depends_on_the_motion() {
        let [steps, in_a_step] = [3000, 32 * 96];
        let much = Motion {
            clips: 20,
            frames: 1_000_000,
        };
        assert_eq!(shortened(&much, 1_000_000, 1), [steps, in_a_step]);
        // 600 thousand looks at its frames are all that little motion asks for: 240 s.
        let little = Motion {
            clips: 20,
            frames: 4_000,
        };
        assert_eq!(shortened(&little, 241, 1), [steps, in_a_step]);
        // A little less makes fewer steps, half of it small ones.
        assert_eq!(shortened(&little, 239, 1), [597_500 / in_a_step, in_a_step]);
        assert_eq!(shortened(&little, 121, 1)[1], in_a_step);
        assert_eq!(shortened(&little, 119, 1), [297_500 / 512, 512]);
    }
}
