//! What happens while frames are measured.

use super::{gallery::Gallery, report::Recorder};
use crate::{args::EvalArgs, interrupt, progress::Progress};
use anyhow::{Result, anyhow};
use unic_eval::{Dump, Event, Mode, PredictorError};
use unic_io::Capture;

/// Shows progress, and hands what is measured to whatever keeps some of it.
pub(super) struct Listener<'a> {
    progress: Progress,
    dump: Option<Dump>,
    gallery: Option<Gallery<'a>>,
    recorder: Option<Recorder<'a>>,
    clip: String,
    /// Frames of the clips and modes before.
    before: u64,
}

impl<'a> Listener<'a> {
    /// `rival`: the row that movies show beside the model.
    pub(super) fn new(
        args: &EvalArgs,
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
        let recorder = (args.report.as_ref())
            .map(|page| Recorder::create(capture, (page, args.movie.as_deref()), clips, rival));
        let frames = |name: &String| Ok(capture.summarise_clip(name)?.pose_frames as u64);
        let total: u64 = clips.iter().map(frames).sum::<Result<u64>>()?;
        Ok(Self {
            dump: dump.transpose()?,
            gallery: gallery.transpose()?,
            recorder: recorder.transpose()?,
            progress: Progress::new("measuring", 0, 2 * total),
            clip: String::new(),
            before: 0,
        })
    }

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
            recorder.observe(event, &mut |what, done, count| {
                interrupt::check()?;
                progress.set(before, || format!("{what} drawing {done}/{count}"));
                Ok(())
            })?;
        }
        self.dump.as_mut().map_or(Ok(()), |dump| dump.observe(event))
    }

    /// Ends the progress; what is left is the report to be written.
    pub(super) fn into_recorder(self) -> Option<Recorder<'a>> {
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
