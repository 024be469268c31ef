//! The page of `--report`: what it gathers while rows are measured, and how it becomes one file.

mod drift;
mod facts;
mod film;
mod footage;
mod heat;
mod machine;
mod scores;
mod words;

use super::{Measured, knowledge::Knowledge, moment::Moment};
use anyhow::{Result, anyhow};
use drift::Drift;
use film::Film;
use footage::Footage;
use std::{io::Write, path::Path, time::SystemTime};
use unic_core::model::Model;
use unic_eval::{Event, MODEL, Mode, PredictorError};
use unic_io::{Capture, atomic::AtomicFile};
use unic_report::{Movie, Report};

/// Clips that the page shows in motion: those with the worst frames. The numbers are of all.
const FILMED_CLIPS: usize = 3;
/// Most frames of all movies of a page together.
const MOST_FRAMES: usize = 270;

/// Listens to an evaluation and keeps what a page needs.
pub(super) struct Recorder<'a> {
    capture: &'a Capture,
    file: AtomicFile,
    /// The GIF, until it is written.
    movie_file: Option<AtomicFile>,
    clips: Vec<String>,
    drift: Drift,
    /// The row that the movies show beside the model.
    rival: &'static str,
    /// The clip that runs.
    footage: Option<Footage>,
    /// The clips with the worst frames so far, in the order of the evaluation.
    worst: Vec<Footage>,
    is_last: bool,
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
        rival: &'static str,
    ) -> Result<Self> {
        Ok(Self {
            capture,
            file: AtomicFile::create(page)?,
            movie_file: movie.map(AtomicFile::create).transpose()?,
            clips: clips.to_vec(),
            drift: Drift::default(),
            rival,
            footage: None,
            worst: Vec::new(),
            is_last: false,
            movies: Vec::new(),
            moments: Vec::new(),
        })
    }

    /// Takes part in an evaluation.
    pub(super) fn observe(&mut self, event: &Event, drawing: &mut Drawing) -> Result<(), PredictorError> {
        match *event {
            Event::ClipStarted { clip, index, count } => {
                self.drift.start(clip);
                self.is_last = index + 1 == count;
                let filmed = count.min(FILMED_CLIPS);
                self.footage = Some(Footage::new(clip, MOST_FRAMES / filmed.max(1)));
            }
            Event::Predicted {
                row,
                mode: Mode::FreeRunning,
                frame,
                positions,
            } => {
                self.drift.add(row, frame, positions);
                match &mut self.footage {
                    Some(footage) if row == MODEL => footage.add_model(frame, positions),
                    Some(footage) if row == self.rival => footage.add_rival(frame, positions),
                    _ => {}
                }
            }
            Event::Predicted { .. } | Event::Progress { .. } => {}
            Event::ClipFinished => {
                self.keep_worst();
                if self.is_last {
                    self.draw(drawing)?;
                }
            }
        }
        Ok(())
    }

    /// Takes up the clip that has run, if its worst frame is among the worst.
    fn keep_worst(&mut self) {
        self.worst.extend(self.footage.take());
        if self.worst.len() <= FILMED_CLIPS {
            return;
        }
        let error = |footage: &Footage| footage.worst().map_or(0.0, |(_, error)| error);
        let errors: Vec<f64> = self.worst.iter().map(error).collect();
        let best = (0..errors.len()).min_by(|&a, &b| errors[a].total_cmp(&errors[b]));
        if let Some(best) = best {
            self.worst.remove(best);
        }
    }

    fn draw(&mut self, drawing: &mut Drawing) -> Result<()> {
        let all = std::mem::take(&mut self.worst);
        for footage in &all {
            let film = Film::new(footage, self.capture, self.rival);
            self.movies.push(film.movie(all.len(), drawing)?);
            if let Some(file) = self.movie_file.take() {
                write(file, &film.gif(drawing)?)?;
            }
            let moments = footage.moments(self.capture);
            self.moments.push((footage.clip.name().to_owned(), moments));
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
        let knowledge = Knowledge::of(capture, Some(model), clips);
        let report = Report {
            title: words::title(capture),
            lead: words::lead(evaluation, &knowledge),
            caveats: knowledge.caveats(),
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
                    "Of {} clips the {FILMED_CLIPS} with the worst frames; numbers are of all.",
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
