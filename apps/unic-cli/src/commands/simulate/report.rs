//! Result of a simulation: `simulation.json`, the table on stdout and pictures of the clips.

use super::{
    inputs::{self, Job},
    work::{ClipRow, ClipSimulator, FinishedClip},
};
use crate::{
    args::SimulateArgs,
    output::{print, print_json},
    outputs::{Existing, Outputs},
    pictures::{CLOTH, FrameSnapshot, GAP, Renderer, Snapshot},
};
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};
use unic_raster::grid;

const FILE: &str = "simulation.json";

/// Object that `--json` prints and `simulation.json` holds.
#[derive(Serialize)]
pub(super) struct SimulationSummary<'a> {
    capture: PathBuf,
    vertices: usize,
    fps: f32,
    /// Wall-clock time of the whole command.
    seconds: f64,
    /// Finished clips, at the end in the order of the capture.
    clips: Vec<&'a ClipRow>,
}

impl<'a> SimulationSummary<'a> {
    /// Creates the summary of the clips that are finished.
    pub(super) fn new(args: &SimulateArgs, vertices: usize, rows: &'a [ClipRow], took: Duration) -> Self {
        Self {
            capture: args.out.clone(),
            vertices,
            fps: args.fps,
            seconds: took.as_secs_f64(),
            clips: rows.iter().collect(),
        }
    }

    /// Sorts the clips in the order of `jobs`.
    pub(super) fn sorted(mut self, jobs: &[Job]) -> Self {
        let index = |row: &ClipRow| jobs.iter().position(|job| job.clip.name == row.clip);
        self.clips.sort_by_key(|row| index(row));
        self
    }
}

/// Rows that an earlier run has written. Empty if there are none.
pub(super) fn stored_rows(folder: &Path) -> Vec<ClipRow> {
    #[derive(Deserialize)]
    struct StoredSummary {
        clips: Vec<ClipRow>,
    }
    // The rows are a report, on which the capture does not depend: a damaged file is treated as
    // none.
    let text = fs::read_to_string(folder.join(FILE)).unwrap_or_default();
    serde_json::from_str::<StoredSummary>(&text).map_or(Vec::new(), |summary| summary.clips)
}

/// Creates the folder of `--pictures` before the simulation, so that it cannot fail afterwards.
///
/// # Errors
/// Pictures that exist already, a folder that cannot be created.
pub(super) fn create_picture_folder(args: &SimulateArgs, jobs: &[Job]) -> Result<()> {
    let Some(folder) = &args.pictures else {
        return Ok(());
    };
    // All clips are checked, also those that an earlier run has finished and that get no picture.
    let names = jobs.iter().map(|job| picture_name(&job.clip.name));
    Outputs::with_inputs(inputs::files(args))
        .folder(folder, names)
        .check(Existing::of(args.overwrite))?;
    fs::create_dir_all(folder).with_context(|| format!("{}: cannot create the folder", folder.display()))
}

/// Draws a strip of pictures for each clip that this run has simulated.
pub(super) fn draw(args: &SimulateArgs, simulator: &ClipSimulator, clips: &[FinishedClip]) -> Result<()> {
    let Some(folder) = &args.pictures else {
        return Ok(());
    };
    for clip in clips {
        // Each clip has its own camera, which fits its first pose and all of its snapshots.
        let snapshots: Vec<Snapshot> = clip.pictures.iter().map(|p| p.snapshot.clone()).collect();
        let renderer = Renderer::new(&simulator.character, &simulator.input.garment, 0.0, &snapshots)?;
        let tile = |p: &FrameSnapshot| {
            renderer.picture(&p.snapshot, CLOTH, &format!("{:.2} s", p.frame as f32 / args.fps))
        };
        let tiles = clip.pictures.iter().map(tile).collect::<Result<Vec<_>>>()?;
        let picture = grid(&tiles, tiles.len(), GAP)?.encode_png()?;
        unic_io::atomic::write(&folder.join(picture_name(&clip.row.clip)), &picture)?;
    }
    Ok(())
}

fn picture_name(clip: &str) -> String {
    format!("{clip}.png")
}

/// Writes `simulation.json`.
pub(super) fn write_summary(summary: &SimulationSummary) -> Result<()> {
    let json = serde_json::to_string_pretty(summary)?;
    Ok(unic_io::atomic::write(
        &summary.capture.join(FILE),
        json.as_bytes(),
    )?)
}

/// Prints a table with one row per clip, or one JSON object.
pub(super) fn print_summary(args: &SimulateArgs, summary: &SimulationSummary) -> Result<()> {
    match args.json {
        true => print_json(summary),
        false => print(&text(summary)),
    }
}

fn text(summary: &SimulationSummary) -> String {
    // The first column is as wide as the longest name, and no narrower than its heading.
    let width = summary
        .clips
        .iter()
        .map(|c| c.clip.len())
        .max()
        .unwrap_or(0)
        .max(4);
    let mut text = format!(
        "{:width$}  split       frames  CPU s/frame  inside %  deepest mm  strain p99 %  creep mm  top m/s\n",
        "clip"
    );
    for c in &summary.clips {
        let s = &c.quality;
        text += &format!(
            "{:width$}  {:10}  {:6}  {:11.4}  {:8.3}  {:10.1}  {:12.1}  {:8.1}  {:7.1}\n",
            c.clip,
            c.split,
            c.frames,
            c.cpu_s_per_frame,
            s.inside_percent,
            s.deepest_mm,
            s.strain_p99_percent,
            c.creep_mm,
            s.top_speed_m_per_s,
        );
    }
    text + &format!(
        "{} written in {:.0} s\n",
        summary.capture.display(),
        summary.seconds
    )
}
