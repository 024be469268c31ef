//! `unic train`.

mod budget;
mod listener;
mod result;

use crate::{
    args::{ProcessorName, TrainArgs},
    failure::{Interrupted, Usage},
    interrupt,
    output::{print, print_json, say},
    outputs::{Existing, Outputs},
    progress::Progress,
    run_folder::{Earlier, RunFolder, RunRecord},
    settings,
};
use anyhow::{Context, Result};
use clap::ValueEnum;
use listener::Listener;
pub(crate) use result::Summary;
use result::Trained;
use std::{
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::Instant,
};
use unic_io::Capture;
use unic_train::{
    Checkpoint, Dataset, Fit, Outcome, Processor, TrainConfig, TrainError, Trainer, TrainingTime, Validation,
};

/// Trains, writes the model and says so.
pub(crate) fn run(args: &TrainArgs) -> Result<()> {
    let summary = train(args)?;
    match args.json {
        true => print_json(&summary),
        false => print(&summary.closing_words(&args.capture)),
    }
}

/// Trains and writes the model, and prints nothing but progress.
pub(crate) fn train(args: &TrainArgs) -> Result<Summary> {
    let started = Instant::now();
    let processor = Processor::from(args.device);
    if !processor.is_built() {
        return Err(Usage(TrainError::NotBuilt { processor }.to_string()).into());
    }
    let capture = Capture::open(&args.capture)?;
    let out = args.out.clone().unwrap_or_else(|| default_out(&capture));
    check_outputs(args, &out)?;
    let folder = RunFolder::open(&out, earlier(args))?;
    let record = RunRecord::new(&capture, preset_name(args))?;
    if !args.resume {
        args.force.capture(&capture)?;
    }
    interrupt::check()?;
    let (config, timed) = match args.resume {
        true => (settings_of_the_run(args, &record, &folder)?, None),
        false => budget::settings_of_a_new_run(args, &capture, started)?,
    };
    let mut run = Run {
        fits: Fit::of_run(&capture, &config),
        resume_command: resume_command(args, &out),
        capture,
        config,
        folder,
        out,
    };
    let data = timed.map_or_else(|| load(&run.capture, &run.config, run.fits[0], processor), Ok)?;
    let first = Trainer::new(data, run.config.clone())?;
    // Epochs are so many steps now.
    run.config = first.config().clone();
    interrupt::check()?;
    if !args.resume {
        run.folder.begin(&run.config, &record)?;
    }
    run.folder.log(&super::machine())?;
    let _saving = interrupt::saving();
    run.train(first)?.deliver()
}

/// The run's folder has its own rule about an earlier run.
fn check_outputs(args: &TrainArgs, out: &Path) -> Result<()> {
    // A resumed run may be asked for with its own settings again.
    let config = args.config.iter().filter(|_| !args.resume);
    let own = ["config.toml", "run.toml", "metrics.jsonl", "log.txt"].map(str::to_owned);
    Outputs::beside(std::iter::once(&args.capture).chain(config))
        .file(out)
        .folder(&out.with_extension("run"), own)
        .check(Existing::Resumed)
}

fn earlier(args: &TrainArgs) -> Earlier {
    match (args.resume, args.overwrite) {
        (true, _) => Earlier::Resume,
        (_, true) => Earlier::Overwrite,
        _ => Earlier::Refuse,
    }
}

