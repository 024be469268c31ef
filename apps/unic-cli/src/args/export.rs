//! Options of `unic export`.

use crate::checks::ForceArgs;
use std::path::PathBuf;

/// Write a model in a form that engines run without code of this project.
///
/// --onnx writes a folder of ONNX graphs:
///   start.onnx      poses of the first two frames to the state and positions of the first one
///   tick.onnx       pose and state to positions and the next state, once a tick
///   motion.onnx, skinning.onnx, encoder.onnx, prior.onnx, field.onnx   the stages of a tick
///   mesh.bin        arrays of the garment that the graphs read, faces, texture coordinates
///   model.json      joint order, units, inputs and outputs, and what the graphs leave out
///
/// The graphs end where the networks end: the strain projection, the replay and the intersection
/// handling of unic animate are left out. The number of vertices is free.
///
/// Examples:
///   unic export tshirt.unic --onnx tshirt_onnx
///   unic export tshirt.unic --mesh tshirt_coarse.obj --onnx tshirt_coarse_onnx
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ExportArgs {
    /// Model file (.unic).
    pub(crate) model: PathBuf,
    /// Folder of ONNX graphs to write.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) onnx: PathBuf,
    /// Other mesh of the same garment, in the same rest space [default: the model's mesh].
    #[arg(long, value_name = "OTHER.obj")]
    pub(crate) mesh: Option<PathBuf>,
    /// Replace existing files of the folder.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print one JSON object about the result to stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
