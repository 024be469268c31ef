//! `unic inspect`.

use super::MotionArgs;
use std::path::PathBuf;

/// Say what a file or folder holds, and what is wrong with it.
///
/// Knows captures, characters, motions, meshes, vertex animations, numpy arrays and models. The
/// exit code is 1 where something is wrong.
///
/// With --coverage it says how much of a motion lies within what a capture has seen, and what the
/// capture lacks.
///
/// Examples:
///   unic inspect captures/tshirt
///   unic inspect walk.bvh --json
///   unic inspect --coverage captures/tshirt cartwheel.bvh
///   unic inspect --coverage captures/tshirt            its test clips by its training clips
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct InspectArgs {
    /// The file or folder; with --coverage any number of motions [default: the capture's test clips].
    #[arg(required_unless_present = "coverage")]
    pub(crate) path: Vec<PathBuf>,
    /// Compare motions with the training clips of this capture.
    #[arg(long, value_name = "CAPTURE")]
    pub(crate) coverage: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// With --coverage: go on with input that is probably a mistake; what was found is said all the same.
    #[arg(long, requires = "coverage")]
    pub(crate) force: bool,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
