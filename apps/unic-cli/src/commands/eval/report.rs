//! HTML page of `--report`: gathers frames while the rows are measured, then writes one file.

mod drift;
mod facts;
mod heat;
mod life;
mod machine;
mod movie;
mod recording;
mod rows;
mod scores;
mod text;

use super::{Measurements, frame_comparison::FrameComparison, training_overlap::TrainingOverlap};
use anyhow::{Result, anyhow};
use drift::Drift;
use movie::ClipMovie;
use recording::ClipRecording;
use std::{io::Write, path::Path, time::SystemTime};
use unic_core::Model;
use unic_eval::{Event, MODEL, Mode, PredictorError};
use unic_io::{Capture, atomic::AtomicFile};
use unic_report::{Movie, Report};

/// Number of clips with a movie: those with the worst frames. Numbers are of all clips.
const MOVIE_CLIPS: usize = 3;
/// Largest number of frames in all movies of a page, which limits its size.
const MOST_FRAMES: usize = 270;

/// Files of a report, opened before the evaluation so that a failure comes early.
pub(super) struct ReportFiles {
    page: AtomicFile,
    /// GIF of `--movie`. `None` once it is written.
    movie: Option<AtomicFile>,
}

impl ReportFiles {
    /// Opens the page, and the GIF if there is one.
    ///
    /// # Errors
    /// A file that cannot be created.
    pub(super) fn create(page: &Path, movie: Option<&Path>) -> Result<Self> {
        Ok(Self {
            page: AtomicFile::create(page)?,
            movie: movie.map(AtomicFile::create).transpose()?,
        })
    }
}

/// Listens to an evaluation and keeps what the page shows.
pub(super) struct ReportRecorder<'a> {
    capture: &'a Capture,
    files: ReportFiles,
    clips: Vec<String>,
    drift: Drift,
    /// Name of the baseline beside the model in the movies.
    rival: &'static str,
    /// Recording of the clip that is being measured.
    recording: Option<ClipRecording>,
    /// Recordings of the clips with the worst frames so far, in the order of the evaluation.
    worst: Vec<ClipRecording>,
    is_last: bool,
    movies: Vec<Movie>,
    /// Names of clips with the frames of their error maps.
    comparisons: Vec<(String, Vec<FrameComparison>)>,
}

/// Progress of drawing the movie of a clip.
pub(super) struct DrawingProgress<'a> {
    /// Name of the clip.
    pub(super) clip: &'a str,
    /// Number of frames that are drawn.
    pub(super) done: usize,
    /// Number of frames to draw.
    pub(super) count: usize,
}

/// Callback for the progress of drawing. An error of it stops the drawing.
pub(super) type OnDrawing<'a> = dyn FnMut(DrawingProgress) -> Result<()> + 'a;

impl<'a> ReportRecorder<'a> {
    /// Creates a recorder of an evaluation of `clips`. `rival` is the row beside the model in
    /// movies.
    pub(super) fn new(
        capture: &'a Capture,
        files: ReportFiles,
        clips: &[String],
        rival: &'static str,
    ) -> Self {
        Self {
            capture,
            files,
            clips: clips.to_vec(),
            drift: Drift::default(),
            rival,
            recording: None,
            worst: Vec::new(),
            is_last: false,
            movies: Vec::new(),
            comparisons: Vec::new(),
        }
    }

    /// Handles an event of the evaluation. The last clip's end draws all movies.
    ///
    /// # Errors
    /// A movie that cannot be drawn or written, an error of `on_drawing`.
    pub(super) fn observe(
        &mut self,
        event: &Event,
        on_drawing: &mut OnDrawing,
    ) -> Result<(), PredictorError> {
        match *event {
            Event::ClipStarted { clip, index, count } => {
                self.drift.start(clip);
                self.is_last = index + 1 == count;
                let movies = count.min(MOVIE_CLIPS);
                self.recording = Some(ClipRecording::new(clip, MOST_FRAMES / movies.max(1)));
            }
            Event::Predicted {
                predictor,
                mode: Mode::FreeRunning,
                frame,
                positions,
            } => {
                self.drift.add(predictor, frame, positions);
                match &mut self.recording {
                    Some(recording) if predictor == MODEL => recording.add_model(frame, positions),
                    Some(recording) if predictor == self.rival => recording.add_rival(frame, positions),
                    _ => {}
                }
            }
            Event::Predicted { .. } | Event::Progress { .. } => {}
            Event::ClipFinished => {
                self.keep_worst();
                // Drawn within the evaluation, whose listener shows progress and can be
                // interrupted.
                if self.is_last {
                    self.draw(on_drawing)?;
                }
            }
        }
        Ok(())
    }

