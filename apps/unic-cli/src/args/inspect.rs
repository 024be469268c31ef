//! Options of `unic inspect`.

use super::MotionArgs;
use std::path::PathBuf;

/// Show what a file or folder holds, and report problems.
///
/// Reads captures, characters, motions, meshes, vertex animations, numpy arrays and models. A
/// capture is a folder with a character, a garment and clips. A clip is one motion with the
/// garment's vertex positions in every frame. The exit code is 1 if there is a problem.
///
/// --coverage compares motions with the training clips of a capture, frame by frame. It reports the
/// share of frames that resemble a training frame, and the kinds of motion that the capture lacks.
/// Expect larger errors of a trained model in frames that resemble none.
///
/// Examples:
///   unic inspect captures/tshirt
///   unic inspect walk.bvh --json
///   unic inspect --coverage captures/tshirt cartwheel.bvh
///   unic inspect --coverage captures/tshirt            compares its own test clips
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct InspectArgs {
    /// File or folder to inspect; with --coverage, any number of motions, files or built-in ones by
    /// name [default: the test clips of the capture].
    #[arg(required_unless_present = "coverage")]
    pub(crate) path: Vec<PathBuf>,
    /// Folder of the capture whose training clips the motions are compared with.
    #[arg(long, value_name = "CAPTURE")]
    pub(crate) coverage: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Continue --coverage with input that is probably a mistake, and print what was found.
    #[arg(long, requires = "coverage")]
    pub(crate) force: bool,
    /// Print one JSON object to stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
