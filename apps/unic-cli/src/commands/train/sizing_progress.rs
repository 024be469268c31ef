//! Progress of a sizing on stderr and in the log.

use crate::{interrupt, progress::Progress, run_folder::RunFolder};
use anyhow::Result;
use unic_train::{Control, SizingEvent, Tried};

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

/// Text of a candidate's gain.
fn text(tried: &Tried) -> String {
    let (candidate, gain) = (&tried.candidate, &tried.gain);
    format!(
        "{} wide, {} layers, {} steps: {:.1} \u{b1} {:.1} % off the prior with {} % of the field",
        candidate.width,
        candidate.hidden_layers,
        candidate.steps,
        100.0 * gain.mean,
        100.0 * gain.error,
        100.0 * gain.share,
    )
}
