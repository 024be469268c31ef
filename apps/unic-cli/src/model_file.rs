//! Reading and writing models by name.

use crate::args::IntersectionName;
use anyhow::{Result, anyhow};
use std::{fs, path::Path};
use unic_core::{
    config::{Corrects, IntersectionMode},
    model::Model,
};

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

/// The handling of a name, with the model's own distance where it has one, else the usual one.
pub(crate) fn intersection(model: &Model, name: IntersectionName) -> IntersectionMode {
    let own = model.config().intersection;
    match (name, own) {
        (IntersectionName::Paper, IntersectionMode::Paper { .. })
        | (IntersectionName::Robust, IntersectionMode::Robust { .. }) => own,
        (IntersectionName::Off, _) => IntersectionMode::Off,
        (IntersectionName::Paper, _) => IntersectionMode::Paper {
            relaxation_m: IntersectionMode::RELAXATION_M,
        },
        (IntersectionName::Robust, _) => IntersectionMode::Robust {
            margin_m: IntersectionMode::MARGIN_M,
            corrects: Corrects::Display,
        },
    }
}

/// How far the training motions decided the model's code, where its file tells.
pub(crate) fn code_certainty(model: &Model) -> Option<String> {
    let measured = &model.about().training["code"];
    let number = |key: &str| measured[key].as_f64();
    let (top, uniform) = number("mean_top_probability").zip(number("uniform"))?;
    Some(format!(
        "{top:.3} on training motion, where {uniform:.3} is undecided and 1 certain"
    ))
}
