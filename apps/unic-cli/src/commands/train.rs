//! The command `unic train`: trains a model on a capture, in one fit or two.
//!
//! A fit is one training from scratch. The first fit of two holds a clip out and measures the error
//! on it; the second trains on all clips and is the model. Both keep their state in the run folder.

mod listener;
mod prepare;
mod preview;
mod result;
mod sizing_progress;
#[cfg(feature = "viewer")]
mod window;

use crate::{
    args::{ProcessorName, TrainArgs},
    failure::{Interrupted, Usage},
    interrupt, machine,
    output::{print, print_json, print_status},
    outputs::{Existing, Outputs},
    progress::Progress,
    run_folder::{EarlierRun, RunFolder, RunRecord},
    settings,
};
use anyhow::{Context, Result};
use clap::ValueEnum;
use listener::TrainingListener;
use prepare::Preparation;
use preview::Preview;
use result::FinishedRun;
pub use result::TrainingSummary;
use std::{
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};
use unic_io::Capture;
use unic_train::{
    Budget, Checkpoint, Fit, Outcome, Processor, Sizing, TrainConfig, TrainError, Trainer, TrainingTime,
    Validation,
};

/// Trains, writes the model and prints a summary.
///
/// # Errors
/// A capture, a setting or an output that is refused, and an interrupted training.
pub(crate) fn run(args: &TrainArgs) -> Result<()> {
    #[cfg(feature = "viewer")]
    let summary = match args.view {
        true => window::train(args)?,
        false => train(args)?,
    };
    #[cfg(not(feature = "viewer"))]
    let summary = train(args)?;
    match args.json {
        true => print_json(&summary),
        false => print(&summary.text(&args.capture)),
    }
}

/// Trains and writes the model. Prints nothing but progress.
///
/// # Errors
/// A capture, a setting or an output that is refused, and an interrupted training.
pub fn train(args: &TrainArgs) -> Result<TrainingSummary> {
    train_previewed(args, None)
}

/// Trains as [`train`] does, and shows the models of validations.
fn train_previewed(args: &TrainArgs, preview: Option<Preview>) -> Result<TrainingSummary> {
    let started = Instant::now();
    let processor = Processor::from(args.device);
    if !processor.is_built() {
        return Err(Usage(TrainError::NotBuilt { processor }.to_string()).into());
    }
    let capture = Capture::open(&args.capture)?;
    let out = args.out.clone().unwrap_or_else(|| default_out(&capture));
    check_outputs(args, &out)?;
    let folder = RunFolder::open(&out, earlier_run(args))?;
    let record = RunRecord::new(&capture, preset_name(args))?;
    // A resumed run has passed the check when it began.
    if !args.resume {
        args.force.check_capture(&capture)?;
    }
    interrupt::check()?;
    let (config, duration) = match args.resume {
        true => settings_of_resumed_run(args, &record, &folder)?,
        false => (settings::of_new_run(args)?, args.budget),
    };
    let mut run = Run {
        fits: Fit::of_run(&capture, &config),
        resume_command: resume_command(args, &out),
        capture,
        config,
        folder,
        out,
        processor,
        sizing: None,
        preview,
    };
    if args.resume {
        run.folder.log(&machine::description())?;
    }
    let preparation = Preparation {
        run: &mut run,
        processor,
        new: (!args.resume).then_some(record),
        budget: duration.map(|duration| Budget { duration, started }),
    };
    let first = preparation.trainer()?;
    run.stop_if_asked(&first)?;
    let _saving = interrupt::begin_saving();
    run.train(first)?.write_model()
}

/// Refuses outputs that are inputs or belong to a capture.
///
/// An earlier run or model is the business of [`RunFolder::open`].
fn check_outputs(args: &TrainArgs, out: &Path) -> Result<()> {
    // A resumed run may name its own config.toml as --config: it is read and not replaced.
    let config = args.config.iter().filter(|_| !args.resume);
    let own = ["config.toml", "run.toml", "metrics.jsonl", "log.txt"].map(str::to_owned);
    Outputs::with_inputs(std::iter::once(&args.capture).chain(config))
        .file(out)
        .folder(&out.with_extension("run"), own)
        .check(Existing::Resumed)
}

