//! Reading and writing models by name.

use crate::args::IntersectionName;
use anyhow::{Result, anyhow};
use std::{fs, path::Path};
use unic_core::{
    config::{Corrects, IntersectionMode},
    model::Model,
};
use unic_eval::CodeCertainty;

/// Reads a model.
pub(crate) fn read(path: &Path) -> Result<Model> {
    let failed = |e: &dyn std::fmt::Display| anyhow!("{}: {e}", path.display());
    unic_io::refuse_foreign(path, "a model (.unic)")?;
    if path.is_dir() {
        return Err(failed(&"expected a model (.unic), found a folder"));
    }
    let bytes = fs::read(path).map_err(|e| failed(&format!("cannot read the model: {e}")))?;
    Model::from_bytes(&bytes).map_err(|e| failed(&e))
}

/// Writes a model, atomically; its size in bytes.
pub(crate) fn write(path: &Path, model: &Model) -> Result<usize> {
    let bytes = model.to_bytes().map_err(|e| anyhow!("{}: {e}", path.display()))?;
    unic_io::atomic::write(path, &bytes)?;
    Ok(bytes.len())
}

/// The handling of a name, with the model's own distance where it has one, else the usual one.
pub(crate) fn intersection(model: &Model, name: IntersectionName) -> IntersectionMode {
    let own = model.config().intersection;
    match (name, own) {
        (IntersectionName::Paper, IntersectionMode::Paper { .. })
        | (IntersectionName::Robust, IntersectionMode::Robust { .. }) => own,
        _ => usual_intersection(name),
    }
}

/// The handling of a name with the usual distance.
pub(crate) fn usual_intersection(name: IntersectionName) -> IntersectionMode {
    match name {
        IntersectionName::Off => IntersectionMode::Off,
        IntersectionName::Paper => IntersectionMode::Paper {
            relaxation_m: IntersectionMode::RELAXATION_M,
        },
        IntersectionName::Robust => IntersectionMode::Robust {
            margin_m: IntersectionMode::MARGIN_M,
            corrects: Corrects::Display,
        },
    }
}

/// How far the training motions decided the model's code, where its file tells.
pub(crate) fn code_certainty(model: &Model) -> Option<String> {
    let told = model.about().training["code"].clone();
    let measured: CodeCertainty = serde_json::from_value(told).ok()?;
    Some(format!("{measured}, on training motion"))
}
