//! What is shown and kept while a run trains.

use crate::{
    interrupt,
    progress::Progress,
    run_folder::{MetricsLog, Moment},
};
use anyhow::{Error, Result};
use std::path::PathBuf;
use unic_train::{Control, Event, Fit, Trainer, TrainingTime};

/// Follows all fits of a run: one bar, one file of curves.
pub(super) struct Listener {
    metrics_path: PathBuf,
    fits: u64,
    steps: u64,
    /// Of the whole run; there from the first fit on that has anything left to do.
    progress: Option<Progress>,
    metrics: Option<MetricsLog>,
    fit: Fit,
    /// Steps of the fits before.
    before: u64,
    /// Running mean of the fit.
    loss: Option<f64>,
    /// Newest and smallest free-running error, mm; a fit on all clips goes on showing the one before.
    validation: Option<(f64, f64)>,
    /// What ended the run, beside a wish to stop.
    pub(super) error: Option<Error>,
}

/// Share of a new loss in the running mean that is shown.
const LOSS_SHARE: f64 = 0.02;

impl Listener {
    /// Of `fits` fits with as many steps each.
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
            error: None,
        }
    }

    /// A fit begins or goes on. `other`: training time of the run before it.
    pub(super) fn begin(&mut self, trainer: &Trainer, other: TrainingTime) -> Result<()> {
        self.fit = trainer.data().fit;
        self.before = match self.fit {
            Fit::HeldOut => 0,
            Fit::AllClips => (self.fits - 1) * self.steps,
        };
        self.loss = None;
        let done = trainer.step();
        if done == self.steps {
            return Ok(());
        }
        let moment = Moment {
            fit: self.fit,
            step: done,
            seconds: (other + trainer.time()).seconds,
        };
        self.metrics = Some(MetricsLog::open(&self.metrics_path, moment)?);
        let (done, total) = (self.before + done, self.fits * self.steps);
        self.progress
            .get_or_insert_with(|| Progress::new("training", done, total));
        Ok(())
    }

    /// Takes part in the fit.
    pub(super) fn listen(&mut self, event: &Event) -> Control {
        self.show(event);
        let kept = self.metrics.as_mut().map(|metrics| metrics.observe(event));
        if let Some(Err(error)) = kept {
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
                let (fit, loss, validation) = (self.fit, self.loss, self.validation);
                if let Some(progress) = &mut self.progress {
                    progress.set(self.before + step, || message(fit, loss, validation));
                }
            }
            Event::Validated { step, rmse, best, .. } => {
                self.validation = Some((1e3 * rmse, 1e3 * best));
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
            Event::Measuring { .. } | Event::Saved { .. } => {}
        }
    }
}

fn message(fit: Fit, loss: Option<f64>, validation: Option<(f64, f64)>) -> String {
    let loss = loss.map_or_else(String::new, |loss| format!("loss {loss:.3}"));
    match (fit, validation) {
        (Fit::HeldOut, None) => loss,
        (Fit::HeldOut, Some((now, best))) => {
            format!("{loss}  free-running {now:.2} mm, best {best:.2} mm")
        }
        (Fit::AllClips, None) => format!("{loss}  on all clips"),
        (Fit::AllClips, Some((held_out, _))) => {
            format!("{loss}  on all clips; held out, free-running {held_out:.2} mm")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_shown_during_the_second_fit_is_said_to_be_the_first_ones() {
        let shown = |fit| message(fit, Some(0.5), Some((41.2, 40.0)));
        assert_eq!(
            shown(Fit::HeldOut),
            "loss 0.500  free-running 41.20 mm, best 40.00 mm"
        );
        assert_eq!(
            shown(Fit::AllClips),
            "loss 0.500  on all clips; held out, free-running 41.20 mm"
        );
    }
}
