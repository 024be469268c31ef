//! The page of `--report`: what it gathers while rows are measured, and how it becomes one file.

mod drift;
mod facts;
mod film;
mod heat;
mod machine;
mod scores;
mod words;

use super::{Measured, moment::Moment};
use anyhow::{Result, anyhow};
use drift::Drift;
use film::Film;
use std::{io::Write, path::Path, time::SystemTime};
use unic_core::model::Model;
use unic_eval::{Event, MODEL, Mode, PredictorError};
use unic_io::{Capture, atomic::AtomicFile};
use unic_report::{Movie, Report};

/// Clips that the page shows in motion, from the first one on; the numbers are of all.
const FILMED_CLIPS: usize = 3;

/// Listens to an evaluation and keeps what a page needs.
pub(super) struct Recorder<'a> {
    capture: &'a Capture,
    file: AtomicFile,
    /// The GIF, until it is written.
    movie_file: Option<AtomicFile>,
    clips: Vec<String>,
    drift: Drift,
    film: Option<Film>,
    movies: Vec<Movie>,
    /// The frames of the error maps, a clip each.
    moments: Vec<(String, Vec<Moment>)>,
}

/// Told how far the drawing is: what, done, of how many.
pub(super) type Drawing<'a> = dyn FnMut(&str, usize, usize) -> Result<()> + 'a;

impl<'a> Recorder<'a> {
    /// Opens the file, so that a page that cannot be written is found out before the work.
    pub(super) fn create(
        capture: &'a Capture,
        (page, movie): (&Path, Option<&Path>),
        clips: &[String],
    ) -> Result<Self> {
        Ok(Self {
            capture,
            file: AtomicFile::create(page)?,
            movie_file: movie.map(AtomicFile::create).transpose()?,
            clips: clips.to_vec(),
            drift: Drift::default(),
            film: None,
            movies: Vec::new(),
            moments: Vec::new(),
        })
    }

    /// Takes part in an evaluation.
    pub(super) fn observe(&mut self, event: &Event, drawing: &mut Drawing) -> Result<(), PredictorError> {
        match *event {
            Event::ClipStarted { clip, index, count } => {
                self.drift.start(clip);
                let filmed = count.min(FILMED_CLIPS);
                self.film = (index < filmed).then(|| Film::new(clip, filmed));
            }
            Event::Predicted {
                row,
                mode: Mode::FreeRunning,
                frame,
                positions,
            } => {
                self.drift.add(row, frame, positions);
                if let Some(film) = self.film.as_mut().filter(|_| row == MODEL) {
                    film.keep(frame, positions);
                }
            }
            Event::Predicted { .. } | Event::Progress { .. } => {}
            Event::ClipFinished => {
                if let Some(film) = self.film.take() {
                    self.movies.push(film.movie(self.capture, drawing)?);
                    if let Some(file) = self.movie_file.take() {
                        write(file, &film.gif(self.capture, drawing)?)?;
                    }
                    let moments = film.moments(self.capture);
                    self.moments.push((film.clip_name().to_owned(), moments));
                }
            }
        }
        Ok(())
    }

    /// Writes the page; its size in bytes.
    pub(super) fn finish(self, model: &Model, model_path: &Path, measured: &Measured) -> Result<usize> {
        let Self {
            capture,
            clips,
            drift,
            ..
        } = &self;
        let evaluation = &measured.evaluation;
        let subject = words::Subject::of(capture, model, clips);
        let report = Report {
            title: capture.manifest.name.clone(),
            lead: words::lead(evaluation, &subject),
            figures: words::figures(evaluation, measured.timing.as_ref()),
            heat: heat::map(capture, &self.moments)?,
            drift: Some(drift.chart()),
            drift_note: drift.note(),
            tables: scores::tables(evaluation),
            facts: facts::all(capture, clips, (model, model_path), measured.timing.as_ref())?,
            definitions: words::definitions(evaluation),
            colophon: colophon(),
            movies_note: match clips.len() > FILMED_CLIPS {
                true => format!(
                    "The first {FILMED_CLIPS} of {} clips; numbers are of all.",
                    clips.len()
                ),
                false => String::new(),
            },
            movies: self.movies,
        };
        let html = report.html();
        write(self.file, html.as_bytes())?;
        Ok(html.len())
    }
}

fn write(mut file: AtomicFile, bytes: &[u8]) -> Result<()> {
    let target = file.target().display().to_string();
    (file.write_all(bytes)).map_err(|e| anyhow!("{target}: cannot write: {e}"))?;
    Ok(file.finish()?)
}

fn colophon() -> String {
    let now = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    let day = now.split('T').next().unwrap_or_default();
    format!("Made by unic {} on {day}.", env!("CARGO_PKG_VERSION"))
}
