//! Options of `unic bench`.

use super::{ControlArgs, IntersectionName, MotionArgs, NetworkName, PrecisionName, parse, warn_if_slow};
use crate::{checks::ForceArgs, limits};
use std::{num::NonZeroUsize, path::PathBuf, time::Duration};
use unic_builtin::scale;
use unic_core::Precision;

/// Channels of the published field, whose products take most of a frame.
const WIDTH: usize = 256;

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
///   unic bench --all
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
    /// Motion of the model: npz, BVH, glTF, FBX or USD, or a built-in one by its name, such as dance.
    /// Its first 10 s count.
    #[arg(long, value_name = "FILE|NAME", requires = "model")]
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
    /// Measure random weights in all published sizes and precisions, on one thread and on all. It
    /// takes minutes; the selection without it takes less than 90 seconds.
    #[arg(long, conflicts_with = "model")]
    pub(crate) all: bool,
    /// Numbers of vertices of garments with random weights [default: 3653,62461; with --all
    /// 3653,34907,59380,62461].
    #[arg(long, value_name = "N,...", value_delimiter = ',',
        value_parser = clap::value_parser!(u64).range(1..=limits::most_vertices()))]
    vertices: Vec<u64>,
    /// Sizes of networks with random weights.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [NetworkName::Standard, NetworkName::Paper])]
    pub(crate) network: Vec<NetworkName>,
    /// Number formats of the networks [default: f32 and the fastest one of this processor; all with
    /// --all or --model].
    #[arg(long, value_enum, value_delimiter = ',')]
    precision: Vec<PrecisionName>,
    /// Numbers of threads to measure with [default: --threads; with --all or --model 1 too].
    #[arg(long, value_name = "N,...", value_delimiter = ',', value_parser = parse::threads)]
    on_threads: Vec<NonZeroUsize>,
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

impl BenchArgs {
    /// Numbers of vertices of garments with random weights.
    pub(crate) fn vertices(&self) -> Vec<u64> {
        let all = scale::VERTICES.map(|count| count as u64);
        match (self.vertices.as_slice(), self.all, all) {
            ([], true, all) => all.into(),
            ([], false, [least, .., most]) => vec![least, most],
            (named, ..) => named.into(),
        }
    }

    /// Number formats of the networks.
    pub(crate) fn precisions(&self) -> Vec<PrecisionName> {
        let [fastest, ..] = Precision::fastest_first(WIDTH);
        match (self.precision.as_slice(), self.is_complete()) {
            ([], true) => PrecisionName::ALL.into(),
            ([], false) => {
                let is_shown =
                    |name: &PrecisionName| [Precision::F32, fastest].contains(&Precision::from(*name));
                PrecisionName::ALL.into_iter().filter(is_shown).collect()
            }
            (named, _) => named.into(),
        }
    }

    /// Numbers of threads.
    pub(crate) fn thread_counts(&self) -> Vec<usize> {
        match (self.on_threads.as_slice(), rayon::current_num_threads()) {
            ([], all) if self.is_complete() && all > 1 => vec![1, all],
            ([], all) => vec![all],
            (named, _) => named.iter().map(|count| count.get()).collect(),
        }
    }

    /// Whether all precisions and numbers of threads are measured. A trained model has few cases.
    fn is_complete(&self) -> bool {
        self.all || self.model.is_some()
    }

    /// Warns once about each named precision that is slower than f32.
    pub(crate) fn warn(&self) {
        self.precision.iter().for_each(|name| warn_if_slow(*name, WIDTH));
    }
}

/// Benchmarks beside that of frames.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum OtherBench {
    Control(ControlArgs),
}
