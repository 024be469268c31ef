//! `unic bench`.

use super::{IntersectionName, parse};
use std::{path::PathBuf, time::Duration};

/// Benchmarks of this program on this machine.
#[derive(Debug, clap::Args)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    pub(crate) bench: Bench,
}

#[derive(Debug, clap::Subcommand)]
pub(crate) enum Bench {
    Accuracy(AccuracyArgs),
    Lasting(LastingArgs),
}

/// Train and measure rows of settings under equal budgets, beside all baselines.
///
/// Each row is a settings file over a preset; --rows takes built-in ones by name, or your own files.
/// Nothing is held out of a row's training: captures need test clips. What is done stays in --out, so
/// that a stopped benchmark goes on where it was.
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
    /// Wall-clock time of each training.
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
    /// Print the results as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
