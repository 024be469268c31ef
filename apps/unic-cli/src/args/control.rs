//! Options of `unic bench control`.

use super::{CharacterArgs, MotionSourceArgs, parse};
use crate::checks::ForceArgs;
use std::path::PathBuf;

/// Measure how well a character follows commands, by motion matching.
///
/// Scripted inputs steer it: a circle, a figure 8, a square, a slalom, reversals, starts and stops,
/// and a mouse that jumps about. The metrics stand beside their targets. The same motion, seed and
/// settings give the same poses on every run.
///
/// --write-motion keeps the motion of every script, to simulate garments in it. One more script is
/// in it, a stick that is moved at random to speeds of up to 2 m/s.
///
/// Examples:
///   unic bench control
///   unic bench control --motion clips/*.npz --character body.npz --exclude jump,crouch --json
///   unic bench control --database my.unicmotn --character body.npz
///   unic bench control --seed 3 --write-motion steered
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ControlArgs {
    #[command(flatten)]
    pub(crate) source: MotionSourceArgs,
    #[command(flatten)]
    pub(crate) character: CharacterArgs,
    /// Setting from quality (0: motion as captured) to responsiveness (1: commands at once).
    #[arg(long, value_name = "SHARE", value_parser = parse::share, default_value_t = 0.5)]
    pub(crate) responsiveness: f32,
    /// Seed of the random mouse and of the random stick.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Folder for the character's motion: SCRIPT_SEED.npz for each script.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) write_motion: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long, requires = "write_motion")]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print the numbers as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
