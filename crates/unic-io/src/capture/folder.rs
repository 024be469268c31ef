//! Classification of folders that are not complete captures.

use super::own_files::{MANIFEST, UNFINISHED};
use std::path::Path;

/// Content of a path that is no complete capture, as far as the names of its files show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FolderKind {
    /// A simulation that is not finished.
    UnfinishedSimulation,
    /// Clips with a character or a garment, and no manifest.
    CaptureWithoutManifest,
    /// A run folder of `unic train`.
    TrainingRun,
    /// A folder of `unic demo`.
    Demo,
    /// A folder with `character.npz`.
    Character,
    /// A folder with `garment.obj`.
    Garment,
    /// No folder of this name.
    Missing,
    /// A file.
    File,
    /// A folder with none of the project's files.
    Other,
}

impl FolderKind {
    /// Classifies `folder`, which has no manifest.
    pub(crate) fn of(folder: &Path) -> Self {
        let has = |name: &str| folder.join(name).exists();
        // The first match counts: an unfinished simulation also has clips and a character.
        if has(UNFINISHED) {
            Self::UnfinishedSimulation
        } else if has("clips") && (has("character.npz") || has("garment.obj")) {
            Self::CaptureWithoutManifest
        } else if has("config.toml") && has("checkpoints") {
            Self::TrainingRun
        } else if has("demo.toml") {
            Self::Demo
        } else if has("character.npz") {
            Self::Character
        } else if has("garment.obj") {
            Self::Garment
        } else if !folder.exists() {
            Self::Missing
        } else if folder.is_file() {
            Self::File
        } else {
            Self::Other
        }
    }

    /// Returns a description for error messages, with the next step if there is one.
    pub(crate) fn description(self) -> String {
        let text = match self {
            Self::UnfinishedSimulation => {
                "a simulation that is not finished: the same `unic simulate` with --resume goes on"
            }
            Self::CaptureWithoutManifest => {
                "a capture without its capture.toml: write one, as docs/reference/capture.md describes"
            }
            Self::TrainingRun => "the run folder of a training: its model lies beside it",
            Self::Demo => "the folder of a demo: its capture is in capture/ below it",
            Self::Character => "a folder with a character, for `unic simulate --character`",
            Self::Garment => "a folder with a garment, for `unic simulate --garment`",
            Self::Missing => "no such folder",
            Self::File => "a file",
            Self::Other => return format!("a folder without {MANIFEST}"),
        };
        text.to_owned()
    }
}
