//! What a run says before and after it trains.

use super::Run;
use crate::model_file;
use anyhow::Result;
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    time::Duration,
};
use unic_eval::PreparedClip;
use unic_io::counted;
use unic_train::{
    Dataset, Fit, PUBLISHED_EPOCHS, TrainConfig, Trainer, TrainingTime, Validation, ValidationMotion,
};

/// What is about to happen, told with the first fit at hand.
pub(super) fn summary(run: &Run, trainer: &Trainer) -> Result<String> {
    let data = trainer.data();
    let held_out: Vec<&str> = data.validation.iter().map(|clip| clip.name()).collect();
    let held_out = match held_out.as_slice() {
        [] => "nothing is held out".to_owned(),
        clips if is_trained_on(data) => format!(
            "validating on {}, which is trained on too: there is no other clip",
            clips.join(", ")
        ),
        clips => format!("validating on {}", clips.join(", ")),
    };
    let (capture, steps) = (&data.capture, run.config.optimiser.steps);
    let again = match run.fits {
        [_] => "",
        _ => "\nthen once more on all clips: that fit is the model",
    };
    let done = match trainer.step() {
        0 => String::new(),
        step => format!(", {step} of them done"),
    };
    let epochs = match run.config.optimiser.epochs {
        Some(epochs) => epochs.to_string(),
        None => format!("{:.1}", run.config.epochs_of(steps, data.frame_pairs())),
    };
    let squeezed = squeezed(&run.config, &epochs, data.frame_pairs());
    Ok(format!(
        "{}: {} vertices, {} joints, {} fps\n\
         training on {}, {:.1} s of motion; {held_out}{again}\n\
         {} parameters, {}, which are {epochs} epochs{done}, seed {}{squeezed}\n\
         the model will be {}, its run {}",
        capture.manifest.name,
        capture.garment.rest.vertices.len(),
        capture.character.skeleton.len(),
        capture.manifest.fps,
        counted(data.clips.len(), "clip"),
        data.seconds(),
        trainer.model()?.parameter_count(),
        counted(steps as usize, "step"),
        run.config.seed,
        run.out.display(),
        run.folder.path().display(),
    ))
}

/// Is the clip that the run is validated on the only one that there is?
fn is_trained_on(data: &Dataset) -> bool {
    let is_known = |clip: &PreparedClip| data.clips.iter().any(|c| c.name() == clip.name());
    data.validation.iter().any(is_known)
}

/// Fewer steps than this are told where a schedule of several half periods is squeezed into them.
const FEW_STEPS: u64 = 200;

/// Warning about a learning rate that falls, rises and falls again within a few steps; else empty.
fn squeezed(config: &TrainConfig, epochs: &str, pairs: usize) -> String {
    let optimiser = &config.optimiser;
    if optimiser.half_periods <= 1.0 || optimiser.steps >= FEW_STEPS {
        return String::new();
    }
    let published = config.published_steps(pairs);
    format!(
        "\nthe learning rate's {} half periods are squeezed into {epochs} epochs: the published training is \
         {PUBLISHED_EPOCHS} epochs, {published} steps of this capture",
        optimiser.half_periods
    )
}

/// A run that has come to its end.
pub(super) struct Trained<'a> {
    pub(super) run: &'a Run,
    /// The last fit.
    pub(super) trainer: Trainer,
    /// Of the first one, where it held clips out.
    pub(super) validation: Option<Validation>,
    /// Training time of the prior, all fits and their validation.
    pub(super) time: TrainingTime,
}

/// What `--json` prints.
#[derive(Serialize)]
pub(crate) struct Summary {
    model: PathBuf,
    run: PathBuf,
    /// Of the model file.
    pub(crate) bytes: usize,
    /// Trained numbers.
    pub(crate) parameters: usize,
    /// The fit that the model is.
    fit: Fit,
    training_clips: Vec<String>,
    /// Of each fit.
    pub(crate) steps: u64,
    /// Training time of the prior, all fits and their validation; loading is no part of it.
    pub(crate) seconds: f64,
    /// The part of it that the prior's fit took.
    prior_seconds: f64,
    /// The fit that the validation is of.
    #[serde(skip_serializing_if = "Option::is_none")]
    validation_fit: Option<Fit>,
    /// Whether that fit has seen the clips.
    #[serde(skip_serializing_if = "Option::is_none")]
    validation_motion: Option<ValidationMotion>,
    validation_clips: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    validation_rmse_mm: Option<f64>,
    /// The part of its field's output that the model takes.
    #[serde(skip_serializing_if = "Option::is_none")]
    field_share: Option<f32>,
}

impl Trained<'_> {
    /// Writes the model.
    pub(super) fn deliver(&self) -> Result<Summary> {
        let (run, data) = (self.run, self.trainer.data());
        let model = self.trainer.measured_model()?;
        let validation = self.validation.as_ref();
        let summary = Summary {
            model: run.out.clone(),
            run: run.folder.path().to_path_buf(),
            bytes: model_file::write(&run.out, &model)?,
            parameters: model.parameter_count(),
            fit: data.fit,
            training_clips: data.clips.iter().map(|clip| clip.name().to_owned()).collect(),
            steps: self.trainer.step(),
            seconds: self.time.seconds,
            prior_seconds: self.time.prior_seconds,
            validation_fit: validation.map(|v| v.fit),
            validation_motion: validation.map(|v| v.motion),
            validation_clips: validation.map_or_else(Vec::new, |v| v.clips.clone()),
            validation_rmse_mm: validation.map(|v| v.rmse_mm),
            field_share: validation.map(|v| v.field_share),
        };
        run.folder.log(&format!(
            "finished: the model is the fit {} after {:.0} s in all",
            summary.fit.name(),
            summary.seconds
        ))?;
        Ok(summary)
    }
}

impl Summary {
    pub(super) fn closing_words(&self, capture: &Path) -> String {
        let (model, capture) = (self.model.display(), capture.display());
        let time = humantime::format_duration(Duration::from_secs(self.seconds.round() as u64));
        let clips = self.validation_clips.join(", ");
        let (fits, error) = match (self.fit, self.validation_rmse_mm) {
            (_, None) => ("", "and nothing was held out to measure it on".to_owned()),
            (Fit::HeldOut, Some(rmse)) if self.validation_motion == Some(ValidationMotion::TrainedOn) => (
                "",
                format!(
                    "{rmse:.2} mm free-running on {clips}, which it was trained on: no measure of unseen motion"
                ),
            ),
            (Fit::HeldOut, Some(rmse)) => ("", format!("{rmse:.2} mm free-running on {clips}")),
            (Fit::AllClips, Some(rmse)) => (
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
