//! Options of `unic animate`.

use super::{CodeArgs, IntersectionName, MotionArgs, PrecisionArgs, parse};
use crate::checks::ForceArgs;
use std::{ops::Range, path::PathBuf};

/// Animate a garment on a motion.
///
/// The motion is an .npz file with poses and translations, as in AMASS, or a BVH, glTF, FBX or USD
/// file of any skeleton. Clips of a capture (the folder that a model is trained on) are such .npz files. The
/// motion is resampled to the model's frame rate.
///
/// The ending of --out chooses the format:
///   walk.glb        body and garment in one binary glTF file, for at most 300 frames
///   walk.abc        body and garment in one Alembic file, for any number of frames
///   walk.usdc       body and garment in one USD file, for any number of frames; .usda is its text
///   walk.pc2        point caches walk.pc2, walk.body.pc2 of the meshes walk.obj, walk.body.obj
///   walk.mdd        the same with point caches of MDD
///   walk.npz        arrays of positions and faces in walk.npz and walk.body.npz
///   walk            one OBJ file per frame in the folders walk and walk_body
/// All formats come with a picture of some frames, walk.png.
///
/// The model starts from the mean shape of training (or --start) and then sees the motion alone.
/// Intersection handling moves garment vertices that are inside the body out of it. Wind acts on
/// the model like motion through still air: results are good at air speeds seen in training.
///
/// Examples:
///   unic animate tshirt.unic --motion walk.npz --out walk.pc2
///   unic animate tshirt.unic --motion dance --out dance.glb
///   unic animate tshirt.unic --motion walk.bvh --frames 0..300 --out walk.glb
///   unic animate tshirt.unic --motion amass/run.npz --up z --frames 60..240 --out frames
///   unic animate tshirt.unic --motion walk.npz --mesh tshirt_fine.obj --out walk_fine.npz
///   unic animate tshirt.unic --motion walk.npz --out walk.abc --vat walk.exr
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct AnimateArgs {
    /// Model file (.unic).
    pub(crate) model: PathBuf,
    /// Motion file: .npz with poses (T, 3J), trans (T, 3) and a frame rate, or BVH, glTF, FBX or USD
    /// of any skeleton. Or the name of a built-in motion, such as dance. The help of `unic simulate`
    /// lists them.
    #[arg(long, value_name = "FILE|NAME")]
    pub(crate) motion: PathBuf,
    /// Animation to write: a .glb, .abc, .usdc, .usda, .pc2, .mdd or .npz file, or a folder of OBJ
    /// files.
    #[arg(long, value_name = "FILE|FOLDER")]
    pub(crate) out: PathBuf,
    /// Other mesh of the same garment to animate, in the same rest space [default: the model's
    /// mesh].
    #[arg(long, value_name = "OTHER.obj")]
    pub(crate) mesh: Option<PathBuf>,
    /// Picture to write [default: the path of --out with the ending .png].
    #[arg(long, value_name = "FILE.png")]
    pub(crate) picture: Option<PathBuf>,
    /// Vertex animation texture to write beside --out, for engines that play it with a shader alone:
    /// positions in metres (.exr) or as 16-bit numbers (.png), with normals (.normals.png), a mesh
    /// (.vat.glb) and a description (.vat.json).
    #[arg(long, value_name = "FILE.exr|FILE.png")]
    pub(crate) vat: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Intersection handling [default: the model's own].
    #[arg(long, value_enum)]
    pub(crate) intersection: Option<IntersectionName>,
    #[command(flatten)]
    pub(crate) precision: PrecisionArgs,
    #[command(flatten)]
    pub(crate) code: CodeArgs,
    /// Garment in the first frame, in world space and metres: an .obj file, or the first frame of a
    /// .pc2, .mdd, .abc, USD, .npy or .npz file [default: the mean shape of the training clips].
    #[arg(long, value_name = "FILE")]
    pub(crate) start: Option<PathBuf>,
    /// Velocity of a steady wind, in m/s along X, Y and Z [default: the motion file's wind, else
    /// none].
    // The first number may be negative, which clap would else take for an option.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    pub(crate) wind: Option<glam::Vec3>,
    /// Range of frames to animate, A included and B excluded, counted from 0 at the model's frame
    /// rate [default: all].
    #[arg(long, value_name = "A..B", value_parser = parse::frames)]
    pub(crate) frames: Option<Range<usize>>,
    /// Replace existing files; folders are never replaced.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print one JSON object about the result to stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
