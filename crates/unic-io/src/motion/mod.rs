//! Motion from AMASS-like npz files and from BVH.
//!
//! npz: Mahmood et al. 2019, "AMASS: Archive of Motion Capture as Surface Shapes"; layouts of
//! SMPL (Loper et al. 2015), SMPL-H (Romero et al. 2017) and SMPL-X (Pavlakos et al. 2019).

mod arrays;
mod ground;
mod joints;
mod looped;
mod up;
mod write;

pub use arrays::PoseLayout;
pub(crate) use arrays::{GROUND_HEIGHT_NAME, MotionArrays, POSE_NAMES, WIND_NAME, check_frame_rate};
pub(crate) use joints::{JOINT_NAMES, Joints};
pub use looped::{Cycle, Repeat, looped};
pub(crate) use up::turn as turn_to_y_up;
pub(crate) use write::write_arrays;
pub use write::write_motion;

use crate::{
    bvh::Bvh,
    check::{self, Finding},
    error::{Error, Result},
    formats::refuse_foreign,
    npz::Npz,
    retarget::{BoneMap, Source, feet, low_pass},
};
use std::{fs::File, io::Read, path::Path};
use unic_core::{character::Character, clip::Clip};

/// Ten hours at 30 fps: a slip of the hand asks for more.
const MOST_FRAMES: usize = 1 << 20;

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
    /// Re-seated where the file is foreign (another skeleton or joint layout, or Z up), kept
    /// elsewhere.
    #[default]
    Auto,
    /// As recorded.
    Keep,
    /// Moved vertically until the body stands on the ground, y = 0. A file's subject has another
    /// leg length than the character in use.
    Ground,
}

/// What becomes of fast small movements.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LowPass {
    /// Raw motion capture (BVH) is filtered at 10 Hz; other files are as their makers left them.
    #[default]
    Auto,
    /// Nothing.
    Off,
    /// Single wild frames are replaced, and what is faster than this many Hz goes.
    Hertz(f32),
}

/// What becomes of feet that stand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Feet {
    /// Held where the motion comes from another skeleton (BVH), as they are elsewhere.
    #[default]
    Auto,
    /// As they are.
    Keep,
    /// Held in place on the ground while they are slow and low.
    Hold,
}

/// How to read a motion file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionOptions {
    /// Frames per second of the result; `None` keeps the file's.
    pub fps: Option<f32>,
    /// Up axis of the file.
    pub up: UpAxis,
    /// Height above the ground.
    pub seating: Seating,
    /// Joints of a BVH file whose names do not tell what they are.
    pub bones: BoneMap,
    /// Against the noise of motion capture.
    pub low_pass: LowPass,
    /// Against feet that slide or sink.
    pub feet: Feet,
    /// Against motions that are too short; after everything else.
    pub repeat: Option<Repeat>,
}

/// A clip for one character, and what was done to make it.
#[derive(Clone, Debug)]
pub struct MotionImport {
    /// The motion: Y up, metres, one rotation a joint of the character.
    pub clip: Clip,
    /// One sentence a conversion.
    pub notes: Vec<String>,
    /// Probable mistakes in the motion as the file has it.
    pub findings: Vec<Finding>,
}

/// Whose joints a file has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Origin {
    /// The character's, as they are here.
    Own,
    /// The character's in another layout, or with another axis up.
    Foreign,
    /// Another skeleton's.
    Captured,
}

