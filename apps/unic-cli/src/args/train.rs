//! `unic train`.

use super::{PresetName, ProcessorName, parse};
use crate::checks::ForceArgs;
use std::{path::PathBuf, time::Duration};

/// Train a model on a capture.
///
/// Beside the model lies the run's folder (tshirt.run for tshirt.unic): settings in config.toml,
/// curves in metrics.jsonl, checkpoints, log.txt. Ctrl-C saves a checkpoint; --resume goes on from
/// it to the same result as if nothing had happened.
///
/// Without validation clips in the capture, one training clip is held out to measure the error on
/// unseen motion; then the model is trained once more on all clips (validation.refit). Preset paper
/// holds nothing out and trains for 300 epochs of the capture, unless --steps says otherwise.
///
/// Examples:
///   unic train captures/tshirt --preset tiny
///   unic train captures/tshirt --budget 45m --seed 2 --out models/tshirt.unic
///   unic train captures/tshirt --set batch.windows=64 --set optimiser.learning_rate=5e-4
///   unic train captures/tshirt --out models/tshirt.unic --resume
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct TrainArgs {
    /// Folder of the capture.
    pub(crate) capture: PathBuf,
    /// Settings to start from [default: standard].
    #[arg(long, value_enum)]
    pub(crate) preset: Option<PresetName>,
    /// Settings in TOML. Those that the file leaves out are the preset's; config.toml of any run will do.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) config: Option<PathBuf>,
    /// One setting by its dotted key; repeat at will.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Seed of everything random.
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// Optimiser steps of each fit.
    #[arg(long, value_name = "N")]
    pub(crate) steps: Option<u64>,
    /// Wall-clock time instead: as many steps as this machine makes in e.g. 90s, 45m or 1h 30m. With a prior
    /// optimiser.steps are enough, and the most.
    #[arg(long, value_name = "TIME", value_parser = parse::budget, conflicts_with = "steps")]
    pub(crate) budget: Option<Duration>,
    /// What computes losses and gradients. A run goes on on any.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) device: ProcessorName,
    /// The model to write [default: the capture's name, in the working folder].
    #[arg(long, value_name = "FILE.unic")]
    pub(crate) out: Option<PathBuf>,
    /// Go on with the run beside the model.
    #[arg(long, conflicts_with_all = ["overwrite", "budget"])]
    pub(crate) resume: bool,
    /// Throw away the run that is beside the model.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print one JSON object about the result on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
