//! Options of `unic retarget`.

use super::{FeetName, MotionArgs, parse};
use crate::checks::ForceArgs;
use std::{ops::Range, path::PathBuf};

/// Transfer a motion to another character and write it to a file.
///
/// The joints are found by their names: SMPL and AMASS, Mixamo, MotionBuilder, Unity, VRM, Unreal,
/// Biped, Rigify, CMU and others. --bone-map names those that are not recognised. Rest poses may
/// differ (T-pose, A-pose, arms down), and so may the number of joints of spine and neck. The root's
/// path is scaled by the ratio of the legs. Standing feet are held where they stand, and how much
/// they slide is measured before and after.
///
/// Every command that takes a motion transfers it in the same way. This one is for other programs,
/// and for a look at the result.
///
/// The ending of --out chooses the format:
///   walk.npz   rotations of the character's joints, as in AMASS; metres, Y up
///   walk.bvh   skeleton and motion for other programs; centimetres, Y up
///
/// Examples:
///   unic retarget take.bvh --to rig.glb --out take.npz
///   unic retarget amass/run.npz --to rig.glb --fps 30 --out run.bvh
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct RetargetArgs {
    /// Motion file of any skeleton.
    pub(crate) motion: PathBuf,
    /// Character that gets the motion [default: the built-in human].
    #[arg(long, value_name = "CHARACTER")]
    pub(crate) to: Option<PathBuf>,
    /// Name of the body in a character file of several skinned meshes [default: the only one].
    #[arg(long, value_name = "NAME")]
    pub(crate) body: Option<String>,
    /// Motion to write: an .npz or a .bvh file.
    #[arg(long, value_name = "FILE.npz|FILE.bvh")]
    pub(crate) out: PathBuf,
    /// Frames per second to write [default: those of the motion file].
    #[arg(long, value_name = "FPS", value_parser = parse::frame_rate)]
    pub(crate) fps: Option<f32>,
    /// Range of frames to write, A included and B excluded, counted from 0 at the rate that is
    /// written [default: all].
    #[arg(long, value_name = "A..B", value_parser = parse::frames)]
    pub(crate) frames: Option<Range<usize>>,
    /// Treatment of standing feet.
    #[arg(long, value_enum, default_value_t = FeetName::Auto)]
    pub(crate) feet: FeetName,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Replace an existing file.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print one JSON object about the result to stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
