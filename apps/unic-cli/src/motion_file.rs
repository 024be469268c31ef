//! Motion files, as every command reads them.

use crate::{args::MotionArgs, checks::ForceArgs, output::say};
use anyhow::Result;
use std::path::Path;
use unic_core::{character::Character, clip::Clip};
use unic_io::{BoneMap, MotionOptions, Repeat, import_motion};

/// A motion for a character at `fps` frames a second; what was converted is said on stderr.
///
/// # Errors
/// A file that cannot be read, and one that is probably a mistake unless `force` goes on.
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
    force.settle(path, &import.findings)?;
    for note in &import.notes {
        say(&format!("{}: {note}", path.display()));
    }
    Ok(import.clip)
}
