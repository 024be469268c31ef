//! Reading of motions, files and built-in ones, the same for every command.

use crate::{args::MotionArgs, checks::ForceArgs, failure::Usage, output::print_status};
use anyhow::{Result, anyhow, bail};
use std::{
    ops::Range,
    path::{Path, PathBuf},
};
use unic_builtin::motion::{STANDARD_CLIPS, STANDARD_SEED, standard_clip};
use unic_core::{character::Character, clip::Clip};
use unic_io::{BoneMap, MotionImport, MotionOptions, Repeat, import_motion};

/// Returns whether a motion is one of the built-in ones.
///
/// A built-in name wins over a file of that name.
pub(crate) fn is_built_in(motion: &Path) -> bool {
    STANDARD_CLIPS.iter().any(|name| motion.as_os_str() == *name)
}

/// Returns those motions that are files.
pub(crate) fn files<'a>(motions: impl IntoIterator<Item = &'a PathBuf>) -> impl Iterator<Item = &'a PathBuf> {
    motions.into_iter().filter(|motion| !is_built_in(motion))
}

/// Reads a motion for a character, resampled to `fps` frames per second, or makes the built-in one of
/// that name.
///
/// Conversions, such as of the up axis, are reported on stderr.
///
/// # Errors
/// A file that cannot be read, or that is probably a mistake without `--force`; a built-in motion for
/// a skeleton that cannot perform it.
pub(crate) fn read(
    path: &Path,
    character: &Character,
    fps: f32,
    args: &MotionArgs,
    force: ForceArgs,
) -> Result<Clip> {
    let name = path.to_str().unwrap_or_default();
    let built_in = standard_clip(character, name, STANDARD_SEED, fps);
    if let Some(clip) = built_in.map_err(|e| anyhow!("{name}: {e}"))? {
        return Ok(clip);
    }
    // A word that is neither a built-in name nor a file is most likely a mistyped name.
    if path.extension().is_none() && !path.exists() {
        let (names, found) = (STANDARD_CLIPS.join(", "), path.display());
        let text = format!("{found}: expected a motion file or one of {names}, found nothing");
        return Err(Usage(text).into());
    }
    let options = MotionOptions {
        fps: Some(fps),
        ..options(args)?
    };
    Ok(import(path, character, &options, force)?.clip)
}

/// Returns the options that were typed.
///
/// # Errors
/// A map of bones that cannot be read.
pub(crate) fn options(args: &MotionArgs) -> Result<MotionOptions> {
    let repeat = |times: std::num::NonZeroUsize| Repeat {
        times: times.get(),
        ..Repeat::default()
    };
    Ok(MotionOptions {
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
    })
}

/// Reads a motion for a character, and reports conversions on stderr.
///
/// # Errors
/// A file that cannot be read, or that is probably a mistake without `--force`.
pub(crate) fn import(
    path: &Path,
    character: &Character,
    options: &MotionOptions,
    force: ForceArgs,
) -> Result<MotionImport> {
    let import = import_motion(path, character, options)?;
    force.check_findings(path, &import.findings)?;
    for note in &import.notes {
        print_status(&format!("{}: {note}", path.display()));
    }
    Ok(import)
}

/// Cuts a clip to the frames of `--frames`, if there are any.
///
/// # Errors
/// Frames that the clip does not have.
pub(crate) fn cut(path: &Path, clip: Clip, frames: Option<Range<usize>>) -> Result<Clip> {
    let Some(range) = frames else { return Ok(clip) };
    if range.end > clip.len() {
        let (path, fps) = (path.display(), clip.fps);
        bail!(
            "{path}: expected --frames within 0..{} at {fps} fps, found {}..{}",
            clip.len(),
            range.start,
            range.end
        );
    }
    Ok(clip.part(range))
}
