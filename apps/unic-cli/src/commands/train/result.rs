//! What a run says before and after it trains.

use super::Run;
use crate::{
    args::TrainArgs,
    model_file,
    output::{print, print_json},
};
use anyhow::Result;
use serde::Serialize;
use std::{path::Path, time::Duration};
use unic_train::{Fit, Trainer, Validation};

/// What is about to happen, told with the first fit at hand.
pub(super) fn summary(run: &Run, trainer: &Trainer) -> Result<String> {
    let data = trainer.data();
    let held_out: Vec<&str> = data.validation.iter().map(|clip| clip.name()).collect();
    let (capture, steps) = (&data.capture, run.config.optimiser.steps);
    let again = match run.fits {
        [_] => "",
        _ => "\nthen once more on all clips: that fit is the model",
    };
    let done = match trainer.step() {
        0 => String::new(),
        step => format!(", {step} of them done"),
    };
    Ok(format!(
        "{}: {} vertices, {} joints, {} fps\n\
         training on {} clips, {:.1} s of motion; validating on {}{again}\n\
         {} parameters, {steps} steps{done}, seed {}\n\
         the model will be {}, its run {}",
        capture.manifest.name,
        capture.garment.rest.vertices.len(),
        capture.character.skeleton.len(),
        capture.manifest.fps,
        data.clips.len(),
        data.seconds(),
        held_out.join(", "),
        trainer.model()?.parameter_count(),
        run.config.seed,
        run.out.display(),
        run.folder.path().display(),
    ))
}

/// A run that has come to its end.
pub(super) struct Trained<'a> {
    pub(super) run: &'a Run,
    /// The last fit.
    pub(super) trainer: Trainer,
    /// Of the first one.
    pub(super) validation: Validation,
    /// Training time of all fits.
    pub(super) seconds: f64,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary<'a> {
    model: &'a Path,
    run: &'a Path,
    bytes: usize,
    parameters: usize,
    /// The fit that the model is.
    fit: Fit,
    training_clips: Vec<&'a str>,
    /// Of each fit.
    steps: u64,
    /// Training time of all fits.
    seconds: f64,
    /// The fit that the validation is of.
    validation_fit: Fit,
    validation_clips: &'a [String],
    validation_rmse_mm: f64,
}

impl Trained<'_> {
    /// Writes the model and says so.
    pub(super) fn deliver(&self, args: &TrainArgs) -> Result<()> {
        let (run, data) = (self.run, self.trainer.data());
        let model = self.trainer.model()?;
        let summary = Summary {
            model: &run.out,
            run: run.folder.path(),
            bytes: model_file::write(&run.out, &model)?,
            parameters: model.parameter_count(),
            fit: data.fit,
            training_clips: data.clips.iter().map(|clip| clip.name()).collect(),
            steps: self.trainer.step(),
            seconds: self.seconds,
            validation_fit: self.validation.fit,
            validation_clips: &self.validation.clips,
            validation_rmse_mm: self.validation.rmse_mm,
        };
        run.folder.log(&format!(
            "finished: the model is the fit {} after {:.0} s in all",
            summary.fit.name(),
            summary.seconds
        ))?;
        match args.json {
            true => print_json(&summary),
            false => print(&summary.closing_words(&args.capture)),
        }
    }
}

impl Summary<'_> {
    fn closing_words(&self, capture: &Path) -> String {
        let (model, capture) = (self.model.display(), capture.display());
        let time = humantime::format_duration(Duration::from_secs(self.seconds.round() as u64));
        let (clips, rmse) = (self.validation_clips.join(", "), self.validation_rmse_mm);
        let (fits, error) = match self.fit {
            Fit::HeldOut => ("", format!("{rmse:.2} mm free-running on {clips}")),
            Fit::AllClips => (
                "two fits of ",
                format!("{rmse:.2} mm free-running on {clips} when held out; the model has seen all clips"),
            ),
        };
        format!(
            "{model}: {:.1} MB, {fits}{} steps in {time}, {error}\n\
             next: unic eval {model} {capture}\n\
             \x20     unic animate {model} --motion MOTION.npz --out GARMENT.pc2\n",
            self.bytes as f64 / 1e6,
            self.steps,
        )
    }
}
