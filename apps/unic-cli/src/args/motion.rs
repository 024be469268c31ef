//! Options about reading motion files, shared by several commands.

use super::{UpName, parse};
use std::{num::NonZeroUsize, path::PathBuf};
use unic_io::LowPass;

// The heading is set on each option: `next_help_heading` would also hold for the options that
// follow in the commands.
const HEADING: &str = "Motion files";

/// Options for reading motion files.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct MotionArgs {
    /// Axis that points up in motion files that do not state it.
    #[arg(long, help_heading = HEADING, value_enum, default_value_t = UpName::Auto)]
    pub(crate) up: UpName,
    /// TOML table of joint names, for files whose joint names are not recognised.
    #[arg(long, help_heading = HEADING, value_name = "FILE.toml")]
    pub(crate) bone_map: Option<PathBuf>,
    /// Cutoff of a low-pass filter on the motion, in Hz, or 0 for no filter [default: 10 for motion of
    /// another skeleton, 0 for others].
    #[arg(long, help_heading = HEADING, value_name = "HZ", value_parser = parse::low_pass)]
    pub(crate) low_pass: Option<LowPass>,
    /// Number of times to repeat the best cycle of a short motion, with blended ends [default: the
    /// motion as it is].
    #[arg(long, help_heading = HEADING, value_name = "TIMES")]
    pub(crate) repeat: Option<NonZeroUsize>,
}
