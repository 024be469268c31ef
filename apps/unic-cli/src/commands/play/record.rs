//! Movies of a play, without a window.

use super::{Settings, costumes::Wardrobe};
use crate::{
    args::{PlayArgs, RecordArgs},
    interrupt,
    output::{print, print_json},
    outputs::{Existing, Outputs},
    progress::Progress,
};
use anyhow::Result;
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    time::Instant,
};
use unic_core::motion_matching::Command;
use unic_eval::control::Player;
use unic_viewer::{
    EarlierFrames, FollowCamera, MovieFormat, MovieWriter, Painter, PlaySession, SUN, Scene, Steering,
};

/// Time before the first picture in which the garment falls into place, seconds.
const SETTLE_S: f32 = 1.0;

/// Checks the movie's path before anything is read.
pub(super) fn check(args: &PlayArgs) -> Result<()> {
    let Some(path) = &args.record.record else {
        return Ok(());
    };
    format(path, args.record.overwrite)?;
    let inputs = args.models.iter().chain(args.source.files());
    let outputs = Outputs::with_inputs(inputs);
    match format(path, args.record.overwrite)? {
        // The writer of frames checks the folder.
        MovieFormat::Frames(_) => outputs.folder(path, []).check(Existing::Resumed),
        MovieFormat::Gif | MovieFormat::Mp4 => outputs.file(path).check(Existing::of(args.record.overwrite)),
    }
}

fn format(path: &Path, overwrite: bool) -> Result<MovieFormat> {
    Ok(match (MovieFormat::from_path(path)?, overwrite) {
        (MovieFormat::Frames(_), true) => MovieFormat::Frames(EarlierFrames::Replace),
        (format, _) => format,
    })
}

/// Object that `--json` prints.
#[derive(Debug, Serialize)]
struct RecordSummary {
    path: PathBuf,
    frames: usize,
    fps: f32,
    size: [u32; 2],
    /// Vertices of the garment.
    vertices: usize,
    characters: usize,
    /// Sentence about what drew the pictures.
    renderer: String,
    /// Mean times: of motion matching and of the garments by tick, of drawing by picture.
    motion_ms: f32,
    garment_ms: f32,
    draw_ms: f32,
}

/// Plays the script and writes the movie.
pub(super) fn run(args: &RecordArgs, path: &Path, wardrobe: Wardrobe, settings: Settings) -> Result<()> {
    let mut painter = Painter::new(args.renderer.into(), args.size)?;
    let mut session = PlaySession::new(settings.play(wardrobe, painter.context())?)?;
    let mut movie = MovieWriter::create(path, format(path, args.overwrite)?, args.movie_fps, args.size)?;
    let frames = (args.seconds * args.movie_fps).round().max(1.0) as usize;
    let mut player = Player::new(args.script.into(), 0);
    session.settle(SETTLE_S)?;
    let began = session.seconds();
    let mut camera = FollowCamera::new(session.root());
    let mut progress = Progress::new("drawing", 0, frames as u64);
    let mut sums = [0.0f32; 3];
    let mut ticks = 0;
    for frame in 0..frames {
        interrupt::check()?;
        let script = &mut |seconds: f32, object: &_| -> Command { player.command(seconds - began, object) };
        session.advance(1.0 / args.movie_fps, Steering::Script(script))?;
        camera.follow(session.root(), 1.0 / args.movie_fps);
        let start = Instant::now();
        movie.push(&picture(&session, &camera, &mut painter)?)?;
        let times = session.times();
        ticks += times.ticks;
        for (sum, time) in
            sums.iter_mut()
                .zip([times.motion_s, times.garment_s, start.elapsed().as_secs_f32()])
        {
            *sum += time;
        }
        progress.set(frame as u64 + 1, String::new);
    }
    movie.finish()?;
    let by_tick = 1e3 / ticks.max(1) as f32;
    print_summary(
        args,
        &RecordSummary {
            path: path.into(),
            frames,
            fps: args.movie_fps,
            size: args.size,
            vertices: session.costume().outfit.model().vertex_count(),
            characters: session.characters(),
            renderer: painter.description(),
            motion_ms: sums[0] * by_tick,
            garment_ms: sums[1] * by_tick,
            draw_ms: sums[2] * 1e3 / frames as f32,
        },
    )
}

fn picture(
    session: &PlaySession,
    camera: &FollowCamera,
    painter: &mut Painter,
) -> Result<unic_raster::Image> {
    let parts = session.parts();
    let scene = Scene {
        parts: &parts,
        marks: &session.marks(),
        ground: unic_raster::Ground::Height(0.0),
        to_key: SUN,
        focus: PlaySession::focus(&parts),
    };
    Ok(painter.picture(&scene, &camera.orbit.camera()?)?)
}

fn print_summary(args: &RecordArgs, summary: &RecordSummary) -> Result<()> {
    if args.json {
        return print_json(summary);
    }
    let RecordSummary {
        path,
        frames,
        fps,
        size: [width, height],
        renderer,
        motion_ms,
        garment_ms,
        draw_ms,
        ..
    } = summary;
    print(&format!(
        "{}: {frames} pictures of {width} x {height} at {fps} a second, {renderer}\n\
         motion {motion_ms:.2} ms and garment {garment_ms:.2} ms a tick, drawing {draw_ms:.1} ms a picture\n",
        path.display()
    ))
}
