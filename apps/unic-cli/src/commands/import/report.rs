//! Result of an import, as text or as JSON.

use super::notes::Notes;
use crate::{
    args::ImportArgs,
    output::{print, print_json},
};
use anyhow::Result;
use serde::Serialize;
use std::{path::Path, time::Duration};
use unic_core::{character::Garment, clip::Clip};
use unic_io::{Manifest, Split, counted};

/// Object that `--json` prints.
#[derive(Serialize)]
pub(super) struct ImportSummary<'a> {
    capture: &'a Path,
    clip: &'a str,
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

impl<'a> ImportSummary<'a> {
    pub(super) fn new(
        args: &'a ImportArgs,
        manifest: &Manifest,
        clip: &'a Clip,
        garment: &Garment,
        notes: Notes,
        took: Duration,
    ) -> Self {
        Self {
            capture: &args.out,
            clip: &clip.name,
            split: manifest.splits.split_of(&clip.name).map_or("none", Split::name),
            frames: clip.len(),
            fps: clip.fps,
            vertices: garment.rest.vertices.len(),
            clips: manifest.splits.iter().count(),
            notes: notes.0,
            seconds: took.as_secs_f64(),
        }
    }
}

/// Prints the result.
pub(super) fn print_summary(args: &ImportArgs, summary: &ImportSummary) -> Result<()> {
    if args.json {
        return print_json(summary);
    }
    print(&format!(
        "{}: clip {} ({}): {} of {} vertices at {} fps; {} in the capture\n",
        summary.capture.display(),
        summary.clip,
        summary.split,
        counted(summary.frames, "frame"),
        summary.vertices,
        summary.fps,
        counted(summary.clips, "clip"),
    ))
}
