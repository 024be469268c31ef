//! Progress of a sizing on stderr and in the log.

use crate::{interrupt, progress::Progress, run_folder::RunFolder};
use anyhow::Result;
use unic_train::{Control, Sizing, SizingEvent, Tried};

/// Listener of a sizing.
pub(super) struct SizingProgress<'a> {
    folder: &'a RunFolder,
    progress: Option<Progress>,
    /// Last candidate that was judged, as text.
    judged: String,
    /// Result of writing to the log. An error stops the sizing.
    logged: Result<()>,
}

impl<'a> SizingProgress<'a> {
    /// Creates a listener that logs to the folder of a run.
    pub(super) fn new(folder: &'a RunFolder) -> Self {
        Self {
            folder,
            progress: None,
            judged: String::new(),
            logged: Ok(()),
        }
    }

    /// Handles an event. The answer stops the sizing after an error or an interruption.
    pub(super) fn follow(&mut self, event: SizingEvent) -> Control {
        match event {
            SizingEvent::Step { done, all } => {
                let judged = &self.judged;
                let progress = self
                    .progress
                    .get_or_insert_with(|| Progress::new("sizing the field", done, all));
                progress.set(done, || judged.clone());
            }
            SizingEvent::Judged(tried) => {
                self.judged = text(tried);
                let line = format!("sizing: {}", self.judged);
                if self.logged.is_ok() {
                    self.logged = self.folder.log(&line);
                }
            }
        }
        match self.logged.is_err() {
            true => Control::Stop,
            false => interrupt::control(),
        }
    }

    /// Ends the progress.
    ///
    /// # Errors
    /// A log that could not be written.
    pub(super) fn finish(self) -> Result<()> {
        self.logged
    }
}

/// Text of a sizing's choice, and of the best candidate where none is chosen.
pub(super) fn outcome(sizing: &Sizing) -> String {
    let chosen = (sizing.tried.iter()).find(|tried| sizing.share > 0.0 && tried.candidate == sizing.chosen);
    if let Some(chosen) = chosen {
        return format!("field chosen by motion left out: {}", text(chosen));
    }
    let best = (sizing.tried.iter()).max_by(|a, b| a.gain.mean.total_cmp(&b.gain.mean));
    let best = best.map_or_else(String::new, |best| format!("; the best mean: {}", text(best)));
    format!("no field: none improves on the prior on motion left out by more than noise{best}")
}

/// Text of a candidate's gain.
fn text(tried: &Tried) -> String {
    let (candidate, gain) = (&tried.candidate, &tried.gain);
    format!(
        "{} wide, {} layers, {} steps, {} % of its output: {:+.2} \u{b1} {:.2} % of the prior's error",
        candidate.width,
        candidate.hidden_layers,
        candidate.steps,
        100.0 * gain.share,
        -100.0 * gain.mean,
        100.0 * gain.error,
    )
}
