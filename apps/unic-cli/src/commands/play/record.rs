//! Movies of a play, without a window.

use super::{Settings, costumes::Wardrobe};
use crate::{
    args::{PlayArgs, RecordArgs},
    interrupt, movie,
    output::{print, print_json, print_status},
    outputs::{Existing, Outputs},
    progress::Progress,
};
use anyhow::Result;
use serde::Serialize;
use std::{
    path::{Path, PathBuf},
    time::Instant,
};
use unic_eval::control::Player;
use unic_raster::Image;
use unic_viewer::{FollowCamera, Painter, PlaySession, Steering};

/// Checks the movie's path before anything is read.
pub(super) fn check(args: &PlayArgs) -> Result<()> {
    let Some(path) = &args.record.record else {
        return Ok(());
    };
    let outputs = Outputs::with_inputs(args.models.iter().chain(args.source.files()));
    movie::check(outputs, path, Existing::of(args.record.overwrite))
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
    let painter = Painter::new(args.renderer.into(), args.size)?;
    print_status(&painter.description());
    let existing = Existing::of(args.overwrite);
    let mut movie = movie::create(path, existing, args.fps, args.size)?;
    let session = PlaySession::new(settings.play(&wardrobe, painter.context())?)?;
    let frames = (args.seconds * args.fps).round().max(1.0) as usize;
    let mut recording = Recording::new(session, painter, Player::new(args.script.into(), 0));
    let mut progress = Progress::new("drawing", 0, frames as u64);
    for frame in 0..frames {
        interrupt::check()?;
        movie.push(&recording.picture(1.0 / args.fps)?)?;
        progress.set(frame as u64 + 1, String::new);
    }
    movie.finish()?;
    print_summary(args, &recording.summary(args, path, frames))
}

/// Play in progress, with what draws it.
struct Recording {
    session: PlaySession,
    painter: Painter,
    player: Player,
    camera: FollowCamera,
    ticks: usize,
    motion_s: f32,
    garment_s: f32,
    draw_s: f32,
}

impl Recording {
    fn new(session: PlaySession, painter: Painter, player: Player) -> Self {
        Self {
            camera: FollowCamera::new(session.centre(), session.characters()),
            session,
            painter,
            player,
            ticks: 0,
            motion_s: 0.0,
            garment_s: 0.0,
            draw_s: 0.0,
        }
    }

    /// Plays on for `seconds` and draws.
    fn picture(&mut self, seconds: f32) -> Result<Image> {
        let player = &mut self.player;
        let script = &mut |now_s: f32, object: &_| player.command(now_s, object);
        self.session.advance(seconds, Steering::Script(script))?;
        self.camera.follow(self.session.centre(), seconds);
        let times = self.session.times();
        self.ticks += times.ticks;
        self.motion_s += times.motion_s;
        self.garment_s += times.garment_s;
        let start = Instant::now();
        let image = self.draw()?;
        self.draw_s += start.elapsed().as_secs_f32();
        Ok(image)
    }

    fn draw(&mut self) -> Result<Image> {
        let camera = self.camera.orbit.camera()?;
        let painter = &mut self.painter;
        Ok(self.session.with_scene(|scene| painter.picture(scene, &camera))?)
    }

    fn summary(&self, args: &RecordArgs, path: &Path, frames: usize) -> RecordSummary {
        let by_tick = 1e3 / self.ticks.max(1) as f32;
        RecordSummary {
            path: path.into(),
            frames,
            fps: args.fps,
            size: args.size,
            vertices: self.session.costume().outfit.model().vertex_count(),
            characters: self.session.characters(),
            renderer: self.painter.description(),
            motion_ms: self.motion_s * by_tick,
            garment_ms: self.garment_s * by_tick,
            draw_ms: self.draw_s * 1e3 / frames as f32,
        }
    }
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
        motion_ms,
        garment_ms,
        draw_ms,
        ..
    } = summary;
    print(&format!(
        "{}: {frames} pictures of {width} x {height} at {fps} a second\n\
         motion {motion_ms:.2} ms and garment {garment_ms:.2} ms a tick, drawing {draw_ms:.1} ms a picture\n",
        path.display()
    ))
}
