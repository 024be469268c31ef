//! `unic train`.

use crate::{
    args::TrainArgs,
    failure::{Interrupted, Usage},
    interrupt, model_file,
    output::{print, print_json, say},
    progress::Progress,
    run_folder::{Earlier, MetricsLog, RunFolder, RunRecord},
    settings,
};
use anyhow::{Error, Result};
use clap::ValueEnum;
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};
use unic_io::Capture;
use unic_train::{Checkpoint, Control, Dataset, Event, Outcome, TrainConfig, Trainer, free_running_rmse};

/// Trains and writes the model.
pub(crate) fn run(args: &TrainArgs) -> Result<()> {
    let capture = Capture::open(&args.capture)?;
    let out = args.out.clone().unwrap_or_else(|| default_out(&capture));
    let folder = RunFolder::open(&out, earlier(args))?;
    let mut trainer = match args.resume {
        true => resumed(args, capture, &folder)?,
        false => begun(args, capture, &folder)?,
    };
    folder.log(&machine())?;
    say(&summary(&trainer, &out)?);
    train(&mut trainer, &folder, &resume_command(args, &out))?;
    deliver(args, &trainer, &folder, &out)
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

fn begun(args: &TrainArgs, capture: Capture, folder: &RunFolder) -> Result<Trainer> {
    let mut config = settings::of_new_run(args)?;
    let record = RunRecord::new(&capture, preset_name(args))?;
    if let Some(budget) = args.budget {
        config.optimiser.steps = steps_within(&capture, &config, budget)?;
    }
    let trainer = Trainer::new(Dataset::new(capture, &config)?, config.clone())?;
    folder.begin(&config, &record)?;
    Ok(trainer)
}

fn preset_name(args: &TrainArgs) -> String {
    let value = args.preset.and_then(|preset| preset.to_possible_value());
    value.map_or_else(|| "standard".to_owned(), |value| value.get_name().to_owned())
}

fn steps_within(capture: &Capture, config: &TrainConfig, budget: Duration) -> Result<u64> {
    say("timing a few steps to fill the budget");
    let trial = Trainer::new(Dataset::new(capture.clone(), config)?, config.clone())?;
    Ok(trial.steps_within(budget.as_secs_f64())?)
}

fn resumed(args: &TrainArgs, capture: Capture, folder: &RunFolder) -> Result<Trainer> {
    let record = folder.stored_record()?;
    if args.preset.is_some() && preset_name(args) != record.preset {
        let (path, preset) = (folder.path().display(), &record.preset);
        let asked = preset_name(args);
        return Err(Usage(format!(
            "{path}: expected --resume to keep the preset {preset}, found {asked} asked for"
        ))
        .into());
    }
    record.check(&RunRecord::new(&capture, record.preset.clone())?, &args.capture)?;
    let config = settings::of_resumed_run(args, folder.stored_config()?, &folder.config())?;
    let mut trainer = Trainer::new(Dataset::new(capture, &config)?, config)?;
    if let Some(checkpoint) = Checkpoint::newest(&folder.checkpoints())? {
        trainer.resume(checkpoint, &folder.checkpoints())?;
    }
    Ok(trainer)
}

/// One line about the program and the machine.
fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let cpu = cpu
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let cpu = cpu.map_or("unknown processor", |(_, name)| name.trim());
    let command: Vec<String> = std::env::args().collect();
    format!(
        "unic {} on {cpu} ({} {}), {} threads: {}",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::OS,
        std::env::consts::ARCH,
        rayon::current_num_threads(),
        command.join(" ")
    )
}

fn resume_command(args: &TrainArgs, out: &Path) -> String {
    format!(
        "unic train {} --out {} --resume",
        args.capture.display(),
        out.display()
    )
}

/// What is about to happen.
fn summary(trainer: &Trainer, out: &Path) -> Result<String> {
    let data = trainer.data();
    let names = data
        .validation
        .iter()
        .map(|clip| clip.name())
        .collect::<Vec<_>>()
        .join(", ");
    let (capture, steps) = (&data.capture, trainer.config().optimiser.steps);
    let done = match trainer.step() {
        0 => String::new(),
        step => format!(", {step} of them done"),
    };
    Ok(format!(
        "{}: {} vertices, {} joints, {} fps\n\
         training on {} clips, {:.1} s of motion; validating on {names}\n\
         {} parameters, {steps} steps{done}, seed {}\n\
         the model will be {}, its run {}",
        capture.manifest.name,
        capture.garment.rest.vertices.len(),
        capture.character.skeleton.len(),
        capture.manifest.fps,
        data.clips.len(),
        data.seconds(),
        trainer.model()?.parameter_count(),
        trainer.config().seed,
        out.display(),
        out.with_extension("run").display(),
    ))
}

