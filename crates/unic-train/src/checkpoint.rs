//! Checkpoints: everything that a training continues from, in one safetensors file.

use crate::error::TrainError;
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
};

/// State of a training between two steps, with the training's own record `R`.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint<R> {
    /// Position of the training.
    pub position: Position,
    /// Description of the training, by which a resumed run knows its own.
    pub record: R,
    /// Named groups of tensors ("parameters", "first_moments", "average", ...), each in the order
    /// of the network's parameters.
    pub groups: Vec<(String, Vec<Vec<f32>>)>,
}

/// Position of a training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Position {
    /// Number of steps done.
    pub step: u64,
    /// Seconds of steps and measurements so far, over all resumes.
    pub seconds: f64,
    /// A measurement is due after this step and has been interrupted.
    pub measurement_is_due: bool,
}

/// The JSON text in a checkpoint's metadata.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Metadata<R> {
    position: Position,
    record: R,
}

const METADATA_KEY: &str = "unic_checkpoint";

/// Checkpoints that stay on disk: the newest, and the one before in case of a damaged disk.
const KEPT: usize = 2;

impl<R> Checkpoint<R> {
    /// One group of tensors.
    pub fn group(&self, name: &str) -> Option<&Vec<Vec<f32>>> {
        self.groups
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, tensors)| tensors)
    }
}

impl<R: Serialize> Checkpoint<R> {
    /// Writes `folder/step-00001234.safetensors` under a temporary name, syncs and renames it, and
    /// removes checkpoints older than the previous one.
    ///
    /// # Errors
    /// The folder cannot be written to; older checkpoints stay.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, TrainError> {
        // Zero-padded, so that names sort by step.
        let path = folder.join(format!("step-{:08}.safetensors", self.position.step));
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

    fn to_bytes(&self) -> Result<Vec<u8>, String> {
        let named = self.groups.iter().flat_map(|(group, tensors)| {
            tensors
                .iter()
                .enumerate()
                // Three digits: sorted by name, tensors keep their order.
                .map(move |(i, tensor)| (format!("{group}.{i:03}"), tensor))
        });
        let views: Result<Vec<_>, _> = named
            .map(|(name, values)| {
                let bytes = bytemuck::cast_slice(values);
                TensorView::new(Dtype::F32, vec![values.len()], bytes).map(|view| (name, view))
            })
            .collect();
        let metadata = Metadata {
            position: self.position,
            record: &self.record,
        };
        let metadata = serde_json::to_string(&metadata).map_err(|e| e.to_string())?;
        let metadata = HashMap::from([(METADATA_KEY.to_owned(), metadata)]);
        let views = views.map_err(|e| e.to_string())?;
        safetensors::serialize(views, Some(metadata)).map_err(|e| e.to_string())
    }
}

impl<R: DeserializeOwned> Checkpoint<R> {
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

    fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|e| e.to_string())?;
        let text = header.metadata().as_ref().and_then(|m| m.get(METADATA_KEY));
        let text = text.ok_or("a safetensors file of something else")?;
        let Metadata { position, record } = serde_json::from_str(text).map_err(|e| e.to_string())?;
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
                // The bytes of a tensor in the file need not be aligned for f32.
                .map(bytemuck::pod_read_unaligned)
                .collect();
            match groups.last_mut().filter(|(last, _)| last == group) {
                Some((_, tensors)) => tensors.push(values),
                None => groups.push((group.to_owned(), vec![values])),
            }
        }
        Ok(Self {
            position,
            record,
            groups,
        })
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

    fn checkpoint(step: u64) -> Checkpoint<String> {
        Checkpoint {
            position: Position {
                step,
                seconds: 1.25,
                measurement_is_due: true,
            },
            record: "a training".into(),
            groups: vec![
                ("average".into(), vec![vec![1.0, -2.5], vec![f32::MIN_POSITIVE]]),
                ("parameters".into(), (0..12).map(|i| vec![i as f32; 3]).collect()),
            ],
        }
    }

    #[test]
    fn newest_readable_checkpoint_is_read_and_old_ones_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        assert!(Checkpoint::<String>::newest(folder.path()).unwrap().is_none());
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
    fn error_names_the_file_if_all_checkpoints_are_damaged() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(
            folder.path().join("step-00000001.safetensors"),
            b"nothing of the kind",
        )
        .unwrap();
        let error = Checkpoint::<String>::newest(folder.path())
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("step-00000001.safetensors") && error.contains("expected"),
            "{error}"
        );
    }
}
