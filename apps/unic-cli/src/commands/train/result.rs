//! Texts and results of a run: what it prints before training, its model and its summary.

use super::Run;
use crate::{interrupt, model_file};
use anyhow::Result;
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    time::Duration,
};
use unic_eval::PreparedClip;
use unic_io::counted;
use unic_train::{
    FieldData, Fit, PUBLISHED_EPOCHS, RecurrenceStart, StateSettings, TrainConfig, Trainer, TrainingTime,
    Validation, ValidationMotion,
};

/// Text before the training: the capture, the clips, the number of steps and the outputs.
///
/// # Errors
/// A model that cannot be built from the trainer.
pub(super) fn opening_text(run: &Run, trainer: &Trainer) -> Result<String> {
    let data = trainer.data();
    let held_out: Vec<&str> = data.validation.iter().map(|clip| clip.name()).collect();
    let held_out = match held_out.as_slice() {
        [] => "nothing is held out".to_owned(),
        clips if is_trained_on(data) => format!(
            "validating on {}, which is also trained on because there is no other clip",
            clips.join(", ")
        ),
        clips => format!("validating on {}", clips.join(", ")),
    };
    let config = trainer.config();
    let (capture, steps) = (&data.capture, config.optimiser.steps);
    let again = match run.fits {
        [_] => "",
        _ => "\nthen a second fit on all clips, which is the model",
    };
    let done = match trainer.step() {
        0 => String::new(),
        step => format!(", {step} of them done"),
    };
    // A preset with epochs shows their number; for others it is computed from the steps.
    let epochs = match config.optimiser.epochs {
        Some(epochs) => epochs.to_string(),
        None => format!("{:.1}", config.epochs_of(steps, data.frame_pairs())),
    };
    let training = match run.has_no_field() {
        true => format!("a prior without a field, seed {}", run.config.seed),
        false => {
            let warning = short_schedule_warning(config, &epochs, data.frame_pairs());
            format!(
                "{} parameters, {}, which are {epochs} epochs{done}, seed {}{warning}",
                trainer.model()?.parameter_count(),
                counted(steps as usize, "step"),
                run.config.seed,
            )
        }
    };
    let wrinkles = match (&data.prior.replay, config.replay.at_inference) {
        (Some(replay), _) => format!("\nwrinkles: {}", model_file::replayed(replay)),
        (None, true) => {
            "\nno wrinkles to replay: the prediction has enough, or there is too little motion".to_owned()
        }
        (None, false) => String::new(),
    };
    let recurrence = recurrence_text(config, data.recurrence_start);
    Ok(format!(
        "{}: {} vertices, {} joints, {} fps\n\
         training on {}, {:.1} s of motion; {held_out}{again}\n\
         {training}{recurrence}{wrinkles}\n\
         the model will be {}, its run {}",
        capture.manifest.name,
        capture.garment.rest.vertices.len(),
        capture.character.skeleton.len(),
        capture.manifest.fps,
        counted(data.clips.len(), "clip"),
        data.seconds(),
        run.out.display(),
        run.folder.path().display(),
    ))
}

/// Line that names the start of a prior's recurrence, or the reason why there is none. Empty for a
/// configuration without a recurrence.
fn recurrence_text(config: &TrainConfig, start: Option<RecurrenceStart>) -> String {
    let StateSettings::Displacement {
        recurrence: Some(settings),
        ..
    } = &config.model.state
    else {
        return String::new();
    };
    let text = match (start, settings.start) {
        (Some(RecurrenceStart::Pretrained), _) => "started from the one that comes with unic",
        (Some(RecurrenceStart::Random), RecurrenceStart::Random) => "started from random numbers",
        (Some(RecurrenceStart::Random), RecurrenceStart::Pretrained) => {
            "started from random numbers, because the one that comes with unic needs the joint names of a \
             human, the layout `heading` and the sizes of `standard`"
        }
        (None, _) => {
            "none, because on motion left out it does not improve on the linear map, or because there is one \
             motion alone"
        }
    };
    format!("\nrecurrence: {text}")
}

/// Does the fit train on the clip that it is validated on? A capture with one training clip has no
/// other.
fn is_trained_on(data: &FieldData) -> bool {
    let is_known = |clip: &PreparedClip| data.clips.iter().any(|c| c.name() == clip.name());
    data.validation.iter().any(is_known)
}

/// Number of steps below which a schedule of several half periods is worth a warning.
const FEW_STEPS: u64 = 200;

