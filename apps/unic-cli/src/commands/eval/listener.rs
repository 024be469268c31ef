//! Listener of an evaluation: progress, and everything that is written from predicted frames.

use super::{
    gallery::Gallery,
    report::{DrawingProgress, ReportFiles, ReportRecorder},
};
use crate::{args::EvalArgs, interrupt, progress::Progress};
use anyhow::{Result, anyhow};
use unic_eval::{Dump, Event, Mode, PredictorError, Protocol};
use unic_io::Capture;

/// Shows progress, and passes events on to the dump, the pictures and the report.
pub(super) struct EvaluationListener<'a> {
    progress: Progress,
    dump: Option<Dump>,
    gallery: Option<Gallery<'a>>,
    recorder: Option<ReportRecorder<'a>>,
    clip: String,
    /// Frames of the clips and modes that are finished.
    before: u64,
}

impl<'a> EvaluationListener<'a> {
    /// Creates the files that `args` ask for. `rival` is the row beside the model in movies.
    ///
    /// # Errors
    /// Files or folders that cannot be created, clips that cannot be read.
    pub(super) fn new(
        args: &EvalArgs,
        protocol: &Protocol,
        capture: &'a Capture,
        clips: &[String],
        rival: &'static str,
    ) -> Result<Self> {
        let dump = args.dump.as_ref().map(|folder| {
            Dump::create(folder).map_err(|e| anyhow!("{}: cannot create the folder: {e}", folder.display()))
        });
        let gallery = args
            .pictures
            .as_ref()
            .map(|folder| Gallery::create(capture, folder));
        let recorder = (args.report.as_ref()).map(|page| -> Result<ReportRecorder> {
            let files = ReportFiles::create(page, args.movie.as_deref())?;
            Ok(ReportRecorder::new(capture, files, clips, rival))
        });
        let units = |name: &String| {
            Ok(progress_units(
                protocol,
                capture.summarise_clip(name)?.pose_frames,
            ))
        };
        let total: u64 = clips.iter().map(units).sum::<Result<u64>>()?;
        Ok(Self {
            dump: dump.transpose()?,
            gallery: gallery.transpose()?,
            recorder: recorder.transpose()?,
            progress: Progress::new("measuring", 0, total),
            clip: String::new(),
            before: 0,
        })
    }

    /// Handles an event of the evaluation.
    ///
    /// # Errors
    /// An interruption, or a failure of the dump, the pictures or the report.
    pub(super) fn listen(&mut self, event: &Event) -> Result<(), PredictorError> {
        interrupt::check()?;
        match *event {
            Event::ClipStarted { clip, .. } => self.clip = clip.name().to_owned(),
            Event::Progress { mode, done, total } => self.advance(mode, done as u64, total as u64),
            Event::Predicted { .. } | Event::ClipFinished => {}
        }
        if let Some(gallery) = &mut self.gallery {
            gallery.observe(event)?;
        }
        if let Some(recorder) = &mut self.recorder {
            let (progress, before) = (&mut self.progress, self.before);
            recorder.observe(event, &mut |drawing: DrawingProgress| {
                let DrawingProgress { clip, done, count } = drawing;
                interrupt::check()?;
                progress.set(before, || format!("{clip} drawing {done}/{count}"));
                Ok(())
            })?;
        }
        self.dump.as_mut().map_or(Ok(()), |dump| dump.observe(event))
    }

    /// Ends the progress and returns the recorder of the report, which is still to be written.
    pub(super) fn into_recorder(self) -> Option<ReportRecorder<'a>> {
        self.recorder
    }

    fn advance(&mut self, mode: Mode, done: u64, total: u64) {
        let clip = &self.clip;
        self.progress.set(self.before + done, || {
            format!("{clip} {}", mode.name().replace('_', " "))
        });
        if done == total {
            self.before += total;
        }
    }
}

/// Number of frames that an evaluation reports for a clip of `frames` frames, over all modes.
fn progress_units(protocol: &Protocol, frames: usize) -> u64 {
    // Frame 0 is given, and reported with the predicted ones.
    let measured = protocol.frames.map_or(frames, |most| frames.min(most.get() + 1));
    (protocol.modes.len() * measured) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::NonZeroUsize;

    #[test]
    fn progress_ends_at_the_frames_and_modes_of_the_protocol() {
        assert_eq!(progress_units(&Protocol::default(), 500), 1000);
        let protocol = Protocol {
            modes: &[Mode::FreeRunning],
            frames: NonZeroUsize::new(300),
            ..Protocol::default()
        };
        assert_eq!(progress_units(&protocol, 500), 301);
        assert_eq!(progress_units(&protocol, 200), 200);
    }
}