fn train(trainer: &mut Trainer, folder: &RunFolder, resume: &str) -> Result<()> {
    let total = trainer.config().optimiser.steps;
    let mut listener = Listener {
        progress: Progress::new("training", trainer.step(), total),
        metrics: MetricsLog::open(&folder.metrics(), trainer.step(), trainer.seconds())?,
        loss: None,
        validation: None,
        error: None,
    };
    let outcome = trainer.run(Some(&folder.checkpoints()), &mut |event| listener.listen(event));
    let Listener { progress, error, .. } = listener;
    drop(progress);
    match (outcome?, error) {
        (_, Some(error)) => Err(error),
        (Outcome::Finished, None) => Ok(()),
        (Outcome::Stopped, None) => {
            let step = trainer.step();
            folder.log(&format!("stopped at step {step} of {total}"))?;
            Err(Interrupted(format!(
                "stopped at step {step} of {total}, which is saved; go on with `{resume}`"
            ))
            .into())
        }
    }
}

/// Shows and keeps what the trainer tells.
struct Listener {
    progress: Progress,
    metrics: MetricsLog,
    /// Running mean.
    loss: Option<f64>,
    /// Newest and smallest free-running error, mm.
    validation: Option<(f64, f64)>,
    error: Option<Error>,
}

/// Share of a new loss in the running mean that is shown.
const LOSS_SHARE: f64 = 0.02;

impl Listener {
    fn listen(&mut self, event: &Event) -> Control {
        self.show(event);
        if let Err(error) = self.metrics.observe(event) {
            self.error.get_or_insert(error);
        }
        match interrupt::is_asked() || self.error.is_some() {
            true => Control::Stop,
            false => Control::Continue,
        }
    }

    fn show(&mut self, event: &Event) {
        match *event {
            Event::Step { step, loss, .. } => {
                let mean = self.loss.get_or_insert(f64::from(loss));
                *mean += LOSS_SHARE * (f64::from(loss) - *mean);
                let (loss, validation) = (self.loss, self.validation);
                self.progress.set(step, || message(loss, validation));
            }
            Event::Validated { step, rmse, best, .. } => {
                self.validation = Some((1e3 * rmse, 1e3 * best));
                self.progress.log(step, &message(self.loss, self.validation));
            }
            Event::Saved { .. } => {}
        }
    }
}

fn message(loss: Option<f64>, validation: Option<(f64, f64)>) -> String {
    let loss = loss.map_or_else(String::new, |loss| format!("loss {loss:.3}"));
    match validation {
        None => loss,
        Some((now, best)) => format!("{loss}  free-running {now:.2} mm, best {best:.2} mm"),
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary<'a> {
    model: &'a Path,
    run: &'a Path,
    bytes: usize,
    parameters: usize,
    steps: u64,
    seconds: f64,
    validation_clips: Vec<&'a str>,
    validation_rmse_mm: f64,
}

fn deliver(args: &TrainArgs, trainer: &Trainer, folder: &RunFolder, out: &Path) -> Result<()> {
    let model = Arc::new(trainer.model()?);
    let validation = &trainer.data().validation;
    let summary = Summary {
        model: out,
        run: folder.path(),
        bytes: model_file::write(out, &model)?,
        parameters: model.parameter_count(),
        steps: trainer.step(),
        seconds: trainer.seconds(),
        validation_clips: validation.iter().map(|clip| clip.name()).collect(),
        validation_rmse_mm: 1e3 * free_running_rmse(&model, validation)?,
    };
    folder.log(&format!(
        "finished: {:.2} mm after {:.0} s",
        summary.validation_rmse_mm, summary.seconds
    ))?;
    match args.json {
        true => print_json(&summary),
        false => print(&closing_words(&summary, &args.capture)),
    }
}

fn closing_words(summary: &Summary, capture: &Path) -> String {
    let (model, capture) = (summary.model.display(), capture.display());
    let time = humantime::format_duration(Duration::from_secs(summary.seconds.round() as u64));
    format!(
        "{model}: {:.1} MB, {} steps in {time}, {:.2} mm free-running on {}\n\
         next: unic eval {model} {capture}\n\
         \x20     unic animate {model} --motion MOTION.npz --out GARMENT.pc2\n",
        summary.bytes as f64 / 1e6,
        summary.steps,
        summary.validation_rmse_mm,
        summary.validation_clips.join(", "),
    )
}
