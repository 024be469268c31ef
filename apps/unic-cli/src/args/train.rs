//! Options of `unic train`.

use super::{PresetName, ProcessorName, parse};
use crate::checks::ForceArgs;
use std::{path::PathBuf, time::Duration};

/// Train a model on a capture.
///
/// A capture is a folder with a character, a garment and clips. A clip is one motion with the
/// garment's vertex positions in every frame.
///
/// A preset is a named set of training settings; docs/reference/settings.md lists them. Presets
/// `standard` and `tiny` first fit a prior, which predicts the garment's coarse shape from the
/// motion. A network, the field, then learns to correct it. Preset `paper`, the published method,
/// has no prior.
///
/// The run folder beside the model (tshirt.run for tshirt.unic) holds the settings (config.toml),
/// the training curves (metrics.jsonl), checkpoints and a log. Ctrl-C saves a checkpoint. --resume
/// continues from it and ends with the same model as an uninterrupted run.
///
/// If the capture names no validation clips, `standard` and `tiny` train twice: first without one
/// clip, which then measures the error on unseen motion, then on all clips. The second fit is the
/// model. Preset `paper` holds nothing out and trains for 300 epochs unless --steps is given.
///
/// Errors on clips are those of free running: the model starts from frame 0 of a clip and then sees
/// the character's poses alone.
///
/// Examples:
///   unic train captures/tshirt --preset tiny
///   unic train captures/tshirt --budget 45m --seed 2 --out models/tshirt.unic
///   unic train captures/tshirt --set batch.windows=64 --set optimiser.learning_rate=5e-4
///   unic train captures/tshirt --out models/tshirt.unic --resume
///   unic train captures/tshirt --view
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub struct TrainArgs {
    /// Folder of the capture.
    pub capture: PathBuf,
    /// Preset to start from [default: standard].
    // Without a default value, so that --resume can distinguish a named preset from none.
    #[arg(long, value_enum)]
    pub preset: Option<PresetName>,
    /// Settings file in TOML, such as the config.toml of another run; the preset supplies settings
    /// that the file lacks.
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// One setting by its dotted key, such as optimiser.steps=500; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Seed of all random numbers [default: 1, or the seed in --config].
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Number of optimiser steps of each fit [default: the preset's].
    #[arg(long, value_name = "N")]
    pub steps: Option<u64>,
    /// Wall-clock time of the training, such as 90s, 45m or 1h 30m, which replaces --steps; with a
    /// prior, optimiser.steps remains the upper limit.
    #[arg(long, value_name = "TIME", value_parser = parse::budget, conflicts_with = "steps")]
    pub budget: Option<Duration>,
    /// Processor that computes losses and gradients; --resume may change it.
    #[arg(long, value_enum, default_value_t)]
    pub device: ProcessorName,
    /// Model file to write [default: the capture's name with the ending .unic, in the working
    /// folder].
    #[arg(long, value_name = "FILE.unic")]
    pub out: Option<PathBuf>,
    /// Continue the run whose folder is beside the model.
    #[arg(long, conflicts_with_all = ["overwrite", "budget"])]
    pub resume: bool,
    /// Discard the run whose folder is beside the model, and replace the model.
    #[arg(long)]
    pub overwrite: bool,
    /// Show the model on a clip that is held out, in a window, at each validation. Closing the
    /// window does not stop the training.
    // Without the viewer the option does not exist and is off.
    #[cfg_attr(feature = "viewer", arg(long))]
    #[cfg_attr(not(feature = "viewer"), arg(skip))]
    pub view: bool,
    /// Treatment of plausible mistakes in the capture.
    #[command(flatten)]
    pub force: ForceArgs,
    /// Print one JSON object about the result to stdout.
    #[arg(long)]
    pub json: bool,
}
