//! `unic bench`.

use super::{IntersectionName, MotionArgs, NetworkName, PrecisionName, parse};
use crate::{checks::ForceArgs, limits};
use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

/// Measure how fast this machine animates.
///
/// Without a model: random weights in the sizes of the presets on garments of the sizes that the field
/// publishes; trained weights, which leave more channels off, are faster in f32. With a model and a
/// motion: its own times, and by how much each precision and sampling moves its vertices, against f32
/// at all vertices.
///
/// A frame is motion vector, encoder, field, skinning, intersection handling and normals. `forward`
/// is the networks alone, the mean of five runs, as the paper counts.
///
/// The subcommands measure how right models are, and how long they stay so.
///
/// Examples:
///   unic bench
///   unic bench --vertices 3653 --network paper --precision f32,bf16 --json
///   unic bench --model tshirt.unic --motion walk.npz --sampling 100,50,25
///   unic bench --model tshirt.unic --motion walk.npz --precision bf16 --budget 4ms --out fast.unic
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment, args_conflicts_with_subcommands = true)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    pub(crate) command: Option<Bench>,
    #[command(flatten)]
    pub(crate) speed: SpeedArgs,
}

#[derive(Debug, clap::Subcommand)]
pub(crate) enum Bench {
    Accuracy(AccuracyArgs),
    Lasting(LastingArgs),
}

/// What is measured without a subcommand.
#[derive(Debug, clap::Args)]
pub(crate) struct SpeedArgs {
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
    /// Replace the model that is there already.
    #[arg(long, requires = "out")]
    pub(crate) overwrite: bool,
    /// Sizes of garments.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = unic_builtin::scale::VERTICES.map(|n| n as u64),
        value_parser = clap::value_parser!(u64).range(1..=limits::most_vertices()))]
    pub(crate) vertices: Vec<u64>,
    /// Sizes of networks.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [NetworkName::Standard, NetworkName::Paper])]
    pub(crate) network: Vec<NetworkName>,
    /// What the networks calculate in.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = PrecisionName::ALL)]
    pub(crate) precision: Vec<PrecisionName>,
    /// Numbers of threads to measure with [default: 1, and --threads].
    #[arg(long, value_name = "N,...", value_delimiter = ',', value_parser = parse::threads)]
    pub(crate) on_threads: Vec<NonZeroUsize>,
    /// What becomes of vertices inside the body [default: the paper's way, or the model's own].
    #[arg(long, value_enum)]
    pub(crate) intersection: Option<IntersectionName>,
    /// Most frames that a median is over; large garments stop after two seconds. Cases are over the same frames where
    /// none takes that long.
    #[arg(long, value_name = "N", default_value = "200")]
    pub(crate) frames: NonZeroUsize,
    /// Instances that share the model, for the time and the memory of each of many; 0 for none.
    #[arg(long, value_name = "N", default_value = "16")]
    pub(crate) instances: usize,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print the numbers as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Train and measure rows of settings under equal budgets, beside all baselines.
///
/// Each row is a settings file over a preset; --rows takes built-in ones by name, or your own files.
/// Test clips measure it, and captures need some; what a preset holds out of its first fit is back in its
/// second. What is done stays in --out, so that a stopped benchmark goes on where it was.
///
/// Examples:
///   unic bench accuracy captures/tshirt captures/skirt --budget 5m
///   unic bench accuracy captures/tshirt --rows standard,mine.toml --seeds 1 --budget 90s
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct AccuracyArgs {
    /// Folders of captures.
    #[arg(required_unless_present = "list")]
    pub(crate) captures: Vec<PathBuf>,
    /// Folder of models and results.
    #[arg(long, value_name = "DIR", default_value = "accuracy")]
    pub(crate) out: PathBuf,
    /// Rows: names of built-in ones or settings files [default: all built-in ones].
    #[arg(long, value_name = "ROW,...", value_delimiter = ',')]
    pub(crate) rows: Vec<String>,
    /// Wall-clock time of each training, at most.
    #[arg(long, value_name = "TIME", value_parser = parse::budget, default_value = "5m")]
    pub(crate) budget: Duration,
    /// Optimiser steps of each training instead.
    #[arg(long, value_name = "N", conflicts_with = "budget")]
    pub(crate) steps: Option<u64>,
    /// Seeds: each row is trained once for each.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = [1, 2, 3])]
    pub(crate) seeds: Vec<u64>,
    /// List the built-in rows and end.
    #[arg(long)]
    pub(crate) list: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print the results as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Measure how a model holds out: drift, random motion, standing still, liveliness, stops, disturbances.
///
/// Everything runs free, and each number is printed beside its target; docs/accuracy.md defines them. On a
/// capture with minutes of motion it takes some 40,000 frames.
///
/// Examples:
///   unic bench lasting tshirt.unic captures/tshirt
///   unic bench lasting tshirt.unic captures/tshirt --intersection off --json > lasting.json
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct LastingArgs {
    /// The model (.unic).
    pub(crate) model: PathBuf,
    /// Folder of the capture.
    pub(crate) capture: PathBuf,
    /// Seed of the random motion.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Frames of the random motion.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(..=1_000_000))]
    pub(crate) frames: u32,
    /// What becomes of vertices inside the body [default: as the model was trained for].
    #[arg(long, value_enum)]
    pub(crate) intersection: Option<IntersectionName>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print the results as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
