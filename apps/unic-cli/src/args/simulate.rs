//! `unic simulate`.

use super::{MaterialName, MotionArgs, Switch, parse};
use crate::checks::ForceArgs;
use std::path::PathBuf;
use unic_io::capture::JointReference;

/// Simulate a garment on a character: make a capture to train on.
///
/// Each motion becomes a clip. The garment's rest shape lies in the character's rest pose and may
/// cut into the body; every clip begins with a settling phase in which it leaves the body and the
/// character goes over to the clip's first pose. Ctrl-C keeps the clips that are finished; --resume
/// makes the others.
///
/// Examples:
///   unic simulate --out captures/human_tshirt
///   unic simulate --garment skirt --motion walk.npz run.bvh --test run --out captures/skirt
///   unic simulate --character rig.npz --garment coat.obj --material denim --motion *.npz --out captures/coat
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct SimulateArgs {
    /// The character: character.npz, a folder that holds one, or the built-in `human`.
    #[arg(long, value_name = "FILE.npz|FOLDER|human", default_value = "human")]
    pub(crate) character: PathBuf,
    /// The garment: an .obj, a folder with garment.obj and perhaps garment.npz (`pinned` vertices are
    /// held on the body), or built in: tshirt, skirt, pleated_dress, tulle_skirt, robe.
    #[arg(long, value_name = "FILE.obj|FOLDER|NAME", default_value = "tshirt")]
    pub(crate) garment: PathBuf,
    /// Motions: npz or bvh, or names of built-in ones: idle, walk_speeds, walk_circles, walk_slalom,
    /// walk_starts_stops, run_speeds, run_circles, run_slalom, run_starts_stops, squats_jumps,
    /// arms_trunk, mixed, sprint_stop, turn_on_spot, dance [default: all of these, the last three to
    /// test].
    #[arg(long, value_name = "FILE|NAME", num_args = 1..)]
    pub(crate) motion: Vec<PathBuf>,
    /// The folder to write.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// What the whole garment is made of [default: what its maker says, else cotton].
    #[arg(long, value_enum)]
    pub(crate) material: Option<MaterialName>,
    /// Clips held out for evaluation, by name [default: the last one].
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) test: Vec<String>,
    /// Clips that training watches, by name.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) validation: Vec<String>,
    /// Joints that touch the ground, left ankle and foot, right ankle and foot, by name or by number
    /// [default: those of SMPL's names, or of its order for 24 joints].
    #[arg(long, value_name = "L,L,R,R", value_parser = parse::contacts)]
    pub(crate) contacts: Option<[JointReference; 4]>,
    /// Frames a second of the capture, 1 to 1000.
    #[arg(long, value_name = "FPS", default_value_t = 30.0, value_parser = parse::frame_rate)]
    pub(crate) fps: f32,
    /// Only the first seconds of each motion.
    #[arg(long, value_name = "S", value_parser = parse::seconds)]
    pub(crate) seconds: Option<f32>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Steady wind, m/s [default: the motion file's own, else still air].
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    pub(crate) wind: Option<glam::Vec3>,
    /// Simulate every training motion once more in a steady wind of this speed, m/s, each from
    /// another side. Cloth feels the same air when the character moves that way: the model then
    /// knows motion backwards and sideways, and wind.
    #[arg(long, value_name = "M/S", value_parser = parse::speed)]
    pub(crate) breeze: Option<f32>,
    /// Solver steps a frame, 1 to 1000 [default: 20].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) substeps: Option<u32>,
    /// Distance between cloth and body, mm, up to 50 [default: the material's].
    #[arg(long, value_name = "MM", value_parser = parse::thickness)]
    pub(crate) thickness: Option<f32>,
    /// Does the cloth touch itself?
    #[arg(long, value_enum, default_value_t = Switch::On)]
    pub(crate) self_collision: Switch,
    /// Draw each clip: one PNG strip a clip in this folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) pictures: Option<PathBuf>,
    /// Go on with an interrupted simulation in the folder.
    #[arg(long, conflicts_with = "overwrite")]
    pub(crate) resume: bool,
    /// Replace the capture in the folder.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print one JSON object about the result on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
