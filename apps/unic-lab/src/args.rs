//! Options and arguments of the commands, as clap parses them. The doc comments are the help texts.

use clap::{Parser, Subcommand};
use std::{path::PathBuf, time::Duration};
use unic_cli::{
    args::{IntersectionName, ThreadArgs, parse},
    checks::ForceArgs,
};

/// Benchmarks for research with unic: accuracy of training settings, and behaviour in long use.
#[derive(Debug, Parser)]
#[command(name = "unic-lab", version, verbatim_doc_comment, max_term_width = 100)]
pub(crate) struct Args {
    #[command(flatten)]
    pub(crate) threads: ThreadArgs,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Commands of `unic-lab`.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Accuracy(AccuracyArgs),
    Lasting(LastingArgs),
    Pretrain(PretrainArgs),
    Wardrobe(WardrobeArgs),
}

/// Train rows of settings under equal budgets and measure them beside all baselines.
///
/// A row is a settings file over a preset. --rows takes names of built-in rows and paths of your
/// own files. Rows are measured on test clips, so that each capture needs some. Training uses all
/// other clips. Results stay in --out: a benchmark that was stopped goes on with what is missing.
///
/// Examples:
///   unic-lab accuracy captures/tshirt captures/skirt --budget 5m
///   unic-lab accuracy captures/tshirt --rows standard,mine.toml --seeds 1 --budget 90s
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct AccuracyArgs {
    /// Folders of captures.
    #[arg(required_unless_present = "list")]
    pub(crate) captures: Vec<PathBuf>,
    /// Folder of models and results.
    #[arg(long, value_name = "DIR", default_value = "accuracy")]
    pub(crate) out: PathBuf,
    /// Rows to train: names of built-in rows, or settings files [default: all built-in rows].
    #[arg(long, value_name = "ROW,...", value_delimiter = ',')]
    pub(crate) rows: Vec<String>,
    /// Longest wall-clock time of each training.
    #[arg(long, value_name = "TIME", value_parser = parse::budget, default_value = "5m")]
    pub(crate) budget: Duration,
    /// Optimiser steps of each training, instead of a time.
    #[arg(long, value_name = "N", conflicts_with = "budget")]
    pub(crate) steps: Option<u64>,
    /// Seeds. Each row is trained once for each.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = [1, 2, 3])]
    pub(crate) seeds: Vec<u64>,
    /// List the built-in rows and exit.
    #[arg(long)]
    pub(crate) list: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print the results as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Train the unit that the recurrences of `standard` start from.
///
/// The captures show one human in the same motion, each in another garment, with clips of the same
/// names. One unit predicts the shapes of all garments. Its last map is left out of the file.
///
/// Example:
///   unic-lab pretrain shirt skirt --out crates/unic-train/src/recurrence/pretrained.safetensors
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct PretrainArgs {
    /// Folders of captures.
    #[arg(required = true)]
    pub(crate) captures: Vec<PathBuf>,
    /// File to write (.safetensors).
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Seed of the training.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Replace the file.
    #[arg(long)]
    pub(crate) overwrite: bool,
}

/// Write the garments that `pretrain` learns from, each as a folder for `unic simulate --garment`.
///
/// Example:
///   unic-lab wardrobe wardrobe && unic simulate --garment wardrobe/long_skirt --out long_skirt
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct WardrobeArgs {
    /// Folder to write.
    pub(crate) out: PathBuf,
    /// Replace files.
    #[arg(long)]
    pub(crate) overwrite: bool,
}

/// Measure a model in long use: drift, random motion, standing still, stops, disturbances.
///
/// Everything runs free, and each number is printed beside its target. docs/lab/lasting.md defines
/// the measures. A capture with minutes of motion takes about 40,000 frames.
///
/// Examples:
///   unic-lab lasting tshirt.unic captures/tshirt
///   unic-lab lasting tshirt.unic captures/tshirt --intersection off --json > lasting.json
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct LastingArgs {
    /// Model to measure (.unic).
    pub(crate) model: PathBuf,
    /// Folder of the capture.
    pub(crate) capture: PathBuf,
    /// Seed of the random motion.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Number of frames of the random motion.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(..=1_000_000))]
    pub(crate) frames: u32,
    /// Handling of vertices inside the body [default: as the model was trained for].
    #[arg(long, value_enum)]
    pub(crate) intersection: Option<IntersectionName>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print the results as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
