//! `unic animate`.

use super::{CodeArgs, IntersectionName, MotionArgs, parse};
use crate::checks::ForceArgs;
use std::{ops::Range, path::PathBuf};

/// Animate a garment on a motion.
///
/// The motion is an npz file with poses and trans, as AMASS and captures have it, or a BVH file of
/// any skeleton; it is resampled to the model's frame rate. A .glb (binary glTF, at most 300 frames)
/// has body and garment in one file. Otherwise the body goes beside the garment (walk.body.pc2 for
/// walk.pc2); for .pc2, walk.obj and walk.body.obj are the meshes that the caches belong to. A picture
/// (walk.png) comes with all of them.
///
/// Examples:
///   unic animate tshirt.unic --motion walk.npz --out walk.pc2
///   unic animate tshirt.unic --motion walk.bvh --frames 0..300 --out walk.glb
///   unic animate tshirt.unic --motion amass/run.npz --up z --frames 60..240 --out frames
///   unic animate tshirt.unic --motion walk.npz --mesh tshirt_fine.obj --out walk_fine.npz
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct AnimateArgs {
    /// The model (.unic).
    pub(crate) model: PathBuf,
    /// The motion: npz with poses (T, 3J), trans (T, 3) and a frame rate, or BVH of any skeleton.
    #[arg(long, value_name = "FILE.npz|FILE.bvh")]
    pub(crate) motion: PathBuf,
    /// The animation: .glb, .pc2, .npz, or a folder of OBJ files.
    #[arg(long, value_name = "FILE.glb|FILE.pc2|FILE.npz|FOLDER")]
    pub(crate) out: PathBuf,
    /// Another mesh of the same garment, in the same rest space.
    #[arg(long, value_name = "OTHER.obj")]
    pub(crate) mesh: Option<PathBuf>,
    /// Where the picture goes [default: beside the animation].
    #[arg(long, value_name = "FILE.png")]
    pub(crate) picture: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// What becomes of vertices inside the body [default: as the model was trained for].
    #[arg(long, value_enum)]
    pub(crate) intersection: Option<IntersectionName>,
    #[command(flatten)]
    pub(crate) code: CodeArgs,
    /// The garment at the first frame, in world space: .obj, or the first frame of a .pc2, a .npy or
    /// an npz (a capture's clip) [default: the mean shape of training].
    #[arg(long, value_name = "FILE")]
    pub(crate) start: Option<PathBuf>,
    /// Wind, m/s [default: the motion file's own, else still air]. A model knows wind as far as it
    /// knows motion: it cannot tell the one from the other.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    pub(crate) wind: Option<glam::Vec3>,
    /// Only these frames of the motion, counted from 0 at the model's frame rate, the last one
    /// excluded; the garment starts at the first of them.
    #[arg(long, value_name = "A..B", value_parser = parse::frames)]
    pub(crate) frames: Option<Range<usize>>,
    /// Replace files that are there already; a folder is never replaced.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print one JSON object about the result on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