    /// Adds the finished clip to the worst ones and drops the best of them if there are too many.
    fn keep_worst(&mut self) {
        self.worst.extend(self.recording.take());
        if self.worst.len() <= MOVIE_CLIPS {
            return;
        }
        let error = |recording: &ClipRecording| recording.worst().map_or(0.0, |worst| worst.rmse);
        let errors: Vec<f64> = self.worst.iter().map(error).collect();
        // `total_cmp` orders NaN above all numbers: a diverged clip counts as the worst.
        let best = (0..errors.len()).min_by(|&a, &b| errors[a].total_cmp(&errors[b]));
        if let Some(best) = best {
            self.worst.remove(best);
        }
    }

    fn draw(&mut self, on_drawing: &mut OnDrawing) -> Result<()> {
        // Taken out, so that their positions are freed before the page is written.
        let all = std::mem::take(&mut self.worst);
        for recording in &all {
            let movie = ClipMovie::new(recording, self.capture, self.rival);
            self.movies.push(movie.draw(all.len(), on_drawing)?);
            // Only the first movie becomes a GIF.
            if let Some(file) = self.files.movie.take() {
                write(file, &movie.draw_gif(on_drawing)?)?;
            }
            let comparisons = recording.error_map_frames(self.capture);
            self.comparisons
                .push((recording.clip.name().to_owned(), comparisons));
        }
        Ok(())
    }

    /// Writes the page and returns its size in bytes.
    ///
    /// # Errors
    /// A picture that cannot be drawn, a file that cannot be written.
    pub(super) fn finish(self, model: &Model, model_path: &Path, measured: &Measurements) -> Result<usize> {
        let Self {
            capture,
            clips,
            drift,
            ..
        } = &self;
        let evaluation = &measured.evaluation;
        let overlap = TrainingOverlap::of(capture, Some(model), clips);
        let report = Report {
            title: text::title(capture),
            lead: text::lead(evaluation, &overlap),
            caveats: overlap.caveats(),
            figures: text::figures(evaluation, measured.timing.as_ref()),
            heat: heat::map(capture, &self.comparisons)?,
            drift: Some(drift.chart()),
            drift_note: drift.note(),
            tables: scores::tables(evaluation),
            facts: vec![
                facts::of_model(model, model_path),
                facts::of_capture(capture, clips)?,
                facts::of_machine(measured.timing.as_ref()),
            ],
            definitions: text::definitions(evaluation),
            colophon: colophon(),
            movies_note: match clips.len() > MOVIE_CLIPS {
                true => format!(
                    "Of {} clips the {MOVIE_CLIPS} with the worst frames; numbers are of all clips.",
                    clips.len()
                ),
                false => String::new(),
            },
            movies: self.movies,
        };
        let html = report.html();
        write(self.files.page, html.as_bytes())?;
        Ok(html.len())
    }
}

fn write(mut file: AtomicFile, bytes: &[u8]) -> Result<()> {
    let target = file.target().display().to_string();
    (file.write_all(bytes)).map_err(|e| anyhow!("{target}: cannot write: {e}"))?;
    Ok(file.finish()?)
}

/// Last line of the page: version and date (UTC).
fn colophon() -> String {
    let now = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    let day = now.split('T').next().unwrap_or_default();
    format!("Made by unic {} on {day}.", env!("CARGO_PKG_VERSION"))
}
