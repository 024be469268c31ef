//! Options of `unic bench`.

use super::{ControlArgs, IntersectionName, MotionArgs, NetworkName, PrecisionName, parse};
use crate::{checks::ForceArgs, limits};
use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

/// Measure how fast this machine animates.
///
/// Without a model it measures random weights, in the sizes of the presets and on garments of
/// published sizes. Trained weights are faster in f32, because more of their activations are zero.
/// With a model and a motion it measures that model. It also measures how far each precision and
/// sampling moves the vertices from f32 at all vertices.
///
/// A frame is motion vector, encoder, field, skinning, intersection handling and normals. `forward`
/// is the networks alone: the mean of five runs, as in the paper.
///
/// Examples:
///   unic bench
///   unic bench --vertices 3653 --network paper --precision f32,bf16 --json
///   unic bench --model tshirt.unic --motion walk.npz --sampling 100,50,25
///   unic bench --model tshirt.unic --motion walk.npz --precision bf16 --budget 4ms --out fast.unic
///   unic bench control
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment, args_conflicts_with_subcommands = true)]
pub(crate) struct BenchArgs {
    /// Another benchmark than that of frames.
    #[command(subcommand)]
    pub(crate) other: Option<OtherBench>,
    /// Trained model to measure (.unic) [default: random weights].
    #[arg(long, value_name = "FILE.unic", requires = "motion", conflicts_with_all = ["vertices", "network"])]
    pub(crate) model: Option<PathBuf>,
    /// Motion of the model, npz or BVH. Its first 10 s count.
    #[arg(long, value_name = "FILE.npz|FILE.bvh", requires = "model")]
    pub(crate) motion: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Another mesh of the model's garment, in the same rest space.
    #[arg(long, value_name = "OTHER.obj", requires = "model")]
    pub(crate) mesh: Option<PathBuf>,
    /// Percent of the vertices that are simulated by the model. The others are interpolated.
    #[arg(long, value_name = "PERCENT,...", value_delimiter = ',', value_parser = parse::percent, default_values_t = [100.0])]
    pub(crate) sampling: Vec<f32>,
    /// Choose the largest sampling whose frames take no longer than this on all threads, e.g. 4ms.
    #[arg(long, value_name = "TIME", value_parser = parse::budget, requires = "model", conflicts_with = "sampling")]
    pub(crate) budget: Option<Duration>,
    /// Write the model with the chosen sampling.
    #[arg(long, value_name = "FILE.unic", requires = "budget")]
    pub(crate) out: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long, requires = "out")]
    pub(crate) overwrite: bool,
    /// Numbers of vertices of garments with random weights.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = unic_builtin::scale::VERTICES.map(|n| n as u64),
        value_parser = clap::value_parser!(u64).range(1..=limits::most_vertices()))]
    pub(crate) vertices: Vec<u64>,
    /// Sizes of networks with random weights.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [NetworkName::Standard, NetworkName::Paper])]
    pub(crate) network: Vec<NetworkName>,
    /// Number formats of the networks.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = PrecisionName::ALL)]
    pub(crate) precision: Vec<PrecisionName>,
    /// Numbers of threads to measure with [default: 1, and --threads].
    #[arg(long, value_name = "N,...", value_delimiter = ',', value_parser = parse::threads)]
    pub(crate) on_threads: Vec<NonZeroUsize>,
    /// Handling of vertices inside the body [default: the paper's for random weights, otherwise the
    /// model's own].
    #[arg(long, value_enum)]
    pub(crate) intersection: Option<IntersectionName>,
    /// Largest number of frames for a median. A case ends after two seconds, but not before seven
    /// frames.
    #[arg(long, value_name = "N", default_value = "200")]
    pub(crate) frames: NonZeroUsize,
    /// Number of instances that share a model, to measure the time and memory of each. 0 measures
    /// none.
    #[arg(long, value_name = "N", default_value = "16")]
    pub(crate) instances: usize,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print the numbers as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Benchmarks beside that of frames.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum OtherBench {
    Control(ControlArgs),
}
