//! The command `unic motion-database`: writes the motion database of a steered character.

use crate::{
    args::MotionDatabaseArgs,
    motion_source::{FPS, MotionSource, steered_character},
    output::{print, print_json},
    outputs::{Existing, Outputs},
};
use anyhow::Result;
use serde::Serialize;
use std::path::Path;
use unic_io::{counted, write_motion_database};

/// Makes a database and writes it.
///
/// # Errors
/// Unusable options or inputs, a file that cannot be written.
pub(crate) fn run(args: &MotionDatabaseArgs) -> Result<()> {
    Outputs::with_inputs(args.clips.files().chain(&args.character.character))
        .file(&args.out)
        .check(Existing::of(args.overwrite))?;
    let source = MotionSource::build(steered_character(&args.character)?, FPS, &args.clips, args.force)?;
    write_motion_database(&args.out, &source.database)?;
    let written = Written {
        database: &args.out,
        clips: source.database.clips().len(),
        frames: source.database.len(),
        fps: source.database.fps(),
    };
    match args.json {
        true => print_json(&written),
        false => print(&format!(
            "{}: {} in {}, mirrored ones included\n",
            args.out.display(),
            counted(written.frames, "frame"),
            counted(written.clips, "clip"),
        )),
    }
}

/// Object that `--json` prints.
#[derive(Serialize)]
struct Written<'a> {
    database: &'a Path,
    /// Clips, mirrored ones included.
    clips: usize,
    /// Frames, mirrored ones included.
    frames: usize,
    fps: f32,
}