fn earlier_run(args: &TrainArgs) -> EarlierRun {
    match (args.resume, args.overwrite) {
        (true, _) => EarlierRun::Resume,
        (_, true) => EarlierRun::Overwrite,
        _ => EarlierRun::Refuse,
    }
}

/// Path of the model without `--out`: the capture's name in the working folder.
fn default_out(capture: &Capture) -> PathBuf {
    // The name is free text, which may hold slashes or dots.
    let plain = |c: char| {
        if c.is_alphanumeric() || "-_".contains(c) {
            c
        } else {
            '_'
        }
    };
    let name: String = capture.manifest.name.chars().map(plain).collect();
    PathBuf::from(format!("{name}.unic"))
}

fn preset_name(args: &TrainArgs) -> String {
    let value = args.preset.and_then(|preset| preset.to_possible_value());
    value.map_or_else(|| "standard".to_owned(), |value| value.get_name().to_owned())
}

/// Settings of the run in the folder, changed by the command line where that is allowed, and its
/// budget if its steps are still to be planned.
///
/// # Errors
/// Another preset or capture than the run began with, settings that may not change.
fn settings_of_resumed_run(
    args: &TrainArgs,
    now: &RunRecord,
    folder: &RunFolder,
) -> Result<(TrainConfig, Option<Duration>)> {
    let record = folder.stored_record()?;
    if args.preset.is_some() && now.preset != record.preset {
        let (path, kept, asked) = (folder.path().display(), &record.preset, &now.preset);
        return Err(Usage(format!(
            "{path}: expected --resume to keep the preset {kept}, found {asked} asked for"
        ))
        .into());
    }
    record.check(now, &args.capture)?;
    let config = settings::of_resumed_run(args, folder.stored_config()?, &folder.config())?;
    Ok((config, record.budget()))
}

/// Command line that continues the run.
fn resume_command(args: &TrainArgs, out: &Path) -> String {
    let device = match args.device {
        ProcessorName::Cpu => String::new(),
        other => format!(" --device {}", Processor::from(other)),
    };
    format!(
        "unic train {} --out {}{device} --resume",
        args.capture.display(),
        out.display()
    )
}

/// Training run: one fit or two with the same settings, in one folder.
struct Run {
    capture: Capture,
    config: TrainConfig,
    fits: &'static [Fit],
    folder: RunFolder,
    out: PathBuf,
    resume_command: String,
    processor: Processor,
    /// Choice of the field's size. `None` before it is made, and where the settings ask for none.
    sizing: Option<Sizing>,
    /// Window that shows the models of validations.
    preview: Option<Preview>,
}

