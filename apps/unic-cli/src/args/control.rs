//! Options of `unic bench control`.

use super::{MotionArgs, parse};
use crate::checks::ForceArgs;
use std::path::PathBuf;

/// Measure how well a character follows commands, by motion matching.
///
/// Scripted inputs steer it: a circle, a figure 8, a square, a slalom, reversals, starts and stops,
/// and a mouse that jumps about. The metrics stand beside their targets. The same motion, seed and
/// settings give the same poses on every run.
///
/// Examples:
///   unic bench control
///   unic bench control --motion clips/*.npz --character body.npz --exclude jump,crouch --json
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ControlArgs {
    /// Motions of the database, npz or BVH [default: built-in clips].
    #[arg(long, value_name = "FILE.npz|FILE.bvh", num_args = 1..)]
    pub(crate) motion: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Character that the motions are read for [default: the built-in human].
    #[arg(long, value_name = "FILE.npz", requires = "motion")]
    pub(crate) character: Option<PathBuf>,
    /// Words in the names of clips that are never played. Upper and lower case are the same.
    #[arg(long, value_name = "WORD,...", value_delimiter = ',', requires = "motion")]
    pub(crate) exclude: Vec<String>,
    /// Setting from quality (0: motion as captured) to responsiveness (1: commands at once).
    #[arg(long, value_name = "SHARE", value_parser = parse::share, default_value_t = 0.5)]
    pub(crate) responsiveness: f32,
    /// Seed of the random mouse.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print the numbers as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
