//! `unic bench`.

use super::{IntersectionName, MotionArgs, NetworkName, PrecisionName, parse};
use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

/// Measure how fast this machine animates.
///
/// Without a model: random weights in the sizes of the presets on garments of the sizes that the field
/// publishes; times do not depend on what weights say. With a model and a motion: its own times, and
/// by how much each precision and sampling moves its vertices, against f32 at all vertices.
///
/// A frame is motion vector, encoder, field, skinning, intersection handling and normals. `forward`
/// is the networks alone, the mean of five runs, as the paper counts.
///
/// Examples:
///   unic bench
///   unic bench --vertices 3653 --network paper --precision f32,bf16 --json
///   unic bench --model tshirt.unic --motion walk.npz --sampling 100,50,25
///   unic bench --model tshirt.unic --motion walk.npz --precision bf16 --budget 4ms --out fast.unic
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct BenchArgs {
    /// A trained model (.unic) instead of random ones.
    #[arg(long, value_name = "FILE.unic", requires = "motion", conflicts_with_all = ["vertices", "network"])]
    pub(crate) model: Option<PathBuf>,
    /// What it moves in: npz or BVH; its first 10 s count.
    #[arg(long, value_name = "FILE.npz|FILE.bvh", requires = "model")]
    pub(crate) motion: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Another mesh of the model's garment, in the same rest space.
    #[arg(long, value_name = "OTHER.obj", requires = "model")]
    pub(crate) mesh: Option<PathBuf>,
    /// Percent of the vertices that the state lives on; the others are interpolated.
    #[arg(long, value_name = "PERCENT,...", value_delimiter = ',', value_parser = parse::percent, default_values_t = [100.0])]
    pub(crate) sampling: Vec<f32>,
    /// Choose the largest sampling whose frames take no longer, on all threads, e.g. 4ms.
    #[arg(long, value_name = "TIME", value_parser = parse::budget, requires = "model", conflicts_with = "sampling")]
    pub(crate) budget: Option<Duration>,
    /// Write the model with the sampling that the budget has chosen.
    #[arg(long, value_name = "FILE.unic", requires = "budget")]
    pub(crate) out: Option<PathBuf>,
    /// Sizes of garments.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = unic_builtin::scale::VERTICES)]
    pub(crate) vertices: Vec<usize>,
    /// Sizes of networks.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [NetworkName::Standard, NetworkName::Paper])]
    pub(crate) network: Vec<NetworkName>,
    /// What the networks calculate in.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = PrecisionName::ALL)]
    pub(crate) precision: Vec<PrecisionName>,
    /// Numbers of threads to measure with [default: 1, and --threads].
    #[arg(long, value_name = "N,...", value_delimiter = ',')]
    pub(crate) on_threads: Vec<NonZeroUsize>,
    /// What becomes of vertices inside the body [default: the paper's way, or the model's own].
    #[arg(long, value_enum)]
    pub(crate) intersection: Option<IntersectionName>,
    /// Most frames that a median is over; large garments stop after two seconds.
    #[arg(long, value_name = "N", default_value = "200")]
    pub(crate) frames: NonZeroUsize,
    /// Print the numbers as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
