//! Reading of motion files, the same for every command.

use crate::{args::MotionArgs, checks::ForceArgs, output::print_status};
use anyhow::Result;
use std::path::Path;
use unic_core::{character::Character, clip::Clip};
use unic_io::{BoneMap, MotionImport, MotionOptions, Repeat, import_motion};

/// Reads a motion for a character, resampled to `fps` frames per second.
///
/// Conversions, such as of the up axis, are reported on stderr.
///
/// # Errors
/// A file that cannot be read, or that is probably a mistake without `--force`.
pub(crate) fn read(
    path: &Path,
    character: &Character,
    fps: f32,
    args: &MotionArgs,
    force: ForceArgs,
) -> Result<Clip> {
    let import = import(path, character, Some(fps), args, force)?;
    for note in &import.notes {
        print_status(&format!("{}: {note}", path.display()));
    }
    Ok(import.clip)
}

/// Reads a motion for a character, resampled to `fps` frames per second if given, with its notes.
///
/// # Errors
/// A file that cannot be read, or that is probably a mistake without `--force`.
pub(crate) fn import(
    path: &Path,
    character: &Character,
    fps: Option<f32>,
    args: &MotionArgs,
    force: ForceArgs,
) -> Result<MotionImport> {
    let repeat = |times: std::num::NonZeroUsize| Repeat {
        times: times.get(),
        ..Repeat::default()
    };
    let options = MotionOptions {
        fps,
        up: args.up.into(),
        bones: args
            .bone_map
            .as_deref()
            .map(BoneMap::read)
            .transpose()?
            .unwrap_or_default(),
        low_pass: args.low_pass.unwrap_or_default(),
        repeat: args.repeat.map(repeat),
        ..MotionOptions::default()
    };
    let import = import_motion(path, character, &options)?;
    force.check_findings(path, &import.findings)?;
    Ok(import)
}
