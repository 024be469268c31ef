//! Reading and writing models by name.

use anyhow::{Result, anyhow};
use std::{fs, path::Path};
use unic_core::{config::IntersectionMode, model::Model};

/// Reads a model.
pub(crate) fn read(path: &Path) -> Result<Model> {
    let failed = |e: &dyn std::fmt::Display| anyhow!("{}: {e}", path.display());
    let bytes = fs::read(path).map_err(|e| failed(&format!("cannot read the model: {e}")))?;
    Model::from_bytes(&bytes).map_err(|e| failed(&e))
}

/// Writes a model, atomically; its size in bytes.
pub(crate) fn write(path: &Path, model: &Model) -> Result<usize> {
    let bytes = model.to_bytes().map_err(|e| anyhow!("{}: {e}", path.display()))?;
    unic_io::atomic::write(path, &bytes)?;
    Ok(bytes.len())
}

/// r of the paper, metres, for models that were trained without intersection handling.
const RELAXATION_M: f32 = 0.005;

/// The paper's handling with the model's own distance where it has one.
pub(crate) fn paper_intersection(model: &Model) -> IntersectionMode {
    match model.config().intersection {
        IntersectionMode::Off => IntersectionMode::Paper {
            relaxation_m: RELAXATION_M,
        },
        own => own,
    }
}
