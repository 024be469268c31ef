//! Result of a simulation: `simulation.json`, the table on stdout and pictures of the clips.

use super::{
    inputs::{self, Job},
    work::{ClipRow, ClipSimulator, FinishedClip},
};
use crate::{
    args::SimulateArgs,
    output::{print, print_json, print_status},
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

/// Prints a table with one row per clip, or one JSON object, and names the clips in which cloth is
/// caught.
pub(super) fn print_summary(args: &SimulateArgs, summary: &SimulationSummary) -> Result<()> {
    for note in summary
        .clips
        .iter()
        .filter_map(|row| caught(&row.clip, row.creep_mm))
    {
        print_status(&note);
    }
    match args.json {
        true => print_json(summary),
        false => print(&text(summary)),
    }
}

/// Creep above which cloth is probably caught, mm. A T-shirt with a sleeve in the armpit has 83, one that hangs
/// freely after a similar walk -0.6.
const CAUGHT_MM: f32 = 30.0;

/// Note about a clip in which cloth is caught.
fn caught(clip: &str, creep_mm: f32) -> Option<String> {
    let hangs = creep_mm.abs() <= CAUGHT_MM;
    (!hangs).then(|| {
        format!(
            "{clip}: the hem is {creep_mm:.0} mm off its height when the character stands still after the clip: \
             cloth is probably caught. Cut the clip with --seconds, or leave it out"
        )
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caught_cloth_is_named() {
        assert_eq!(caught("walk", -0.6), None);
        let note = caught("turns", 83.3).unwrap();
        assert!(note.starts_with("turns: the hem is 83 mm off"), "{note}");
        assert!(caught("fallen", -40.0).is_some() && caught("broken", f32::NAN).is_some());
    }
}
