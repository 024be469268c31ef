//! Options about motion files.

use super::{UpName, parse};
use std::{num::NonZeroUsize, path::PathBuf};
use unic_io::LowPass;

/// How motion files are read.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Motion files")]
pub(crate) struct MotionArgs {
    /// Which axis points up in the motion file.
    #[arg(long, value_enum, default_value_t = UpName::Auto)]
    pub(crate) up: UpName,
    /// Joints of a BVH file whose names do not tell what they are (TOML).
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) bone_map: Option<PathBuf>,
    /// Take out what is faster than this many Hz; 0 takes out nothing [default: 10 for BVH].
    #[arg(long, value_name = "HZ", value_parser = parse::low_pass)]
    pub(crate) low_pass: Option<LowPass>,
    /// Repeat the best cycle of a short motion this often, ends blended.
    #[arg(long, value_name = "TIMES")]
    pub(crate) repeat: Option<NonZeroUsize>,
}