/// The capture's name as a file name.
fn default_out(capture: &Capture) -> PathBuf {
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

/// Opens the clips of a fit and fits its prior.
fn load(capture: &Capture, config: &TrainConfig, fit: Fit, processor: Processor) -> Result<Dataset> {
    let progress: Mutex<Option<Progress>> = Mutex::new(None);
    let watch = |done: u64, all: u64| {
        let mut progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
        let shown = progress.get_or_insert_with(|| Progress::new("fitting the prior", 0, all));
        shown.set(done, String::new);
        interrupt::control()
    };
    match Dataset::watched(capture.clone(), config, fit, processor, &watch) {
        Err(TrainError::Stopped) => {
            interrupt::check()?;
            Err(TrainError::Stopped.into())
        }
        result => Ok(result?),
    }
}

fn settings_of_the_run(args: &TrainArgs, now: &RunRecord, folder: &RunFolder) -> Result<TrainConfig> {
    let record = folder.stored_record()?;
    if args.preset.is_some() && now.preset != record.preset {
        let (path, kept, asked) = (folder.path().display(), &record.preset, &now.preset);
        return Err(Usage(format!(
            "{path}: expected --resume to keep the preset {kept}, found {asked} asked for"
        ))
        .into());
    }
    record.check(now, &args.capture)?;
    settings::of_resumed_run(args, folder.stored_config()?, &folder.config())
}

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

/// A run: the same settings for one fit or two, in one folder.
struct Run {
    capture: Capture,
    config: TrainConfig,
    fits: &'static [Fit],
    folder: RunFolder,
    out: PathBuf,
    resume_command: String,
}

impl Run {
    /// Trains all fits, each from where its newest checkpoint has left it; the last one is the model.
    fn train(&self, first: Trainer) -> Result<Trained<'_>> {
        let mut listener = Listener::new(
            self.folder.metrics(),
            self.fits.len(),
            self.config.optimiser.steps,
        );
        let mut trainer = self.resumed(first)?;
        // A run that is made longer is so from here on.
        self.folder.write_config(&self.config)?;
        say(&result::summary(self, &trainer)?);
        let mut other = TrainingTime::default();
        self.fit(&mut trainer, &mut listener, other)?;
        let begun = Instant::now();
        let validation = self.validated(&trainer)?;
        other.seconds += begun.elapsed().as_secs_f64();
        for _ in &self.fits[1..] {
            other = other + trainer.time();
            self.stop_if_asked(&trainer)?;
            let data = trainer.into_data().on_all_clips();
            let data = data.context("a clip that comes back is held out of the first of two fits")?;
            // As many steps as the first fit has, whatever number of epochs that is of more clips.
            let mut config = self.config.clone();
            config.set_steps(config.optimiser.steps);
            trainer = self.resumed(Trainer::new(data, config)?)?;
            self.stop_if_asked(&trainer)?;
            self.fit(&mut trainer, &mut listener, other)?;
        }
        drop(listener);
        trainer.set_other_time(other);
        if let Some(validation) = &validation {
            trainer.set_validation(validation.clone());
        }
        Ok(Trained {
            run: self,
            time: other + trainer.time(),
            trainer,
            validation,
        })
    }

    fn resumed(&self, mut trainer: Trainer) -> Result<Trainer> {
        let folder = self.folder.checkpoints(trainer.data().fit);
        if let Some(checkpoint) = Checkpoint::newest(&folder)? {
            trainer.resume(checkpoint, &folder)?;
        }
        Ok(trainer)
    }

    fn fit(&self, trainer: &mut Trainer, listener: &mut Listener, other: TrainingTime) -> Result<()> {
        listener.begin(trainer, other)?;
        let folder = self.folder.checkpoints(trainer.data().fit);
        let outcome = trainer.run(Some(&folder), &mut |event| listener.listen(event));
        match (outcome?, listener.error.take()) {
            (_, Some(error)) => Err(error),
            (Outcome::Finished, None) => Ok(()),
            (Outcome::Stopped, None) => Err(self.stopped(trainer)?.into()),
        }
    }

    /// The error on the clips that the first fit held out; none where it held out none.
    fn validated(&self, trainer: &Trainer) -> Result<Option<Validation>> {
        let validation = match trainer.validation(&interrupt::control) {
            Err(TrainError::Stopped) => return Err(self.stopped(trainer)?.into()),
            validation => validation?,
        };
        if let Some(validation) = &validation {
            self.folder.log(&format!(
                "{}: {:.2} mm on {} with {} % of the field after {:.0} s",
                validation.fit.name(),
                validation.rmse_mm,
                validation.clips.join(", "),
                100.0 * validation.field_share,
                trainer.time().seconds
            ))?;
        }
        Ok(validation)
    }

    /// Between fits everything is saved.
    fn stop_if_asked(&self, trainer: &Trainer) -> Result<()> {
        match interrupt::is_asked() {
            true => Err(self.stopped(trainer)?.into()),
            false => Ok(()),
        }
    }

    fn stopped(&self, trainer: &Trainer) -> Result<Interrupted> {
        let (step, total) = (trainer.step(), self.config.optimiser.steps);
        let fit = match trainer.data().fit {
            Fit::HeldOut => "",
            Fit::AllClips => " of the fit on all clips",
        };
        self.folder
            .log(&format!("stopped at step {step} of {total}{fit}"))?;
        Ok(Interrupted(format!(
            "stopped at step {step} of {total}{fit}, which is saved; go on with `{}`",
            self.resume_command
        )))
    }
}
