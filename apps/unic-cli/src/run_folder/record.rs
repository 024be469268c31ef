//! Record of the capture and preset that a run began with, `run.toml`.

use anyhow::{Result, anyhow, bail};
use serde::{Deserialize, Serialize};
use std::{fs, path::Path, time::Duration};
use unic_io::{Capture, Split, atomic};

/// Capture and preset of a run as they were when it began.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RunRecord {
    /// Name of the preset.
    pub(crate) preset: String,
    /// Name of the capture.
    pub(crate) capture: String,
    /// Frames per second.
    pub(crate) fps: f32,
    /// Joints of the character.
    pub(crate) joints: usize,
    /// Vertices of the garment.
    pub(crate) vertices: usize,
    /// Training clips with their numbers of frames, in the order of the capture.
    // The order matters: the seed draws the clip that is held out by its index.
    pub(crate) train: Vec<String>,
    /// Validation clips with their numbers of frames, in the order of the capture.
    pub(crate) validation: Vec<String>,
    /// Time for the whole run, in seconds, until its steps are planned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) budget_s: Option<f64>,
}

impl RunRecord {
    /// Creates the record of a capture. Reads the headers of its training and validation clips.
    ///
    /// # Errors
    /// A clip that cannot be read.
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
            budget_s: None,
        })
    }

    /// Time for the run. `None` if its steps are planned.
    pub(crate) fn budget(&self) -> Option<Duration> {
        self.budget_s.and_then(|s| Duration::try_from_secs_f64(s).ok())
    }

    /// Record without a budget, once its steps are planned. `None` if it has no budget.
    pub(crate) fn planned(mut self) -> Option<Self> {
        self.budget_s.take().map(|_| self)
    }

    pub(super) fn read(path: &Path) -> Result<Self> {
        let text = fs::read_to_string(path).map_err(|e| anyhow!("{}: cannot read: {e}", path.display()))?;
        toml::from_str(&text).map_err(|e| anyhow!("{}: {e}", path.display()))
    }

    pub(super) fn write(&self, path: &Path) -> Result<()> {
        Ok(atomic::write(path, toml::to_string(self)?.as_bytes())?)
    }

    /// Compares the record with `now`, that of the capture at `path`.
    ///
    /// # Errors
    /// The first property of the capture that differs.
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
        // The preset is compared elsewhere: a resumed run need not name it again.
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
