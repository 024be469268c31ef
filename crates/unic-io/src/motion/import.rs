//! Reading a motion file as a clip for a character.

use super::{
    arrays::MotionArrays,
    ground,
    joints::JointTarget,
    layout::PoseLayout,
    options::{FootLock, GroundPlacement, LowPass, MotionOptions},
    plausibility::check_motion,
    repeat::{Repeat, repeat_cycle},
    smpl, up,
};
use crate::{
    bvh::{Bvh, is_bvh},
    error::{Error, Result},
    finding::Finding,
    foreign_formats::refuse_foreign,
    frame_rate::check_frame_rate,
    npz::Npz,
    retarget::{
        FootMeasure, RetargetSource, Retargeted, feet, low_pass, on_same_skeleton, on_same_unnamed_skeleton,
    },
    rigged::{self, RiggedFormat, RiggedTransfer},
};
use std::path::Path;
use unic_core::{character::Character, clip::Clip};

/// Largest number of frames after repeating: ten hours at 30 fps. A typing error asks for more.
const MAX_FRAMES: usize = 1 << 20;

/// A clip for one character, with the conversions that made it.
#[derive(Clone, Debug)]
pub struct MotionImport {
    /// The motion: Y up, metres, one rotation for each joint of the character.
    pub clip: Clip,
    /// Descriptions of the conversions, one sentence each.
    pub notes: Vec<String>,
    /// Probable mistakes in the motion, checked before it is placed on the ground.
    pub findings: Vec<Finding>,
    /// Slide of the standing feet before and after they were held; `None` if they were not.
    pub feet: Option<FootSlide>,
}

/// Slide of standing feet before and after a correction, in the same phases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootSlide {
    /// Feet as they were transferred.
    pub before: FootMeasure,
    /// Feet as they are in the clip.
    pub after: FootMeasure,
}

/// Relation of a file's joints to those of the character.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MotionOrigin {
    /// The character's own joints, Y up.
    Native,
    /// The character's joints in another layout, or Z up.
    Converted,
    /// Another skeleton's joints, from files that may be raw motion capture.
    Retargeted,
    /// Another skeleton's joints, from files of a data set that is smooth.
    RetargetedSmpl,
}

/// Reads a motion file as a clip for `character`: glTF, FBX, USD and BVH by their first bytes or
/// extension, else npz.
///
/// **npz** files hold `poses` (T, 3K) or (T, K, 3), local axis-angle in radians; `trans` (T, 3) in
/// metres; and the frame rate (`mocap_framerate`, `mocap_frame_rate`, `fps` or `framerate`). With
/// `joint_names` (K) the character's joints are found by name, in any order. Without them K is the
/// character's number of joints or, for a character of 24 joints, that of a [`PoseLayout`] in
/// SMPL's order. Motion in SMPL's order for a character of other joints, or whose zero pose is not
/// the T-pose, is transferred as that of BVH files. Z up is rotated to Y up by R, −90° about x: the translation becomes R · (trans +
/// J₀) − J₀ with the character's root joint J₀, and the root's orientation R · root.
///
/// **BVH** files may have any skeleton. With the character's own joints, in any unit, the motion is
/// taken as it is. Else the motion is transferred to a character whose joint names
/// are recognised; [`crate::retarget`] describes how.
///
/// **glTF, FBX and USD** files have the motion of their first animation. If they have the character's own joints
/// at the same places, it is taken as it is; else it is transferred as that of BVH files.
///
/// # Errors
/// Missing arrays, another number of joints, joints that cannot be identified, fewer than two
/// frames, numbers that are not finite, a frame rate outside 1 to 1000.
pub fn import_motion(path: &Path, character: &Character, options: &MotionOptions) -> Result<MotionImport> {
    let LoadedMotion {
        mut clip,
        origin,
        mut notes,
        mut findings,
    } = load(path, character, options)?;
    if findings.is_empty() {
        // Before the body is placed on the ground, which would hide a wrong unit.
        findings = check_motion(&clip, Some(&character.skeleton));
    }
    let is_retargeted = matches!(origin, MotionOrigin::Retargeted | MotionOrigin::RetargetedSmpl);
    match options.low_pass {
        LowPass::Auto if origin == MotionOrigin::Retargeted => {
            filter(path, &mut clip, low_pass::DEFAULT_HZ, &mut notes)?
        }
        LowPass::Hertz(hertz) => filter(path, &mut clip, hertz, &mut notes)?,
        LowPass::Auto | LowPass::Off => {}
    }
    // The order of the steps matters. Spikes would be taken for ground contact, so the filter comes
    // first. Feet are detected at the final frame rate, and repeated rounds need finished feet.
    let is_placed = match options.ground {
        GroundPlacement::Auto => origin != MotionOrigin::Native,
        GroundPlacement::Keep => false,
        GroundPlacement::OnGround => true,
    };
    if is_placed {
        ground::place_on_ground(&mut clip, character, &mut notes);
    }
    if let Some(fps) = options.fps {
        clip = resampled(path, clip, fps, &mut notes)?;
    }
    let is_held = options.feet == FootLock::Hold || is_retargeted && options.feet == FootLock::Auto;
    let feet = match is_held {
        true => feet::hold(&mut clip, character, &mut notes),
        false => None,
    };
    if let Some(repeat) = &options.repeat {
        clip = repeated(path, &clip, character, repeat, &mut notes)?;
    }
    Ok(MotionImport {
        clip,
        notes,
        findings,
        feet,
    })
}