/// Warning about a learning rate that falls, rises and falls again within a few steps. Empty if
/// there is no need for one.
fn short_schedule_warning(config: &TrainConfig, epochs: &str, pairs: usize) -> String {
    let optimiser = &config.optimiser;
    // A rate that only falls does so in any number of steps.
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

/// Run whose fits are finished.
pub(super) struct FinishedRun<'a> {
    pub(super) run: &'a Run,
    /// Trainer of the last fit, which is the model.
    pub(super) trainer: Trainer,
    /// Validation of the first fit. `None` if it held out no clips.
    pub(super) validation: Option<Validation>,
    /// Training time of the prior, all fits and their validation.
    pub(super) time: TrainingTime,
}

/// Object that `--json` prints. The field names are a contract.
#[derive(Serialize)]
pub struct TrainingSummary {
    model: PathBuf,
    run: PathBuf,
    /// Size of the model file in bytes.
    pub bytes: usize,
    /// Number of trained parameters.
    pub parameters: usize,
    /// Fit that became the model.
    fit: Fit,
    training_clips: Vec<String>,
    /// Number of optimiser steps of each fit.
    pub steps: u64,
    /// Training time of the prior, all fits and their validation, without loading, in seconds.
    pub seconds: f64,
    /// Part of `seconds` that fitting the prior took.
    prior_seconds: f64,
    /// Fit whose error the validation measures.
    #[serde(skip_serializing_if = "Option::is_none")]
    validation_fit: Option<Fit>,
    /// Novelty of the validation clips to that fit: unseen, or trained on.
    #[serde(skip_serializing_if = "Option::is_none")]
    validation_motion: Option<ValidationMotion>,
    validation_clips: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    validation_rmse_mm: Option<f64>,
    /// Factor, from 0 to 1, by which the model scales the output of its field.
    #[serde(skip_serializing_if = "Option::is_none")]
    field_share: Option<f32>,
    /// Share of an offset's bending that a sweep of the strain projection removes, from 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    projection_bending: Option<f32>,
    /// Least lengths of the chords of taut cloth that hangs free, in standard deviations below their mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    projection_chord_deviations: Option<f32>,
    /// Least distance along the smoothed cloth that pushes restore, in mean edge lengths.
    #[serde(skip_serializing_if = "Option::is_none")]
    projection_order: Option<f32>,
    /// Factor of the replayed wrinkles.
    #[serde(skip_serializing_if = "Option::is_none")]
    replay_factor: Option<f32>,
    /// A sizing has left the field out.
    #[serde(skip)]
    has_no_field: bool,
}

impl FinishedRun<'_> {
    /// Writes the model and returns the summary of the run.
    ///
    /// # Errors
    /// A model or log that cannot be written.
    pub(super) fn write_model(&self) -> Result<TrainingSummary> {
        let (run, data) = (self.run, self.trainer.data());
        let model = self.trainer.measured_model(&interrupt::control)?;
        let validation = self.validation.as_ref();
        let summary = TrainingSummary {
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
            projection_bending: validation.and_then(|v| v.bending),
            projection_chord_deviations: validation.and_then(|v| v.chord_deviations),
            projection_order: validation.and_then(|v| v.order),
            replay_factor: validation.and_then(|v| v.replay_factor),
            has_no_field: run.has_no_field(),
        };
        run.folder.log(&format!(
            "finished: the model is the fit {} after {:.0} s in all",
            summary.fit.name(),
            summary.seconds
        ))?;
        Ok(summary)
    }
}

impl TrainingSummary {
    /// Text after the training: the model, its error and the commands to try next.
    pub(super) fn text(&self, capture: &Path) -> String {
        let (model, capture) = (self.model.display(), capture.display());
        let time = humantime::format_duration(Duration::from_secs(self.seconds.round() as u64));
        let clips = self.validation_clips.join(", ");
        let (fits, error) = match (self.fit, self.validation_rmse_mm) {
            (_, None) => ("", "and nothing was held out to measure it on".to_owned()),
            (Fit::HeldOut, Some(rmse)) if self.validation_motion == Some(ValidationMotion::TrainedOn) => (
                "",
                format!(
                    "{rmse:.2} mm in free running on {clips}, which it was trained on: no measure of unseen \
                     motion"
                ),
            ),
            (Fit::HeldOut, Some(rmse)) => ("", format!("{rmse:.2} mm in free running on {clips}")),
            (Fit::AllClips, Some(rmse)) => (
                "two fits of ",
                format!(
                    "{rmse:.2} mm in free running on {clips} when held out; the model has seen all clips"
                ),
            ),
        };
        let training = match self.has_no_field {
            true => "a prior without a field".to_owned(),
            false => format!("{fits}{}", counted(self.steps as usize, "step")),
        };
        format!(
            "{model}: {:.1} MB, {training} in {time}, {error}\n\
             next: unic eval {model} {capture}\n\
             \x20     unic animate {model} --motion MOTION.npz --out GARMENT.pc2\n",
            self.bytes as f64 / 1e6,
        )
    }
}
