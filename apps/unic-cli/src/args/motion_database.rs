//! Options of `unic motion-database`.

use super::{CharacterArgs, ClipArgs};
use crate::checks::ForceArgs;
use std::path::PathBuf;

/// Make a motion database for interactive control, and write it to a file.
///
/// A database holds the frames of clips with what is needed to find the frame that continues a pose
/// and follows a command. Every clip is also stored mirrored, if the joints have counterparts.
///
/// Examples:
///   unic motion-database --out walks.unicmotn
///   unic motion-database --motion clips/*.npz --character body.npz --exclude jump --out my.unicmotn
///   unic bench control --database my.unicmotn --character body.npz
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct MotionDatabaseArgs {
    #[command(flatten)]
    pub(crate) clips: ClipArgs,
    #[command(flatten)]
    pub(crate) character: CharacterArgs,
    /// Motion database to write.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Replace an existing file.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    /// Print one JSON object about the result to stdout.
    #[arg(long)]
    pub(crate) json: bool,
}