/// Content of a motion file, converted to the character's joints and Y up.
struct LoadedMotion {
    clip: Clip,
    origin: MotionOrigin,
    notes: Vec<String>,
    findings: Vec<Finding>,
}

fn load(path: &Path, character: &Character, options: &MotionOptions) -> Result<LoadedMotion> {
    if let Some(format) = RiggedFormat::of(path) {
        return from_rig(path, format, character, options);
    }
    refuse_foreign(path, "a motion (npz, BVH, glTF, FBX or USD)")?;
    match is_bvh(path)? {
        true => from_bvh(path, character, options),
        // Files of no known kind too: the reader of archives names what is wrong.
        false => from_npz(path, character, options),
    }
}

fn from_rig(
    path: &Path,
    format: RiggedFormat,
    character: &Character,
    options: &MotionOptions,
) -> Result<LoadedMotion> {
    let motion = rigged::read_motion(path, format, character, options)?;
    Ok(LoadedMotion {
        clip: motion.clip,
        origin: match motion.transfer {
            RiggedTransfer::SameRig => MotionOrigin::Native,
            RiggedTransfer::Retargeted => MotionOrigin::Retargeted,
        },
        notes: motion.notes,
        findings: Vec::new(),
    })
}

fn from_bvh(path: &Path, character: &Character, options: &MotionOptions) -> Result<LoadedMotion> {
    let bvh = Bvh::read(path)?;
    if bvh.len() < 2 {
        return Err(Error::content(path, "at least two frames", bvh.len().to_string()));
    }
    let skeleton = &character.skeleton;
    let (origin, Retargeted { clip, notes }) =
        match RetargetSource::new(path, &bvh, &options.bones, options.up) {
            Ok(source) => match on_same_skeleton(path, &bvh, source.world_from_source(), skeleton)? {
                Some(mut taken) => {
                    taken.notes.splice(..0, source.notes);
                    (MotionOrigin::Native, taken)
                }
                None => (MotionOrigin::Retargeted, source.on(path, &bvh, character)?),
            },
            // A table of names is there to be followed.
            Err(error) if !options.bones.is_empty() => return Err(error),
            // Joints of any names may be the character's own.
            Err(error) => match on_same_unnamed_skeleton(path, &bvh, options.up, skeleton)? {
                Some(taken) => (MotionOrigin::Native, taken),
                None => return Err(error),
            },
        };
    Ok(LoadedMotion {
        clip,
        origin,
        notes,
        findings: Vec::new(),
    })
}

fn from_npz(path: &Path, character: &Character, options: &MotionOptions) -> Result<LoadedMotion> {
    let mut npz = Npz::open(path)?;
    if let Some((Retargeted { clip, notes }, findings)) = smpl::transferred(&mut npz, character, options)? {
        return Ok(LoadedMotion {
            clip,
            origin: MotionOrigin::RetargetedSmpl,
            notes,
            findings,
        });
    }
    let joints = JointTarget::Character(&character.skeleton);
    let arrays = MotionArrays::read_at(&mut npz, &joints, options.fps_of_file)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let (mut notes, findings) = (arrays.notes.clone(), arrays.findings.clone());
    let is_native = arrays.layout == PoseLayout::Native;
    let mut clip = arrays.into_clip(name.into_owned());
    let turned = up::convert_to_y_up(&mut clip, &character.skeleton, options.up, &mut notes);
    let origin = match is_native && turned == up::UpConversion::None {
        true => MotionOrigin::Native,
        false => MotionOrigin::Converted,
    };
    Ok(LoadedMotion {
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
    // The filter itself ignores a cutoff near half the frame rate or above.
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
    if repeat.times.saturating_mul(clip.len()) > MAX_FRAMES {
        let expected = format!("at most {MAX_FRAMES} frames after repeating");
        let found = format!("{} times {}", repeat.times, clip.len());
        return Err(Error::content(path, expected, found));
    }
    let repeated = repeat_cycle(clip, &character.skeleton, repeat);
    notes.push(format!(
        "frames {} to {} repeated {} times",
        repeated.source_frames.start(),
        repeated.source_frames.end(),
        repeat.times
    ));
    Ok(repeated.clip)
}

fn resampled(path: &Path, clip: Clip, fps: f32, notes: &mut Vec<String>) -> Result<Clip> {
    check_frame_rate(f64::from(fps))
        .map_err(|found| Error::content(path, "a target frame rate from 1 to 1000", found))?;
    // Resampling to the same rate would round every pose.
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
