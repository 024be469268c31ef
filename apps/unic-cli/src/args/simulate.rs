//! Options of `unic simulate`.

use super::{MaterialName, MeshUpName, MotionArgs, Switch, parse};
use crate::checks::ForceArgs;
use std::path::PathBuf;
use unic_io::capture::JointReference;

/// Simulate a garment on a character and write a capture to train on.
///
/// A capture is a folder with a character, a garment and clips. Each motion becomes one clip: the
/// character's poses and the garment's vertex positions in every frame.
///
/// The garment's rest shape is given in the character's rest pose, in metres, and may cut into the
/// body. A settling phase before every clip moves the garment out of the body and the character to
/// the first pose of the clip. Vertices that garment.npz marks as `pinned` stay attached to the
/// body.
///
/// A model learns only what its capture shows. --breeze adds every training motion once more in
/// wind, which acts on cloth like motion of the character in another direction.
///
/// The name of a built-in character, garment or motion always means the built-in one. Write
/// ./skirt for a folder or file that is called skirt.
///
/// Ctrl-C keeps the finished clips. The same command with --resume simulates the others.
///
/// Examples:
///   unic simulate --out captures/human_tshirt
///   unic simulate --garment skirt --motion walk.npz run.bvh --test run --out captures/skirt
///   unic simulate --character rig.npz --garment coat.obj --motion *.npz --out captures/coat
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct SimulateArgs {
    /// Character: a character.npz, glTF, FBX or USD file, a model, a folder with a character.npz, or
    /// the built-in `human`.
    #[arg(long, value_name = "FILE|FOLDER|human", default_value = "human")]
    pub(crate) character: PathBuf,
    /// Name of the body in a character file of several skinned meshes [default: the only one].
    #[arg(long, value_name = "NAME")]
    pub(crate) body: Option<String>,
    /// Garment: an .obj file, a folder with garment.obj and optionally garment.npz, or a built-in
    /// one: tshirt, skirt, pleated_dress, tulle_skirt, robe.
    #[arg(long, value_name = "FILE.obj|FOLDER|NAME", default_value = "tshirt")]
    pub(crate) garment: PathBuf,
    /// Length of a unit of the garment's .obj in metres: 0.01 for centimetres, 0.001 for millimetres
    /// [default: 1].
    #[arg(long, value_name = "METRES", value_parser = parse::scale)]
    pub(crate) scale: Option<f32>,
    /// Axis that points up in the garment's .obj [default: y].
    #[arg(long, value_enum)]
    pub(crate) garment_up: Option<MeshUpName>,
    /// Motions: .npz, .bvh, glTF, FBX or USD files, or built-in ones by name: idle, walk_speeds,
    /// walk_circles, walk_slalom, walk_starts_stops, run_speeds, run_circles, run_slalom, run_starts_stops,
    /// squats_jumps, arms_trunk, mixed, sprint_stop, turn_on_spot, dance [default: all built-in
    /// ones].
    #[arg(long, value_name = "FILE|NAME", num_args = 1..)]
    pub(crate) motion: Vec<PathBuf>,
    /// Folder of the capture to write.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Fabric of the whole garment [default: cotton, or the built-in garment's own fabrics].
    #[arg(long, value_enum)]
    pub(crate) material: Option<MaterialName>,
    /// Names of the clips held out for evaluation [default: the last of several motions, or
    /// sprint_stop, turn_on_spot and dance of the built-in ones].
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) test: Vec<String>,
    /// Names of the clips on which training measures its error on unseen motion [default: none].
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) validation: Vec<String>,
    /// Joints that touch the ground, by name or by index from 0: left ankle, left foot, right
    /// ankle, right foot [default: found by the names of the joints].
    #[arg(long, value_name = "L,L,R,R", value_parser = parse::contacts)]
    pub(crate) contacts: Option<[JointReference; 4]>,
    /// Frame rate of the capture, from 1 to 1000 frames per second.
    #[arg(long, value_name = "FPS", default_value_t = 30.0, value_parser = parse::frame_rate)]
    pub(crate) fps: f32,
    /// Length of each motion to use, in seconds from its start [default: the whole motion].
    #[arg(long, value_name = "S", value_parser = parse::seconds)]
    pub(crate) seconds: Option<f32>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Velocity of a steady wind, in m/s along X, Y and Z [default: the motion file's wind, else
    /// none].
    // The first number may be negative, which clap would else take for an option.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    pub(crate) wind: Option<glam::Vec3>,
    /// Simulate every training motion once more in a steady wind of this speed, in m/s from 0 to
    /// 50, each from another direction [default: no additional clips].
    #[arg(long, value_name = "M/S", value_parser = parse::speed)]
    pub(crate) breeze: Option<f32>,
    /// Solver steps per frame, from 1 to 1000 [default: 20].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) substeps: Option<u32>,
    /// Distance kept between cloth and body, in mm from 0 to 50 [default: the material's].
    #[arg(long, value_name = "MM", value_parser = parse::thickness)]
    pub(crate) thickness: Option<f32>,
    /// Collision of the cloth with itself.
    #[arg(long, value_enum, default_value_t = Switch::On)]
    pub(crate) self_collision: Switch,
    /// Folder for pictures: one PNG strip per clip [default: no pictures].
    #[arg(long, value_name = "DIR")]
    pub(crate) pictures: Option<PathBuf>,
    /// Continue the interrupted simulation in the folder of --out.
    #[arg(long, conflicts_with = "overwrite")]
    pub(crate) resume: bool,
    /// Replace the capture in the folder of --out, and existing pictures.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print one JSON object about the result to stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
