//! Options that choose the motion of a steered character, shared by several commands.

use super::MotionArgs;
use crate::motion_file;
use std::path::PathBuf;

/// Options for the clips of a motion database.
#[derive(Debug, clap::Args)]
pub(crate) struct ClipArgs {
    /// Motions of the database: npz, BVH, glTF, FBX or USD, or built-in ones by name, such as dance
    /// [default: built-in clips made for control].
    #[arg(long, value_name = "FILE|NAME", num_args = 1..)]
    pub(crate) motion: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Words in the names of clips that are never played. Upper and lower case are the same.
    #[arg(long, value_name = "WORD,...", value_delimiter = ',', requires = "motion")]
    pub(crate) exclude: Vec<String>,
}

/// Options for a motion database: its clips, or its file.
#[derive(Debug, clap::Args)]
pub(crate) struct MotionSourceArgs {
    #[command(flatten)]
    pub(crate) clips: ClipArgs,
    /// Motion database of the character, as `unic motion-database` writes it.
    #[arg(long, value_name = "FILE", conflicts_with = "motion")]
    pub(crate) database: Option<PathBuf>,
}

impl ClipArgs {
    /// Paths of all files that are read.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        motion_file::files(&self.motion).chain(&self.reading.bone_map)
    }
}

impl MotionSourceArgs {
    /// Paths of all files that are read.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.clips.files().chain(&self.database)
    }
}

/// Character that is steered.
#[derive(Debug, clap::Args)]
pub(crate) struct CharacterArgs {
    /// Character of the motions: an npz, glTF, FBX or USD file, or a model [default: the built-in human].
    #[arg(long, value_name = "FILE")]
    pub(crate) character: Option<PathBuf>,
    /// Name of the body in a character file of several skinned meshes [default: the only one].
    #[arg(long, value_name = "NAME", requires = "character")]
    pub(crate) body: Option<String>,
}