/// Reads a motion file as a clip for `character`: BVH by its extension or first word, else npz.
///
/// **npz**: `poses` (T, 3K) or (T, K, 3) local axis-angle in radians, `trans` (T, 3) in metres and
/// the frame rate (`mocap_framerate`, `mocap_frame_rate` or `fps`). With `joint_names` (K) the
/// character's joints are found by name, in any order. Without, K is the character's number of
/// joints, or for a character of 24 joints one of [`PoseLayout`]'s, in SMPL's order. Z up becomes Y
/// up by R, −90° about x: R · (trans + J₀) − J₀ is the translation, with J₀ the character's root
/// joint, and R · root the orientation.
///
/// **BVH**: any skeleton, put on a character whose joints have names that tell what they are; see
/// [`retarget`](crate::retarget).
///
/// # Errors
/// Missing arrays, another number of joints, joints that cannot be told, fewer than two frames,
/// numbers that are not finite, a frame rate outside 1 to 1000.
pub fn import_motion(path: &Path, character: &Character, options: &MotionOptions) -> Result<MotionImport> {
    refuse_foreign(path, "a motion (npz or BVH)")?;
    let Motion {
        mut clip,
        origin,
        mut notes,
        mut findings,
    } = match is_bvh(path)? {
        true => from_bvh(path, character, options)?,
        false => from_npz(path, character, options)?,
    };
    if findings.is_empty() {
        // Before the body is put on the ground, which would hide another unit.
        findings = check::motion(&clip, Some(&character.skeleton));
    }
    let captured = origin == Origin::Captured;
    match options.low_pass {
        LowPass::Auto if captured => filter(path, &mut clip, low_pass::DEFAULT_HZ, &mut notes)?,
        LowPass::Hertz(hertz) => filter(path, &mut clip, hertz, &mut notes)?,
        LowPass::Auto | LowPass::Off => {}
    }
    let reseat = match options.seating {
        Seating::Auto => origin != Origin::Own,
        Seating::Keep => false,
        Seating::Ground => true,
    };
    if reseat {
        ground::seat(&mut clip, character, &mut notes);
    }
    if let Some(fps) = options.fps {
        clip = resampled(path, clip, fps, &mut notes)?;
    }
    if options.feet == Feet::Hold || captured && options.feet == Feet::Auto {
        feet::hold(&mut clip, character, &mut notes);
    }
    if let Some(repeat) = &options.repeat {
        clip = repeated(path, &clip, character, repeat, &mut notes)?;
    }
    Ok(MotionImport {
        clip,
        notes,
        findings,
    })
}

/// Whether a file is BVH: by its extension, or because it begins as one.
pub(crate) fn is_bvh(path: &Path) -> Result<bool> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bvh")) {
        return Ok(true);
    }
    let mut start = Vec::new();
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    (file.take(64).read_to_end(&mut start)).map_err(Error::io(path, "read"))?;
    Ok(begins_as_bvh(&start))
}

/// Whether the first word of a file is that of BVH.
pub(crate) fn begins_as_bvh(start: &[u8]) -> bool {
    let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    start.trim_ascii_start().starts_with(b"HIERARCHY")
}

/// A motion file's content, on the character.
struct Motion {
    clip: Clip,
    origin: Origin,
    notes: Vec<String>,
    findings: Vec<Finding>,
}

fn from_bvh(path: &Path, character: &Character, options: &MotionOptions) -> Result<Motion> {
    let bvh = Bvh::read(path)?;
    let source = Source::new(path, &bvh, &options.bones, options.up)?;
    let (clip, notes) = source.on(path, &bvh, character)?;
    Ok(Motion {
        clip,
        origin: Origin::Captured,
        notes,
        findings: Vec::new(),
    })
}

fn from_npz(path: &Path, character: &Character, options: &MotionOptions) -> Result<Motion> {
    let mut npz = Npz::open(path)?;
    let arrays = MotionArrays::read(&mut npz, &Joints::Of(&character.skeleton))?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let (mut notes, findings) = (arrays.notes.clone(), arrays.findings.clone());
    let is_native = arrays.layout == PoseLayout::Native;
    let mut clip = arrays.into_clip(name.into_owned());
    let turned = up::to_y_up(&mut clip, &character.skeleton, options.up, &mut notes);
    let origin = match is_native && turned == up::Turned::No {
        true => Origin::Own,
        false => Origin::Foreign,
    };
    Ok(Motion {
        clip,
        origin,
        notes,
        findings,
    })
}

fn filter(path: &Path, clip: &mut Clip, hertz: f32, notes: &mut Vec<String>) -> Result<()> {
    if !(hertz.is_finite() && hertz > 0.0) {
        let expected = "a low-pass cutoff above 0 Hz";
        return Err(Error::content(path, expected, hertz.to_string()));
    }
    let spikes = low_pass::low_pass(clip, hertz);
    notes.push(match spikes {
        0 => format!("low-pass filtered at {hertz} Hz"),
        _ => format!("low-pass filtered at {hertz} Hz, after {spikes} spikes of single joints were removed"),
    });
    Ok(())
}

fn repeated(
    path: &Path,
    clip: &Clip,
    character: &Character,
    repeat: &Repeat,
    notes: &mut Vec<String>,
) -> Result<Clip> {
    if repeat.times.saturating_mul(clip.len()) > MOST_FRAMES {
        let expected = format!("at most {MOST_FRAMES} frames after repeating");
        let found = format!("{} times {}", repeat.times, clip.len());
        return Err(Error::content(path, expected, found));
    }
    let (looped, frames) = looped(clip, &character.skeleton, repeat);
    notes.push(format!(
        "frames {} to {} repeated {} times",
        frames.start(),
        frames.end(),
        repeat.times
    ));
    Ok(looped)
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
