//! Reading of motion files, the same for every command.

use crate::{args::MotionArgs, checks::ForceArgs, output::print_status};
use anyhow::Result;
use std::path::Path;
use unic_core::{character::Character, clip::Clip};
use unic_io::{BoneMap, MotionOptions, Repeat, import_motion};

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
    let repeat = |times: std::num::NonZeroUsize| Repeat {
        times: times.get(),
        ..Repeat::default()
    };
    let options = MotionOptions {
        fps: Some(fps),
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
    for note in &import.notes {
        print_status(&format!("{}: {note}", path.display()));
    }
    Ok(import.clip)
}
