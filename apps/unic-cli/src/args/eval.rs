//! `unic eval`.

use super::{CodeArgs, IntersectionName, ProtocolName, SplitName};
use crate::checks::ForceArgs;
use std::{num::NonZeroUsize, path::PathBuf};

/// Measure a model beside all baselines.
///
/// Every row is measured one-step (each frame from the true one before it) and free-running (from
/// frame 0 alone), which is the one that counts. Lengths are in millimetres. The row `prior` is what
/// the model's prior says on its own, without the network's field; the row `ridge_handled` is ridge regression with the
/// model's handling of intersections. Clips that training has seen are told.
///
/// With --protocol the numbers are those that others publish, on the data sets that they publish them for: free running from
/// frame 0 alone, `vto` over 300 frames. A folder of the data set itself is first made into a capture, to train on
/// and to measure on; it needs a character with the data set's body and skeleton.
///
/// Examples:
///   unic eval --baselines captures/tshirt
///   unic eval --baselines captures/tshirt --intersection robust
///   unic eval --baselines vto/tshirt --protocol vto --character smpl.npz --as captures/vto
///   unic eval vto.unic captures/vto --protocol vto
///   unic eval tshirt.unic captures/tshirt
///   unic eval tshirt.unic captures/tshirt --pictures worst --json > numbers.json
///   unic eval tshirt.unic captures/tshirt --report tshirt.html
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment, allow_missing_positional = true)]
pub(crate) struct EvalArgs {
    /// The model (.unic).
    #[arg(required_unless_present = "baselines", conflicts_with = "baselines")]
    pub(crate) model: Option<PathBuf>,
    /// Folder of the capture.
    #[arg(required = true)]
    pub(crate) capture: PathBuf,
    /// The baselines alone, without a model.
    #[arg(long)]
    pub(crate) baselines: bool,
    /// Measure as a published data set is measured.
    #[arg(long, value_enum)]
    pub(crate) protocol: Option<ProtocolName>,
    /// The capture that a data set's folder becomes.
    #[arg(long = "as", value_name = "CAPTURE", requires_all = ["protocol", "character"])]
    pub(crate) made: Option<PathBuf>,
    /// Body and skeleton of the data set: a character.npz, or a folder with one.
    #[arg(long, value_name = "FILE.npz", requires = "made")]
    pub(crate) character: Option<PathBuf>,
    /// Clips to measure on.
    #[arg(long, value_enum, default_value_t = SplitName::Test)]
    pub(crate) split: SplitName,
    /// Clips to measure on by name, whatever their split.
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        conflicts_with = "split"
    )]
    pub(crate) clips: Vec<String>,
    /// Handling of vertices inside the body, for the model and the row `ridge_handled` [default: as the model
    /// was trained for; with --baselines off].
    #[arg(long, value_enum)]
    pub(crate) intersection: Option<IntersectionName>,
    #[command(flatten)]
    pub(crate) code: CodeArgs,
    /// Look for distances to the body and the Hausdorff distance in every Nth frame alone, which is what takes
    /// long; errors are those of all frames.
    #[arg(long, value_name = "N", default_value = "1")]
    pub(crate) nearest_every: NonZeroUsize,
    /// Keep every predicted position: one npz a clip in this folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) dump: Option<PathBuf>,
    /// Draw the model's worst free-running frames: one PNG a clip in this folder.
    #[arg(long, value_name = "DIR", conflicts_with = "baselines")]
    pub(crate) pictures: Option<PathBuf>,
    /// Write a page with moving pictures, error maps, curves and all numbers: one HTML file that opens offline.
    #[arg(long, value_name = "FILE.html", conflicts_with = "baselines")]
    pub(crate) report: Option<PathBuf>,
    /// Write the page's first moving picture as a GIF, too.
    #[arg(long, value_name = "FILE.gif", requires = "report")]
    pub(crate) movie: Option<PathBuf>,
    /// Replace files that are there already: of --dump, --pictures, --report and --movie.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print the numbers as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
