//! What a resumed run must find again.

use anyhow::{Result, anyhow, bail};
use serde::{Deserialize, Serialize};
use std::{fs, path::Path};
use unic_io::{Capture, Split, atomic};

/// The capture as it was when the run began, and the preset by name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RunRecord {
    /// Name of the preset that the settings began with.
    pub(crate) preset: String,
    /// Name of the capture.
    pub(crate) capture: String,
    /// Frames per second.
    pub(crate) fps: f32,
    /// Joints of the character.
    pub(crate) joints: usize,
    /// Vertices of the garment.
    pub(crate) vertices: usize,
    /// Training clips with their frames, in the capture's order: the seed draws from it.
    pub(crate) train: Vec<String>,
    /// Validation clips likewise.
    pub(crate) validation: Vec<String>,
}

impl RunRecord {
    /// Reads the headers of the training and validation clips.
    pub(crate) fn new(capture: &Capture, preset: String) -> Result<Self> {
        let clip = |name: &String| {
            let frames = capture.summarise_clip(name)?.pose_frames;
            Ok(format!("{name}: {frames} frames"))
        };
        let clips = |split| capture.clip_names(split).iter().map(clip).collect::<Result<_>>();
        Ok(Self {
            preset,
            capture: capture.manifest.name.clone(),
            fps: capture.manifest.fps,
            joints: capture.character.skeleton.len(),
            vertices: capture.garment.rest.vertices.len(),
            train: clips(Split::Train)?,
            validation: clips(Split::Validation)?,
        })
    }

    pub(super) fn read(path: &Path) -> Result<Self> {
        let text = fs::read_to_string(path).map_err(|e| anyhow!("{}: cannot read: {e}", path.display()))?;
        toml::from_str(&text).map_err(|e| anyhow!("{}: {e}", path.display()))
    }

    pub(super) fn write(&self, path: &Path) -> Result<()> {
        Ok(atomic::write(path, toml::to_string(self)?.as_bytes())?)
    }

    /// Errors unless `now`, the capture at `path`, is the one that the run began with.
    pub(crate) fn check(&self, now: &Self, path: &Path) -> Result<()> {
        let parts = [
            ("name", self.capture.clone(), now.capture.clone()),
            ("frames per second", self.fps.to_string(), now.fps.to_string()),
            ("joints", self.joints.to_string(), now.joints.to_string()),
            (
                "garment vertices",
                self.vertices.to_string(),
                now.vertices.to_string(),
            ),
            ("training clips", self.train.join(", "), now.train.join(", ")),
            (
                "validation clips",
                self.validation.join(", "),
                now.validation.join(", "),
            ),
        ];
        match parts.into_iter().find(|(_, old, new)| old != new) {
            None => Ok(()),
            Some((what, old, new)) => {
                bail!(
                    "{}: expected the capture that the run began with ({what}: {old}), found {new}",
                    path.display()
                )
            }
        }
    }
}
