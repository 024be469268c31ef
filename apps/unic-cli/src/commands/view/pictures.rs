//! Movies and pictures of a view, without a window.

use crate::{
    args::{PictureArgs, ViewArgs},
    failure::Usage,
    interrupt, motion_file, movie,
    output::{print, print_json, print_status},
    outputs::{Existing, Outputs},
    progress::Progress,
};
use anyhow::Result;
use serde::Serialize;
use std::path::PathBuf;
use unic_raster::Image;
use unic_viewer::{MovieWriter, Painter, SheetLayout, Side, Subject, ViewSession, draw_sheet};

/// Checks the outputs before anything is read.
pub(super) fn check(args: &ViewArgs) -> Result<()> {
    let existing = Existing::of(args.record.overwrite);
    let read = args
        .paths
        .iter()
        .chain(motion_file::files(&args.motion))
        .chain(&args.reading.bone_map);
    let mut outputs = Outputs::with_inputs(read);
    if let Some(path) = &args.record.screenshot {
        if !path
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
        {
            return Err(Usage(format!(
                "{}: expected a picture that ends in .png",
                path.display()
            ))
            .into());
        }
        outputs = outputs.file(path);
    }
    match &args.record.record {
        Some(path) => movie::check(outputs, path, existing),
        None => outputs.check(existing),
    }
}

/// Object that `--json` prints.
#[derive(Debug, Serialize)]
struct PictureSummary {
    /// Paths of the picture and of the movie.
    written: Vec<PathBuf>,
    /// Number of pictures of the movie.
    frames: usize,
    /// Pictures a second of the movie.
    fps: f32,
    /// Width and height, pixels.
    size: [u32; 2],
    /// Names of the panes.
    panes: Vec<String>,
    /// Sentence about what drew the pictures.
    renderer: String,
}

/// Draws the movie, the picture, or both.
pub(super) fn run(args: &PictureArgs, session: ViewSession) -> Result<()> {
    let layout = SheetLayout::new(session.visible().len(), args.size)?;
    let painter = Painter::new(args.renderer.into(), layout.pane_size())?;
    print_status(&painter.description());
    let fps = args.fps.unwrap_or(session.fps());
    let create = |path: &PathBuf| movie::create(path, Existing::of(args.overwrite), fps, args.size);
    let movie = args.record.as_ref().map(create).transpose()?;
    // Drift curves are complete in every picture, however fast the predictions are.
    session.wait_for(session.duration());
    let mut drawing = Drawing {
        fps,
        session,
        layout,
        painter,
    };
    if let Some(path) = &args.screenshot {
        let middle = match args.record {
            Some(_) => 0.0,
            None => 0.5 * drawing.session.duration(),
        };
        let seconds = args.at.unwrap_or(middle);
        aim(args, &mut drawing.session, seconds);
        drawing.picture(seconds)?.save_png(path)?;
    }
    let frames = match movie {
        Some(movie) => drawing.record(args, movie)?,
        None => 0,
    };
    let written = args.screenshot.iter().chain(&args.record).cloned().collect();
    print_summary(args, &drawing.summary(written, frames))
}

/// Aims the camera at the side and the subject that are asked for, as they are at a time. Where
/// nothing is asked for, it stays at the first frame's character.
pub(super) fn aim(args: &PictureArgs, session: &mut ViewSession, seconds: f32) {
    let subject = match (args.close, args.from) {
        (false, None) => return,
        (false, Some(_)) => Subject::Figure,
        (true, _) => Subject::Garment,
    };
    session.set_seconds(seconds);
    session.wait_for(session.seconds());
    session.aim(args.from.map_or_else(Side::default, Side::from), subject);
}

fn print_summary(args: &PictureArgs, summary: &PictureSummary) -> Result<()> {
    if args.json {
        return print_json(summary);
    }
    let [width, height] = summary.size;
    let mut text = String::new();
    if let Some(path) = &args.screenshot {
        text += &format!("{}: a picture of {width} x {height}\n", path.display());
    }
    if let Some(path) = &args.record {
        let PictureSummary { frames, fps, .. } = summary;
        text += &format!(
            "{}: {frames} pictures of {width} x {height} at {fps} a second\n",
            path.display()
        );
    }
    print(&text)
}

/// Session with what draws it.
struct Drawing {
    session: ViewSession,
    layout: SheetLayout,
    painter: Painter,
    /// Pictures a second of a movie.
    fps: f32,
}

impl Drawing {
    /// Draws the panes at a time, as soon as everything in them is computed.
    fn picture(&mut self, seconds: f32) -> Result<Image> {
        self.session.set_seconds(seconds);
        self.session.wait_for(self.session.seconds());
        self.session.update();
        let painter = &mut self.painter;
        Ok(draw_sheet(&self.session, &self.layout, |scene, camera| {
            painter.picture(scene, camera)
        })?)
    }

    /// Writes the movie. Returns its number of pictures.
    fn record(&mut self, args: &PictureArgs, mut movie: MovieWriter) -> Result<usize> {
        let fps = self.fps;
        let start = args.at.unwrap_or(0.0);
        let rest = (self.session.duration() - start).max(0.0);
        let seconds = args.seconds.map_or(rest, |seconds| seconds.min(rest));
        let pictures = (seconds * fps).round().max(1.0) as usize;
        aim(args, &mut self.session, start);
        let mut progress = Progress::new("drawing", 0, pictures as u64);
        for i in 0..pictures {
            interrupt::check()?;
            movie.push(&self.picture(start + i as f32 / fps)?)?;
            progress.set(i as u64 + 1, String::new);
        }
        movie.finish()?;
        Ok(pictures)
    }

    fn summary(&self, written: Vec<PathBuf>, frames: usize) -> PictureSummary {
        let tracks = self.session.tracks().iter();
        PictureSummary {
            written,
            frames,
            fps: self.fps,
            size: self.layout.size(),
            panes: tracks.map(|track| track.name().to_owned()).collect(),
            renderer: self.painter.description(),
        }
    }
}
