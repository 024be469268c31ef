//! Motion from AMASS-like npz files.
//!
//! Format: Mahmood et al. 2019, "AMASS: Archive of Motion Capture as Surface Shapes"; layouts of
//! SMPL (Loper et al. 2015), SMPL-H (Romero et al. 2017) and SMPL-X (Pavlakos et al. 2019).

mod arrays;
mod ground;
mod up;
mod write;

pub use arrays::PoseLayout;
pub(crate) use arrays::{GROUND_HEIGHT_NAME, MotionArrays, POSE_NAMES, check_frame_rate};
pub(crate) use write::write_arrays;
pub use write::write_motion;

use crate::{error::Error, error::Result, npz::Npz};
use std::path::Path;
use unic_core::{character::Character, clip::Clip};

/// Which axis points up in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// Whichever of Y and Z the body's up direction follows on average: files do not say.
    #[default]
    Auto,
    /// Y, as here.
    Y,
    /// Z, as in AMASS.
    Z,
}

/// What becomes of the height above the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seating {
    /// Re-seated where the file is foreign (another joint layout, or Z up), kept elsewhere.
    #[default]
    Auto,
    /// As recorded.
    Keep,
    /// Moved vertically until the body stands on the ground, y = 0. A file's subject has another
    /// leg length than the character in use.
    Ground,
}

/// How to read a motion file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionOptions {
    /// Frames per second of the result; `None` keeps the file's.
    pub fps: Option<f32>,
    /// Up axis of the file.
    pub up: UpAxis,
    /// Height above the ground.
    pub seating: Seating,
}

/// A clip for one character, and what was done to make it.
#[derive(Clone, Debug)]
pub struct MotionImport {
    /// The motion: Y up, metres, one rotation a joint of the character.
    pub clip: Clip,
    /// One sentence a conversion.
    pub notes: Vec<String>,
}

/// Reads `poses` (T, 3K) or (T, K, 3) local axis-angle in radians, `trans` (T, 3) in metres and
/// the frame rate (`mocap_framerate`, `mocap_frame_rate` or `fps`) as a clip for `character`.
///
/// K is the character's number of joints, or for a character of 24 joints in SMPL's order one of
/// [`PoseLayout`]'s. Z up becomes Y up by R, −90° about x: R · (trans + J₀) − J₀ is the
/// translation, with J₀ the character's root joint, and R · root the orientation.
///
/// # Errors
/// Missing arrays, another number of joints, fewer than two frames, numbers that are not finite, a
/// frame rate outside 1 to 1000.
pub fn import_motion(path: &Path, character: &Character, options: &MotionOptions) -> Result<MotionImport> {
    let mut npz = Npz::open(path)?;
    let arrays = MotionArrays::read(&mut npz, character.skeleton.len())?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut notes = arrays.notes.clone();
    let foreign = arrays.layout != PoseLayout::Native;
    let mut clip = arrays.into_clip(name.into_owned());
    let turned = up::to_y_up(&mut clip, &character.skeleton, options.up, &mut notes);
    let reseat = match options.seating {
        Seating::Auto => foreign || turned == up::Turned::FromZ,
        Seating::Keep => false,
        Seating::Ground => true,
    };
    if reseat {
        ground::seat(&mut clip, character, &mut notes);
    }
    if let Some(fps) = options.fps {
        clip = resampled(path, clip, fps, &mut notes)?;
    }
    Ok(MotionImport { clip, notes })
}

fn resampled(path: &Path, clip: Clip, fps: f32, notes: &mut Vec<String>) -> Result<Clip> {
    check_frame_rate(f64::from(fps))
        .map_err(|found| Error::content(path, "a target frame rate from 1 to 1000", found))?;
    if clip.fps == fps {
        return Ok(clip);
    }
    let resampled = clip.resampled(fps);
    let (before, after) = (clip.len(), resampled.len());
    if after < 2 {
        let expected = format!("at least two frames at {fps} fps");
        return Err(Error::content(path, expected, format!("{} s", clip.seconds())));
    }
    notes.push(format!(
        "resampled from {} fps to {fps} fps ({before} to {after} frames)",
        clip.fps
    ));
    Ok(resampled)
}
