//! Result of an import, as text or as JSON.

use super::notes::Notes;
use crate::{
    args::ImportArgs,
    output::{print, print_json, print_status},
};
use anyhow::Result;
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    time::Duration,
};
use unic_core::{character::Garment, clip::Clip};
use unic_io::{Manifest, Split, counted};

/// Object that `--json` prints about one clip.
#[derive(Serialize)]
pub(super) struct ImportSummary {
    capture: PathBuf,
    clip: String,
    split: &'static str,
    frames: usize,
    fps: f32,
    vertices: usize,
    /// Number of clips of the capture.
    clips: usize,
    /// Conversions and assumptions, one sentence each.
    notes: Vec<String>,
    /// Wall-clock time of the whole command.
    seconds: f64,
}

impl ImportSummary {
    pub(super) fn new(
        args: &ImportArgs,
        (manifest, garment): (&Manifest, &Garment),
        clip: &Clip,
        notes: Notes,
        took: Duration,
    ) -> Self {
        Self {
            capture: args.out.clone(),
            clip: clip.name.clone(),
            split: manifest.splits.split_of(&clip.name).map_or("none", Split::name),
            frames: clip.len(),
            fps: clip.fps,
            vertices: garment.rest.vertices.len(),
            clips: manifest.splits.iter().count(),
            notes: notes.0,
            seconds: took.as_secs_f64(),
        }
    }

    fn line(&self) -> String {
        format!(
            "{}: clip {} ({}): {} of {} vertices at {} fps; {} in the capture\n",
            self.capture.display(),
            self.clip,
            self.split,
            counted(self.frames, "frame"),
            self.vertices,
            self.fps,
            counted(self.clips, "clip"),
        )
    }
}

/// Object that `--json` prints about a folder of sequences.
#[derive(Serialize)]
pub(super) struct SequencesSummary {
    capture: PathBuf,
    imported: Vec<ImportSummary>,
    /// Names of clips that the capture had already.
    kept: Vec<String>,
}

impl SequencesSummary {
    pub(super) fn new(capture: &Path, kept: Vec<String>) -> Self {
        Self {
            capture: capture.to_path_buf(),
            imported: Vec::new(),
            kept,
        }
    }

    /// Adds a clip, and says so: the next one may take minutes.
    pub(super) fn imported(&mut self, clip: ImportSummary) {
        print_status(clip.line().trim_end());
        self.imported.push(clip);
    }
}

/// Prints the result of one clip.
pub(super) fn print_summary(json: bool, summary: &ImportSummary) -> Result<()> {
    match json {
        true => print_json(summary),
        false => print(&summary.line()),
    }
}

/// Prints the result of a folder of sequences.
pub(super) fn print_sequences(json: bool, summary: &SequencesSummary) -> Result<()> {
    if json {
        return print_json(summary);
    }
    let kept = match summary.kept.as_slice() {
        [] => String::new(),
        names => format!(
            "; {} in the capture already (--overwrite replaces them)",
            names.join(", ")
        ),
    };
    print(&format!(
        "{}: {} imported{kept}\n",
        summary.capture.display(),
        counted(summary.imported.len(), "clip"),
    ))
}
