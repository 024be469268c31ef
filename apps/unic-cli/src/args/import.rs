//! Options of `unic import`.

use super::{MeshUpName, UpName, parse};
use crate::checks::ForceArgs;
use std::{ops::Range, path::PathBuf};
use unic_io::{Assumed, LowPass, Up, capture::JointReference, rigged::CharacterOptions};

/// Import a garment animation from another program as a clip of a capture.
///
/// The garment's animation, the character and its motion become one clip of the capture in the
/// folder of --out: a new capture, or one with the same character and garment. A capture is in
/// metres, Y up. Each conversion is printed.
///
/// The rest shape defines the rest lengths of the cloth, in the character's rest pose. It comes
/// from --rest, else from the capture, else from the first frame of the animation, if its file has
/// faces. That frame is moved back to the rest pose and keeps its wrinkles.
///
/// A body without a rig, animated with the garment, gets the joints of --motion, and skinning
/// weights that are fitted to it.
///
/// A folder of Marvelous Designer or CLO with `deformation/*.obj` and `animation.fbx` brings the
/// garment, the character and the motion of a clip that is named like the folder. If the motion
/// has joints alone, the body is that of `motion/*.obj`. A folder of such folders brings a clip of
/// each; those that the capture has already are left out.
///
/// Garment and motion start together, unless --offset is given. The clip ends with the shorter one.
///
/// Examples:
///   unic import --garment walk.pc2 --rest coat.obj --character body.npz --motion walk.npz
///     --out captures/coat
///   unic import --garment run.pc2 --motion run.bvh --test run --out captures/coat
///   unic import --garment frames --up z --scale 0.01 --fps 24 --character body.npz
///     --motion dance.bvh --out captures/skirt
///   unic import --garment sequence_01 --scale 0.001 --fps 30 --out captures/coat
#[derive(Clone, Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ImportArgs {
    /// Files as they were typed.
    #[command(flatten)]
    pub(crate) files: ImportFiles,
    /// Animation of the garment.
    #[arg(skip)]
    pub(crate) garment: PathBuf,
    /// Character, unless it is that of the capture.
    #[arg(skip)]
    pub(crate) character: Option<PathBuf>,
    /// Motion of the character.
    #[arg(skip)]
    pub(crate) motion: PathBuf,
    /// Name of the garment in a file of several meshes [default: the only one that has not as many
    /// vertices as the character].
    #[arg(long, value_name = "NAME")]
    pub(crate) object: Option<String>,
    /// Name of the body in a character file of several meshes [default: the only one that is skinned, or
    /// the one called body of an animation without a rig].
    #[arg(long, value_name = "NAME")]
    pub(crate) body: Option<String>,
    /// Folder of the capture to make, or to add a clip to.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Rest shape of the garment, with the vertex order of the animation [default: that of the
    /// capture in --out, else the first frame].
    #[arg(long, value_name = "FILE.obj")]
    pub(crate) rest: Option<PathBuf>,
    /// Axis that points up in files that do not state it [default: y for meshes, the axis that the
    /// trunk follows for motion].
    #[arg(long, value_enum)]
    pub(crate) up: Option<MeshUpName>,
    /// Axis that points up in the motion file [default: that of --up].
    #[arg(long, value_enum, value_name = "UP")]
    pub(crate) motion_up: Option<UpName>,
    /// Length of a unit in metres, 0.01 for centimetres, of garment files and of USD files that do not
    /// state it [default: 1 for garments; 0.01, the format's own, for USD]. Motion files are in metres
    /// (npz) or scaled to the character (BVH).
    #[arg(long, value_name = "METRES", value_parser = parse::scale)]
    pub(crate) scale: Option<f32>,
    /// Frames per second of files that do not state them [default: those of the capture in --out,
    /// else those that the other file states].
    #[arg(long, value_name = "FPS", value_parser = parse::frame_rate)]
    pub(crate) fps: Option<f32>,
    /// Name of the clip [default: that of the motion's file].
    #[arg(long, value_name = "NAME")]
    pub(crate) clip: Option<String>,
    /// Range of frames to import, A included and B excluded, counted from frame 0 of the motion at
    /// the garment's frame rate [default: all that garment and motion have].
    #[arg(long, value_name = "A..B", value_parser = parse::frames)]
    pub(crate) frames: Option<Range<usize>>,
    /// Frame of the garment that belongs to frame 0 of the motion, as after a preroll. Negative if
    /// the motion starts first.
    #[arg(long, value_name = "N", default_value_t = 0, allow_hyphen_values = true)]
    pub(crate) offset: i64,
    /// Names of clips of the capture that are held out for evaluation.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) test: Vec<String>,
    /// Source and licence of the files, which travel into models [default: the names of the files].
    #[arg(long, value_name = "TEXT")]
    pub(crate) provenance: Option<String>,
    /// Joints of a new capture that touch the ground, by name or by index from 0: left ankle, left
    /// foot, right ankle, right foot [default: found by the names of the joints].
    #[arg(long, value_name = "L,L,R,R", value_parser = parse::contacts)]
    pub(crate) contacts: Option<[JointReference; 4]>,
    /// TOML table of joint names, for files whose joint names are not recognised.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) bone_map: Option<PathBuf>,
    /// Cutoff of a low-pass filter on the motion, in Hz, or 0 for no filter [default: 0, because the
    /// garment follows the motion as it is].
    #[arg(long, value_name = "HZ", value_parser = parse::low_pass)]
    pub(crate) low_pass: Option<LowPass>,
    /// Replace a clip of the same name.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print one JSON object about the result to stdout.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Files of an import as they are typed. A folder of a sequence brings more than one.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ImportFiles {
    /// Animation of the garment: a .abc, .usd, .usdc, .usda, .usdz, .pc2, .mdd, .npz or .npy file, a
    /// folder of OBJ files, a folder with `deformation/*.obj` and `animation.fbx`, or a folder of those.
    #[arg(long, value_name = "FILE|FOLDER")]
    pub(crate) garment: PathBuf,
    /// Motion of the character: an .npz, .bvh, glTF, FBX or USD file [default: the FBX or BVH file
    /// of the garment's folder].
    #[arg(long, value_name = "FILE")]
    pub(crate) motion: Option<PathBuf>,
    /// Character: a character.npz, glTF, FBX or USD file, a model, or the animation of a body without a
    /// rig, in the formats of --garment [default: that of the capture in --out, else that of the garment's folder].
    #[arg(long, value_name = "FILE")]
    pub(crate) character: Option<PathBuf>,
}

impl ImportArgs {
    /// Statements about the character's file that it does not make itself.
    pub(crate) fn character_options(&self) -> CharacterOptions<'_> {
        CharacterOptions {
            assumed: self.assumed(),
            body: self.body.as_deref(),
        }
    }

    /// Unit, axis and rate of files that do not state them.
    pub(crate) fn assumed(&self) -> Assumed {
        Assumed {
            metres_per_unit: self.scale,
            up: self.up.map(|up| match up {
                MeshUpName::Y => Up::Y,
                MeshUpName::Z => Up::Z,
            }),
            fps: self.fps,
        }
    }
}