impl Run {
    /// Trains all fits, each from its newest checkpoint. The last one is the model.
    ///
    /// # Errors
    /// A failure of the training or of its files, an interruption.
    fn train(&self, first: Trainer) -> Result<FinishedRun<'_>> {
        let mut listener = TrainingListener::new(
            self.folder.metrics(),
            self.fits.len(),
            first.config().optimiser.steps,
        )
        .with_preview(self.preview.clone());
        let mut trainer = self.resumed(first)?;
        // `--resume` may have made the run longer.
        self.folder.write_config(&self.config)?;
        print_status(&result::opening_text(self, &trainer)?);
        // Training time of the run outside of the present fit.
        let mut other = TrainingTime {
            seconds: self.sizing.as_ref().map_or(0.0, |sizing| sizing.seconds),
            prior_seconds: 0.0,
        };
        self.fit(&mut trainer, &mut listener, other)?;
        let begun = Instant::now();
        let validation = self.validated(&trainer)?;
        other.seconds += begun.elapsed().as_secs_f64();
        for _ in &self.fits[1..] {
            other = other + trainer.time();
            self.stop_if_asked(&trainer)?;
            let data = trainer.into_data().on_all_clips();
            let data = data.context("the first of two fits holds out a clip that returns to training")?;
            // The same number of steps as the first fit, which are fewer epochs of more clips.
            let mut config = self.config.clone();
            config.set_steps(config.optimiser.steps);
            let next = Trainer::sized(self.processor, data, &config, self.sizing.as_ref())?;
            trainer = self.resumed(next)?;
            self.stop_if_asked(&trainer)?;
            self.fit(&mut trainer, &mut listener, other)?;
        }
        drop(listener);
        trainer.set_other_time(other);
        if let Some(validation) = &validation {
            trainer.set_validation(validation.clone());
        }
        Ok(FinishedRun {
            run: self,
            time: other + trainer.time(),
            trainer,
            validation,
        })
    }

    /// Has a sizing left the field out?
    fn has_no_field(&self) -> bool {
        self.sizing.as_ref().is_some_and(|sizing| sizing.share == 0.0)
    }

    /// Trainer in the state of its newest checkpoint, if there is one.
    fn resumed(&self, mut trainer: Trainer) -> Result<Trainer> {
        let folder = self.folder.checkpoints(trainer.data().fit);
        if let Some(checkpoint) = Checkpoint::newest(&folder)? {
            trainer.resume(checkpoint, &folder)?;
        }
        Ok(trainer)
    }

    /// Trains one fit to its end. `other` is the training time of the run before it.
    fn fit(&self, trainer: &mut Trainer, listener: &mut TrainingListener, other: TrainingTime) -> Result<()> {
        listener.begin(trainer, other)?;
        let folder = self.folder.checkpoints(trainer.data().fit);
        let outcome = trainer.run(Some(&folder), &mut |event| listener.listen(event));
        // An error of the listener stops the training, whose outcome is then of no interest.
        match (outcome?, listener.error.take()) {
            (_, Some(error)) => Err(error),
            (Outcome::Finished, None) => Ok(()),
            (Outcome::Stopped, None) => Err(self.stopped(trainer)?.into()),
        }
    }

    /// Measures the error on the clips that the fit held out, with progress. `None` if it held out none.
    fn validated(&self, trainer: &Trainer) -> Result<Option<Validation>> {
        let frames = trainer.most_validation_frames();
        let shown = Mutex::new((0, Progress::new("validating", 0, frames)));
        let ask = || {
            // A panic while it is shown does not harm the progress.
            let (done, progress) = &mut *shown.lock().unwrap_or_else(PoisonError::into_inner);
            *done = frames.min(*done + 1);
            progress.set(*done, || "at most".into());
            interrupt::control()
        };
        let validation = trainer.validation(&ask);
        drop(shown);
        let validation = match validation {
            Err(TrainError::Stopped) => return Err(self.stopped(trainer)?.into()),
            validation => validation?,
        };
        if let Some(validation) = &validation {
            for trial in &validation.trials {
                self.folder.log(&format!("shown cloth: {trial}"))?;
            }
            let bending = validation.bending;
            let bending = bending.map_or_else(String::new, |b| format!(", bending {b} of the projection"));
            let chords = validation.chord_deviations;
            let chords = chords.map_or_else(String::new, |c| format!(", chords from {c} deviations"));
            let order = validation.order;
            let order = order.map_or_else(String::new, |o| format!(", order {o} of the projection"));
            let replay = validation.replay_factor;
            let replay = replay.map_or_else(String::new, |f| format!(", {f} times the replay"));
            self.folder.log(&format!(
                "{}: {:.2} mm on {} with {} % of the field{bending}{chords}{order}{replay} after {:.0} s",
                validation.fit.name(),
                validation.rmse_mm,
                validation.clips.join(", "),
                100.0 * validation.field_share,
                trainer.time().seconds
            ))?;
        }
        Ok(validation)
    }

    /// Returns an error if the user has asked to stop. Between fits there is nothing left to save.
    fn stop_if_asked(&self, trainer: &Trainer) -> Result<()> {
        match interrupt::is_requested() {
            true => Err(self.stopped(trainer)?.into()),
            false => Ok(()),
        }
    }

    /// Logs the interruption and returns its message, which names the step and the command to
    /// continue.
    fn stopped(&self, trainer: &Trainer) -> Result<Interrupted> {
        let (step, total) = (trainer.step(), trainer.config().optimiser.steps);
        let fit = match trainer.data().fit {
            Fit::HeldOut => "",
            Fit::AllClips => " of the fit on all clips",
        };
        self.folder
            .log(&format!("stopped at step {step} of {total}{fit}"))?;
        Ok(Interrupted(format!(
            "stopped at step {step} of {total}{fit}, which is saved; continue with `{}`",
            self.resume_command
        )))
    }
}
