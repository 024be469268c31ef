//! The command `unic retarget`: transfers a motion to a character and writes it.

use crate::{
    args::RetargetArgs,
    motion_file,
    motion_source::character,
    output::{print, print_json},
    outputs::{Existing, Outputs},
};
use anyhow::{Result, bail};
use serde::Serialize;
use std::path::Path;
use unic_core::{character::Character, clip::Clip};
use unic_io::{FootMeasure, FootSlide, MotionOptions, counted, measure_feet, write_bvh, write_motion};

/// Format of the motion to write, chosen by the ending of its path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MotionFormat {
    Npz,
    Bvh,
}

impl MotionFormat {
    /// Returns the format of a path.
    ///
    /// # Errors
    /// An ending of no known format.
    fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("npz") => Ok(Self::Npz),
            Some("bvh") => Ok(Self::Bvh),
            found => {
                let found = found.map_or("none".to_owned(), |found| format!(".{found}"));
                let path = path.display();
                bail!("{path}: expected the ending .npz or .bvh, found {found}")
            }
        }
    }
}

/// Transfers a motion and writes it.
///
/// # Errors
/// Unusable options or inputs, joints that cannot be identified, a file that cannot be written.
pub(crate) fn run(args: &RetargetArgs) -> Result<()> {
    let format = MotionFormat::of(&args.out)?;
    let inputs = [
        Some(&args.motion),
        args.to.as_ref(),
        args.reading.bone_map.as_ref(),
    ];
    Outputs::with_inputs(inputs.into_iter().flatten())
        .file(&args.out)
        .check(Existing::of(args.overwrite))?;
    let character = character(args.to.as_deref(), args.body.as_deref())?;
    let options = MotionOptions {
        fps: args.fps,
        feet: args.feet.into(),
        ..motion_file::options(&args.reading)?
    };
    let import = motion_file::import(&args.motion, &character, &options, args.force)?;
    // Feet are held over the whole motion, so that they are measured before it is cut.
    let feet = import.feet.or_else(|| unchanged_feet(&import.clip, &character));
    let clip = motion_file::cut(&args.motion, import.clip, args.frames.clone())?;
    match format {
        MotionFormat::Npz => write_motion(&args.out, &clip, character.skeleton.names())?,
        MotionFormat::Bvh => write_bvh(&args.out, &clip, &character.skeleton)?,
    }
    let transferred = Transferred {
        motion: &args.out,
        frames: clip.len(),
        fps: clip.fps,
        joints: character.skeleton.len(),
        feet: feet.map(FeetSummary::from),
        notes: &import.notes,
    };
    match args.json {
        true => print_json(&transferred),
        false => print(&transferred.text()),
    }
}

/// Measures feet that were not held.
fn unchanged_feet(clip: &Clip, character: &Character) -> Option<FootSlide> {
    let measure = measure_feet(clip, clip, character)?;
    Some(FootSlide {
        before: measure,
        after: measure,
    })
}

/// Object that `--json` prints.
#[derive(Serialize)]
struct Transferred<'a> {
    motion: &'a Path,
    frames: usize,
    fps: f32,
    joints: usize,
    /// Standing feet; null without joints that are known as feet.
    feet: Option<FeetSummary>,
    notes: &'a [String],
}

/// Standing feet before and after they were held.
#[derive(Serialize)]
struct FeetSummary {
    /// Time that the feet stand, summed over both.
    standing_s: f32,
    slide_before_m_per_s: f32,
    slide_after_m_per_s: f32,
    deepest_before_m: f32,
    deepest_after_m: f32,
}

impl From<FootSlide> for FeetSummary {
    fn from(feet: FootSlide) -> Self {
        let FootMeasure {
            standing_seconds,
            slide,
            deepest,
            ..
        } = feet.before;
        Self {
            standing_s: standing_seconds,
            slide_before_m_per_s: slide,
            slide_after_m_per_s: feet.after.slide,
            deepest_before_m: deepest,
            deepest_after_m: feet.after.deepest,
        }
    }
}

impl Transferred<'_> {
    fn text(&self) -> String {
        let frames = counted(self.frames, "frame");
        let joints = counted(self.joints, "joint");
        let mut text = format!(
            "{}: {frames} of {joints} at {} fps\n",
            self.motion.display(),
            self.fps
        );
        if let Some(feet) = &self.feet {
            text += &format!(
                "standing feet ({:.1} s of both)   before    after\n  slide, m/s                     {:>7.3}  {:>7.3}\n  \
                 deepest in the ground, m       {:>7.3}  {:>7.3}\n",
                feet.standing_s,
                feet.slide_before_m_per_s,
                feet.slide_after_m_per_s,
                feet.deepest_before_m,
                feet.deepest_after_m
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_chooses_the_format_in_any_case() {
        let format = |path: &str| MotionFormat::of(Path::new(path)).ok();
        assert_eq!(format("a.b/walk.NPZ"), Some(MotionFormat::Npz));
        assert_eq!(format("walk.bvh"), Some(MotionFormat::Bvh));
        assert_eq!((format("walk.fbx"), format("walk")), (None, None));
    }
}
