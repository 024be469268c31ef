//! What is said about a finished capture.

use super::{
    inputs::Job,
    work::{Made, Row, Workshop},
};
use crate::{
    args::SimulateArgs,
    output::{print, print_json},
    outputs::{Existing, Outputs},
    pictures::{CLOTH, GAP, Shot, Studio},
};
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};
use unic_viewer::grid;

const FILE: &str = "simulation.json";

/// What `--json` prints and `simulation.json` keeps.
#[derive(Serialize)]
pub(super) struct Summary<'a> {
    capture: PathBuf,
    vertices: usize,
    fps: f32,
    /// Of the whole command.
    seconds: f64,
    /// In the order of the capture.
    clips: Vec<&'a Row>,
}

impl<'a> Summary<'a> {
    /// Of the clips that are finished so far.
    pub(super) fn new(args: &SimulateArgs, vertices: usize, rows: &'a [Row], took: Duration) -> Self {
        Self {
            capture: args.out.clone(),
            vertices,
            fps: args.fps,
            seconds: took.as_secs_f64(),
            clips: rows.iter().collect(),
        }
    }

    /// The same, sorted as `jobs` are.
    pub(super) fn sorted(mut self, jobs: &[Job]) -> Self {
        let place = |row: &Row| jobs.iter().position(|job| job.clip.name == row.clip);
        self.clips.sort_by_key(|row| place(row));
        self
    }
}

/// Rows of an earlier run; none where it has not written any.
pub(super) fn rows(folder: &Path) -> Vec<Row> {
    #[derive(Deserialize)]
    struct Before {
        clips: Vec<Row>,
    }
    let text = fs::read_to_string(folder.join(FILE)).unwrap_or_default();
    serde_json::from_str::<Before>(&text).map_or(Vec::new(), |before| before.clips)
}

/// Before the work begins: a folder that cannot be made, or pictures that are there, are found out now.
pub(super) fn open(args: &SimulateArgs, jobs: &[Job]) -> Result<()> {
    let Some(folder) = &args.pictures else {
        return Ok(());
    };
    let names = jobs.iter().map(|job| picture_name(&job.clip.name));
    let inputs = [&args.character, &args.garment].into_iter().chain(&args.motion);
    Outputs::beside(inputs)
        .folder(folder, names)
        .check(Existing::of(args.overwrite))?;
    fs::create_dir_all(folder).with_context(|| format!("{}: the folder cannot be made", folder.display()))
}

/// One strip a clip.
pub(super) fn draw(args: &SimulateArgs, workshop: &Workshop, made: &[Made]) -> Result<()> {
    let Some(folder) = &args.pictures else {
        return Ok(());
    };
    for clip in made {
        let shots: Vec<Shot> = clip.shots.iter().map(|(_, shot)| shot.clone()).collect();
        let studio = Studio::new(&workshop.character, &workshop.cut.garment, 0.0, &shots)?;
        let tiles = (clip.shots.iter())
            .map(|(t, shot)| studio.picture(shot, CLOTH, &format!("{:.2} s", *t as f32 / args.fps)))
            .collect::<Result<Vec<_>>>()?;
        let picture = grid(&tiles, tiles.len(), GAP)?.encode_png()?;
        unic_io::atomic::write(&folder.join(picture_name(&clip.row.clip)), &picture)?;
    }
    Ok(())
}

fn picture_name(clip: &str) -> String {
    format!("{clip}.png")
}

/// Writes `simulation.json`.
pub(super) fn keep(summary: &Summary) -> Result<()> {
    let json = serde_json::to_string_pretty(summary)?;
    Ok(unic_io::atomic::write(
        &summary.capture.join(FILE),
        json.as_bytes(),
    )?)
}

/// A line a clip on stdout, or one JSON object.
pub(super) fn show(args: &SimulateArgs, summary: &Summary) -> Result<()> {
    match args.json {
        true => print_json(summary),
        false => print(&text(summary)),
    }
}

fn text(summary: &Summary) -> String {
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
        let s = &c.soundness;
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
