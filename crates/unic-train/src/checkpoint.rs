//! Checkpoints: everything that a run goes on from, in one safetensors file.

use crate::{config::TrainConfig, error::TrainError, fit::Fit};
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use serde::{Deserialize, Serialize};
use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
};

/// The state of a run between two steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Numbers about the run.
    pub progress: Progress,
    /// Named groups of tensors ("parameters", "first_moments", "average", ...), each in the order
    /// of the network's parameters.
    pub groups: Vec<(String, Vec<Vec<f32>>)>,
}

/// What a checkpoint knows beside its tensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Progress {
    /// Which fit of the run it is.
    pub fit: Fit,
    /// Steps done.
    pub step: u64,
    /// Settings of the run.
    pub config: TrainConfig,
    /// Training time of the fit so far, with that of its prior, seconds.
    pub seconds: f64,
    /// The part of it that the prior's fit took.
    #[serde(default)]
    pub prior_seconds: f64,
    /// Smallest free-running error on the validation clips, metres, and its step.
    pub best: Option<(f64, u64)>,
    /// The measurement that is due after this step is still to be made: somebody has stopped it.
    #[serde(default)]
    pub owes_measurement: bool,
}

const METADATA_KEY: &str = "unic_checkpoint";

/// Checkpoints that stay on disk: the newest, and the one before in case of a damaged disk.
const KEPT: usize = 2;

impl Checkpoint {
    /// One group of tensors.
    pub fn group(&self, name: &str) -> Option<&Vec<Vec<f32>>> {
        self.groups
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, tensors)| tensors)
    }

    /// Writes `folder/step-00001234.safetensors` under a temporary name, syncs and renames it, and
    /// removes checkpoints older than the previous one.
    ///
    /// # Errors
    /// The folder cannot be written to; older checkpoints stay.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, TrainError> {
        let path = folder.join(format!("step-{:08}.safetensors", self.progress.step));
        let bytes = self.to_bytes().map_err(|found| TrainError::Checkpoint {
            path: path.clone(),
            found,
        })?;
        unic_io::atomic::write(&path, &bytes)?;
        let mut all = checkpoints(folder);
        all.truncate(all.len().saturating_sub(KEPT));
        for old in all {
            // A checkpoint that cannot be removed is only in the way.
            let _ = fs::remove_file(old);
        }
        Ok(path)
    }

    /// The newest checkpoint of a folder that can be read, if there is one.
    ///
    /// # Errors
    /// There are checkpoints, but none can be read: the newest one's error.
    pub fn newest(folder: &Path) -> Result<Option<Self>, TrainError> {
        let mut first_error = None;
        for path in checkpoints(folder).into_iter().rev() {
            match Self::read(&path) {
                Ok(checkpoint) => return Ok(Some(checkpoint)),
                Err(error) => first_error = first_error.or(Some(error)),
            }
        }
        first_error.map_or(Ok(None), Err)
    }

    fn read(path: &Path) -> Result<Self, TrainError> {
        let wrong = |found: String| TrainError::Checkpoint {
            path: path.to_owned(),
            found,
        };
        let bytes = fs::read(path).map_err(|e| wrong(e.to_string()))?;
        Self::from_bytes(&bytes).map_err(wrong)
    }

    fn to_bytes(&self) -> Result<Vec<u8>, String> {
        let named = self.groups.iter().flat_map(|(group, tensors)| {
            tensors
                .iter()
                .enumerate()
                .map(move |(i, tensor)| (format!("{group}.{i:03}"), tensor))
        });
        let views: Result<Vec<_>, _> = named
            .map(|(name, values)| {
                let bytes = bytemuck::cast_slice(values);
                TensorView::new(Dtype::F32, vec![values.len()], bytes).map(|view| (name, view))
            })
            .collect();
        let progress = serde_json::to_string(&self.progress).map_err(|e| e.to_string())?;
        let metadata = HashMap::from([(METADATA_KEY.to_owned(), progress)]);
        let views = views.map_err(|e| e.to_string())?;
        safetensors::serialize(views, Some(metadata)).map_err(|e| e.to_string())
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|e| e.to_string())?;
        let text = header.metadata().as_ref().and_then(|m| m.get(METADATA_KEY));
        let text = text.ok_or("a safetensors file of something else")?;
        let progress = serde_json::from_str(text).map_err(|e| e.to_string())?;
        let file = SafeTensors::deserialize(bytes).map_err(|e| e.to_string())?;
        let mut names = file.names();
        names.sort_unstable();
        let mut groups: Vec<(String, Vec<Vec<f32>>)> = Vec::new();
        for name in names {
            let (group, _) = name
                .rsplit_once('.')
                .ok_or_else(|| format!("a tensor named {name}"))?;
            let view = file.tensor(name).map_err(|e| e.to_string())?;
            if view.dtype() != Dtype::F32 {
                return Err(format!("tensor {name} of type {:?}", view.dtype()));
            }
            let values = view
                .data()
                .chunks_exact(4)
                .map(bytemuck::pod_read_unaligned)
                .collect();
            match groups.last_mut().filter(|(last, _)| last == group) {
                Some((_, tensors)) => tensors.push(values),
                None => groups.push((group.to_owned(), vec![values])),
            }
        }
        Ok(Self { progress, groups })
    }
}

/// Checkpoints of a folder, oldest first.
fn checkpoints(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| is_checkpoint(path))
        .collect();
    paths.sort();
    paths
}

fn is_checkpoint(path: &Path) -> bool {
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
    name.starts_with("step-") && name.ends_with(".safetensors")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Preset;

    fn checkpoint(step: u64) -> Checkpoint {
        let config = TrainConfig::preset(Preset::Tiny);
        Checkpoint {
            progress: Progress {
                fit: Fit::HeldOut,
                step,
                config,
                seconds: 1.25,
                prior_seconds: 0.5,
                owes_measurement: true,
                best: Some((0.0421, 7)),
            },
            groups: vec![
                ("average".into(), vec![vec![1.0, -2.5], vec![f32::MIN_POSITIVE]]),
                ("parameters".into(), (0..12).map(|i| vec![i as f32; 3]).collect()),
            ],
        }
    }

    #[test]
    fn the_newest_readable_checkpoint_comes_back_and_old_ones_go() {
        let folder = tempfile::tempdir().unwrap();
        assert!(Checkpoint::newest(folder.path()).unwrap().is_none());
        for step in [5, 10, 15] {
            checkpoint(step).write(folder.path()).unwrap();
        }
        assert_eq!(checkpoints(folder.path()).len(), KEPT);
        assert_eq!(Checkpoint::newest(folder.path()).unwrap(), Some(checkpoint(15)));
        let newest = folder.path().join("step-00000015.safetensors");
        let bytes = fs::read(&newest).unwrap();
        fs::write(&newest, &bytes[..bytes.len() - 1]).unwrap();
        assert_eq!(Checkpoint::newest(folder.path()).unwrap(), Some(checkpoint(10)));
    }

    #[test]
    fn damaged_checkpoints_alone_are_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(
            folder.path().join("step-00000001.safetensors"),
            b"nothing of the kind",
        )
        .unwrap();
        let error = Checkpoint::newest(folder.path()).unwrap_err().to_string();
        assert!(
            error.contains("step-00000001.safetensors") && error.contains("expected"),
            "{error}"
        );
    }
}
