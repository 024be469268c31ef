//! Movies and pictures of a view, without a window.

use crate::{
    args::{PictureArgs, ViewArgs},
    interrupt,
    output::print,
    output::print_status,
    outputs::{Existing, Outputs},
    progress::Progress,
};
use anyhow::Result;
use std::path::Path;
use unic_raster::Image;
use unic_viewer::{EarlierFrames, MovieFormat, MovieWriter, Painter, SheetLayout, ViewSession, draw_sheet};

/// Checks the outputs before anything is read.
pub(super) fn check(args: &ViewArgs) -> Result<()> {
    let existing = Existing::of(args.record.overwrite);
    let outputs = || Outputs::with_inputs(args.paths.iter().chain(args.motion.as_ref()));
    if let Some(path) = &args.record.record {
        match format(path, args.record.overwrite)? {
            // The writer of frames checks the folder.
            MovieFormat::Frames(_) => outputs().folder(path, []).check(Existing::Resumed)?,
            MovieFormat::Gif | MovieFormat::Mp4 => outputs().file(path).check(existing)?,
        }
    }
    match &args.record.screenshot {
        Some(path) => outputs().file(path).check(existing),
        None => Ok(()),
    }
}

fn format(path: &Path, overwrite: bool) -> Result<MovieFormat> {
    Ok(match (MovieFormat::from_path(path)?, overwrite) {
        (MovieFormat::Frames(_), true) => MovieFormat::Frames(EarlierFrames::Replace),
        (format, _) => format,
    })
}

/// Draws the movie, the picture, or both.
pub(super) fn run(args: &PictureArgs, session: ViewSession) -> Result<()> {
    let layout = SheetLayout::new(session.visible().len(), args.size)?;
    let painter = Painter::new(args.renderer.into(), layout.pane_size())?;
    print_status(&painter.description());
    let mut drawing = Drawing {
        session,
        layout,
        painter,
    };
    if let Some(path) = &args.screenshot {
        let middle = match args.record {
            Some(_) => 0.0,
            None => 0.5 * drawing.session.duration(),
        };
        let picture = drawing.picture(args.at.unwrap_or(middle))?;
        picture.save_png(path)?;
        print(&format!("{}: a picture\n", path.display()))?;
    }
    match &args.record {
        Some(path) => drawing.record(args, path),
        None => Ok(()),
    }
}

/// Session with what draws it.
struct Drawing {
    session: ViewSession,
    layout: SheetLayout,
    painter: Painter,
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

    fn record(&mut self, args: &PictureArgs, path: &Path) -> Result<()> {
        let fps = args.fps.unwrap_or(self.session.fps());
        let start = args.at.unwrap_or(0.0);
        let rest = (self.session.duration() - start).max(0.0);
        let seconds = args.seconds.map_or(rest, |seconds| seconds.min(rest));
        let pictures = (seconds * fps).round().max(1.0) as usize;
        let mut movie = MovieWriter::create(path, format(path, args.overwrite)?, fps, args.size)?;
        let mut progress = Progress::new("drawing", 0, pictures as u64);
        for i in 0..pictures {
            interrupt::check()?;
            movie.push(&self.picture(start + i as f32 / fps)?)?;
            progress.set(i as u64 + 1, String::new);
        }
        movie.finish()?;
        drop(progress);
        let [width, height] = args.size;
        print(&format!(
            "{}: {pictures} pictures of {width} x {height} at {fps} a second\n",
            path.display()
        ))
    }
}
