//! Options of `unic eval`.

use super::{CodeArgs, IntersectionName, PrecisionArgs, ProtocolName, SplitName};
use crate::checks::ForceArgs;
use std::{num::NonZeroUsize, path::PathBuf};

/// Measure the errors of a model beside those of simple methods, the baselines.
///
/// A capture is a folder with a character, a garment and clips. A clip is one motion with the
/// garment's simulated vertex positions in every frame. Each row of the result is one method that
/// predicts the garment of the test clips; errors are distances from the simulation in millimetres.
///
/// Every row is measured in one or both of these modes:
///   free running    starts from frame 0 of the clip and then sees the character's poses alone;
///                   models are used in this way, so this is the number to compare
///   one step        predicts every frame from the true frame before it
///
/// Rows whose names need an explanation:
///   skinning        the rest shape, carried by the character's skeleton
///   hold            the true previous frame, moved rigidly along with the character
///   ridge           ridge regression, a linear map from the motion to the garment's shape
///   ridge_handled   the same with the model's intersection handling, which moves garment vertices
///                   that are inside the body out of it
///   prior           the model's prior: the coarse shape that the model predicts from the motion
///                   before its network, the field, corrects it
///
/// Free running is also measured by its life: wrinkles by wavelength, with the living ratio (how
/// much they come and go, by the simulation's), strain of edges, bending and popping. A judge is
/// trained on half of the clips to tell rows from the simulation by one second of them: 50 % is
/// chance.
///
/// The result names the clips that training has seen.
///
/// --protocol measures as publications on a data set do: in free running, and with `vto` over 300
/// frames. --as first converts a folder of the data set to a capture, for which --character gives
/// the body and skeleton of the data set.
///
/// Examples:
///   unic eval --baselines captures/tshirt
///   unic eval --baselines captures/tshirt --intersection robust
///   unic eval --baselines vto/tshirt --protocol vto --character smpl.npz --as captures/vto
///   unic eval vto.unic captures/vto --protocol vto
///   unic eval tshirt.unic captures/tshirt
///   unic eval tshirt.unic captures/tshirt --pictures worst --json > numbers.json
///   unic eval tshirt.unic captures/tshirt --report tshirt.html
// `allow_missing_positional`: a single path, as with --baselines, is the capture and not the model.
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment, allow_missing_positional = true)]
pub(crate) struct EvalArgs {
    /// Model file (.unic).
    #[arg(required_unless_present = "baselines", conflicts_with = "baselines")]
    pub(crate) model: Option<PathBuf>,
    /// Folder of the capture; with --as, folder of the data set.
    #[arg(required = true)]
    pub(crate) capture: PathBuf,
    /// Measure the baselines alone, without a model.
    #[arg(long)]
    pub(crate) baselines: bool,
    /// Published protocol to measure by, named after its data set [default: all metrics in both
    /// modes].
    #[arg(long, value_enum)]
    pub(crate) protocol: Option<ProtocolName>,
    /// Folder of the capture to make from the data set.
    #[arg(long = "as", value_name = "CAPTURE", requires_all = ["protocol", "character"])]
    pub(crate) made: Option<PathBuf>,
    /// Body and skeleton of the data set: an npz, glTF, FBX or USD file, a model, or a folder that
    /// holds a character.npz.
    #[arg(long, value_name = "FILE", requires = "made")]
    pub(crate) character: Option<PathBuf>,
    /// Split of the capture to measure on.
    #[arg(long, value_enum, default_value_t = SplitName::Test)]
    pub(crate) split: SplitName,
    /// Names of the clips to measure on, of any split [default: all clips of --split].
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        conflicts_with = "split"
    )]
    pub(crate) clips: Vec<String>,
    /// Intersection handling of the model and of the row `ridge_handled` [default: the model's own;
    /// off with --baselines].
    #[arg(long, value_enum)]
    pub(crate) intersection: Option<IntersectionName>,
    /// Folder of a second simulation of the same clips, whose garment starts from another history.
    /// It becomes the row `control`: how far the cloth is from itself, and how often the judge of
    /// the result tells the two apart [default: no control].
    #[arg(long, value_name = "CAPTURE")]
    pub(crate) control: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) precision: PrecisionArgs,
    #[command(flatten)]
    pub(crate) code: CodeArgs,
    /// Measure intersections with the body and the Hausdorff distance, which are slow, in every Nth
    /// frame only.
    #[arg(long, value_name = "N", default_value = "1")]
    pub(crate) nearest_every: NonZeroUsize,
    /// Folder for all predicted positions: one .npz file per clip [default: not written].
    #[arg(long, value_name = "DIR")]
    pub(crate) dump: Option<PathBuf>,
    /// Folder for pictures of the model's worst frames in free running: one PNG per clip [default:
    /// no pictures].
    #[arg(long, value_name = "DIR", conflicts_with = "baselines")]
    pub(crate) pictures: Option<PathBuf>,
    /// HTML page to write, with movies, error maps, curves and all numbers [default: not written].
    #[arg(long, value_name = "FILE.html", conflicts_with = "baselines")]
    pub(crate) report: Option<PathBuf>,
    /// GIF file to write, with the first movie of --report [default: not written].
    #[arg(long, value_name = "FILE.gif", requires = "report")]
    pub(crate) movie: Option<PathBuf>,
    /// Replace existing files of --dump, --pictures, --report and --movie.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print the numbers as one JSON object to stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
