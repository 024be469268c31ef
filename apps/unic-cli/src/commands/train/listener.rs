//! Listener of a training: progress on stderr and the curves of `metrics.jsonl`.

use super::preview::Preview;
use crate::{
    interrupt,
    progress::Progress,
    run_folder::{MetricsLog, RunPosition},
};
use anyhow::{Error, Result};
use std::path::PathBuf;
use unic_train::{Control, Event, Fit, Trainer, TrainingTime};

/// Listener of all fits of a run, with one progress bar and one file of curves.
pub(super) struct TrainingListener {
    metrics_path: PathBuf,
    fits: u64,
    /// Number of steps of each fit.
    steps: u64,
    /// Progress of the whole run. `None` until a fit has steps left to train.
    progress: Option<Progress>,
    metrics: Option<MetricsLog>,
    fit: Fit,
    /// Number of steps of the fits that are finished.
    before: u64,
    /// Running mean of the loss of the present fit.
    loss: Option<f64>,
    /// Validation error of the first fit, which the second fit, without one, continues to show.
    validation: Option<ShownValidation>,
    /// Window that shows the models of validations.
    preview: Option<Preview>,
    /// Error that stopped the training.
    pub(super) error: Option<Error>,
}

/// Free-running errors on the clips held out.
#[derive(Clone, Copy)]
struct ShownValidation {
    newest_mm: f64,
    smallest_mm: f64,
}

/// Weight of a new loss in the running mean that is shown.
const LOSS_SHARE: f64 = 0.02;

impl TrainingListener {
    /// Creates a listener of `fits` fits of `steps` steps each.
    pub(super) fn new(metrics_path: PathBuf, fits: usize, steps: u64) -> Self {
        Self {
            metrics_path,
            fits: fits as u64,
            steps,
            progress: None,
            metrics: None,
            fit: Fit::HeldOut,
            before: 0,
            loss: None,
            validation: None,
            preview: None,
            error: None,
        }
    }

    /// Shows the models of validations in a window.
    pub(super) fn with_preview(self, preview: Option<Preview>) -> Self {
        Self { preview, ..self }
    }

    /// Begins or continues a fit. `other` is the training time of the run before it.
    ///
    /// # Errors
    /// A file of curves that cannot be read or written.
    pub(super) fn begin(&mut self, trainer: &Trainer, other: TrainingTime) -> Result<()> {
        self.fit = trainer.data().fit;
        self.before = match self.fit {
            Fit::HeldOut => 0,
            Fit::AllClips => (self.fits - 1) * self.steps,
        };
        self.loss = None;
        let done = trainer.step();
        // A finished fit has nothing to show, and its curves must not be cut.
        if done == self.steps {
            return Ok(());
        }
        let position = RunPosition {
            fit: self.fit,
            step: done,
            seconds: (other + trainer.time()).seconds,
        };
        self.metrics = Some(MetricsLog::open(&self.metrics_path, position)?);
        let (done, total) = (self.before + done, self.fits * self.steps);
        self.progress
            .get_or_insert_with(|| Progress::new("training", done, total));
        Ok(())
    }

    /// Handles an event of the training. The answer stops it after an error or an interruption.
    pub(super) fn listen(&mut self, event: &Event) -> Control {
        self.show(event);
        // The trainer takes no errors from a listener. The error is kept for the run to report.
        let kept = self.metrics.as_mut().map(|metrics| metrics.observe(event));
        if let Some(Err(error)) = kept {
            self.error.get_or_insert(error);
        }
        match interrupt::is_requested() || self.error.is_some() {
            true => Control::Stop,
            false => Control::Continue,
        }
    }

    fn show(&mut self, event: &Event) {
        match *event {
            Event::Step { step, loss, .. } => {
                let mean = self.loss.get_or_insert(f64::from(loss));
                *mean += LOSS_SHARE * (f64::from(loss) - *mean);
                // Copied out, because the closure below cannot borrow `self`.
                let (fit, loss, validation) = (self.fit, self.loss, self.validation);
                if let Some(progress) = &mut self.progress {
                    progress.set(self.before + step, || message(fit, loss, validation));
                }
            }
            Event::Validated { step, rmse, best, .. } => {
                self.validation = Some(ShownValidation {
                    newest_mm: 1e3 * rmse,
                    smallest_mm: 1e3 * best,
                });
                let message = message(self.fit, self.loss, self.validation);
                if let Some(progress) = &self.progress {
                    progress.log(self.before + step, &message);
                }
            }
            Event::OneStep {
                step,
                training_rmse,
                validation_rmse,
                ..
            } => {
                let held_out = validation_rmse.map_or_else(String::new, |rmse| {
                    format!(", on clips held out {:.2} mm", 1e3 * rmse)
                });
                if let Some(progress) = &self.progress {
                    let message = format!("one step {:.2} mm{held_out}", 1e3 * training_rmse);
                    progress.log(self.before + step, &message);
                }
            }
            Event::Previewed { step, model } => {
                if let Some(preview) = &self.preview {
                    preview.model(self.fit, step, model);
                }
            }
            Event::Measuring { .. } | Event::Saved { .. } => {}
        }
    }
}

/// Text beside the progress bar.
fn message(fit: Fit, loss: Option<f64>, validation: Option<ShownValidation>) -> String {
    let loss = loss.map_or_else(String::new, |loss| format!("loss {loss:.3}"));
    match (fit, validation) {
        (Fit::HeldOut, None) => loss,
        (Fit::HeldOut, Some(errors)) => {
            let (newest, smallest) = (errors.newest_mm, errors.smallest_mm);
            format!("{loss}  free running {newest:.2} mm, best {smallest:.2} mm")
        }
        (Fit::AllClips, None) => format!("{loss}  on all clips"),
        (Fit::AllClips, Some(errors)) => {
            let newest = errors.newest_mm;
            format!("{loss}  on all clips; first fit, free running {newest:.2} mm")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_fit_shows_the_error_as_that_of_the_first_fit() {
        let errors = ShownValidation {
            newest_mm: 41.2,
            smallest_mm: 40.0,
        };
        let shown = |fit| message(fit, Some(0.5), Some(errors));
        assert_eq!(
            shown(Fit::HeldOut),
            "loss 0.500  free running 41.20 mm, best 40.00 mm"
        );
        assert_eq!(
            shown(Fit::AllClips),
            "loss 0.500  on all clips; first fit, free running 41.20 mm"
        );
    }
}
