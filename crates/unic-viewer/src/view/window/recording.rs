//! Movies of the window.

use super::{ViewWindow, window_pixels};
use crate::free_name::free_name;
use crate::{MovieError, MovieFormat, MovieWriter};
use eframe::egui;
use std::path::PathBuf;

/// Largest width of a movie, pixels: pictures are drawn and written while the window waits.
const WIDEST: u32 = 1280;

/// Movie that is being written.
pub(super) struct Recording {
    path: PathBuf,
    writer: MovieWriter,
    size: [u32; 2],
}

impl Recording {
    /// Completes the movie.
    pub(super) fn finish(self) -> Result<PathBuf, MovieError> {
        self.writer.finish()?;
        Ok(self.path)
    }
}

impl ViewWindow {
    /// Starts a movie in the current folder, or ends the one that is written.
    pub(super) fn toggle_recording(&mut self, ctx: &egui::Context) {
        if let Some(recording) = self.recording.take() {
            self.message = match recording.finish() {
                Ok(path) => format!("{} written", path.display()),
                Err(error) => error.to_string(),
            };
            return;
        }
        match self.start_recording(ctx) {
            Ok(recording) => {
                self.message = format!("{}: recording; M ends it", recording.path.display());
                self.recording = Some(recording);
            }
            Err(error) => self.message = error.to_string(),
        }
    }

    fn start_recording(&self, ctx: &egui::Context) -> Result<Recording, MovieError> {
        let ending = if cfg!(feature = "mp4") { "mp4" } else { "gif" };
        let path = free_name("unic_view", ending);
        let [width, height] = window_pixels(ctx);
        let scale = (WIDEST as f32 / width as f32).min(1.0);
        // Even sides, as movies have them.
        let size = [width, height].map(|side| ((side as f32 * scale) as u32 / 2 * 2).max(16));
        let writer = MovieWriter::create(&path, MovieFormat::from_path(&path)?, self.session.fps(), size)?;
        Ok(Recording { path, writer, size })
    }

    /// Adds a picture to the movie that is recorded.
    pub(super) fn record(&mut self) {
        let Some(size) = self.recording.as_ref().map(|recording| recording.size) else {
            return;
        };
        let picture = self.picture(size).map_err(|error| error.to_string());
        let Some(recording) = &mut self.recording else {
            return;
        };
        let added =
            picture.and_then(|image| recording.writer.push(&image).map_err(|error| error.to_string()));
        if let Err(message) = added {
            // Dropping the writer removes what is written.
            self.recording = None;
            self.message = message;
        }
    }
}
