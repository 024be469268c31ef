//! Reading and writing of model files, and the choice of their intersection handling.

use crate::args::IntersectionName;
use anyhow::{Context, Result, anyhow, bail};
use std::{fs, path::Path, sync::Arc};
use unic_core::{Animator, Corrects, IntersectionMode, Model, replay::Replay};
use unic_eval::CodeCertainty;
use unic_io::Capture;

/// Reads a model.
///
/// # Errors
/// A file that cannot be read or is no model. The message names the path.
pub fn read(path: &Path) -> Result<Model> {
    Model::from_bytes(&read_bytes(path)?).map_err(|e| anyhow!("{}: {e}", path.display()))
}

/// Reads the bytes of a file that is no other known kind than a model.
///
/// # Errors
/// A file that cannot be read or is of another kind. The message names the path.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    // A file of another known format is named as such, instead of as a damaged model.
    unic_io::refuse_foreign(path, "a model (.unic)")?;
    if path.is_dir() {
        bail!("{}: expected a model (.unic), found a folder", path.display());
    }
    fs::read(path).with_context(|| format!("{}: cannot read the model", path.display()))
}

/// Writes a model and returns its size in bytes. The file appears complete or not at all.
///
/// # Errors
/// A file that cannot be written. The message names the path.
pub(crate) fn write(path: &Path, model: &Model) -> Result<usize> {
    let bytes = model.to_bytes().map_err(|e| anyhow!("{}: {e}", path.display()))?;
    unic_io::atomic::write(path, &bytes)?;
    Ok(bytes.len())
}

/// Text of how much a model replays.
pub(crate) fn replayed(replay: &Replay) -> String {
    let (shapes, frames) = (replay.library().coefficients(), replay.library().len());
    format!("{shapes} shapes, replayed from {frames} frames of training motion")
}

/// Intersection handling by name: the model's own if it has that name, else the usual one.
pub fn intersection(model: &Model, name: IntersectionName) -> IntersectionMode {
    let own = model.config().intersection;
    match (name, own) {
        (IntersectionName::Paper, IntersectionMode::Paper { .. })
        | (IntersectionName::Robust, IntersectionMode::Robust { .. }) => own,
        _ => usual_intersection(name),
    }
}

/// Intersection handling by name, with the default distance from the body.
pub fn usual_intersection(name: IntersectionName) -> IntersectionMode {
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

/// Reads a model that fits the capture and returns an animator of it.
///
/// # Errors
/// A file that is no model, or a model for another garment, character or frame rate.
pub fn animator(path: &Path, handling: Option<IntersectionName>, capture: &Capture) -> Result<Animator> {
    Ok(animator_of(read_fitting(path, capture)?, handling))
}

/// Reads a model that fits the capture.
///
/// # Errors
/// Those of [`animator`].
pub(crate) fn read_fitting(path: &Path, capture: &Capture) -> Result<Model> {
    let model = read(path)?;
    check_fit(&model, path, capture)?;
    Ok(model)
}

/// Makes an animator with the intersection handling of this name, or with the model's own.
pub(crate) fn animator_of(model: Model, handling: Option<IntersectionName>) -> Animator {
    let mode = handling.map(|name| intersection(&model, name));
    let mut animator = Animator::new(Arc::new(model));
    if let Some(mode) = mode {
        animator.set_intersection(mode);
    }
    animator
}

/// Checks that a model fits a capture: numbers of vertices and joints, order of joints, frame rate.
///
/// # Errors
/// The first property that differs.
fn check_fit(model: &Model, path: &Path, capture: &Capture) -> Result<()> {
    let (garment, skeleton) = (&capture.garment.rest, &capture.character.skeleton);
    let counts = [
        ("garment vertices", garment.vertices.len(), model.vertex_count()),
        ("joints", skeleton.len(), model.character().skeleton.len()),
    ];
    let capture_path = capture.root.display();
    if let Some((what, expected, found)) = counts.into_iter().find(|(_, expected, found)| expected != found) {
        bail!(
            "{}: expected a model of {expected} {what} as in {capture_path}, found {found}",
            path.display()
        );
    }
    let [expected, found] = [skeleton, &model.character().skeleton].map(|skeleton| skeleton.names());
    // A joint of another name is no error: captures spell names in several ways. The same name at
    // another index is.
    let is_elsewhere = |(joint, (a, b)): &(usize, (&String, &String))| {
        a != b && (expected.iter().enumerate()).any(|(place, name)| name == *b && place != *joint)
    };
    if let Some((_, (expected, found))) = expected.iter().zip(found).enumerate().find(is_elsewhere) {
        bail!(
            "{}: expected joints in the order of {capture_path}, found {found} in the place of {expected}: probably \
             a model of another export of the character; train it on this capture",
            path.display()
        );
    }
    let (expected, found) = (capture.manifest.fps, model.config().fps);
    // A tolerance, because files round rates such as 29.97.
    if (expected - found).abs() > 1e-3 * expected {
        bail!(
            "{}: expected a model for {expected} fps as in {capture_path}, found {found}",
            path.display()
        );
    }
    Ok(())
}

/// Text of the certainty of the motion code on the training motions. `None` if the file has none.
pub(crate) fn code_certainty(model: &Model) -> Option<String> {
    let recorded = model.about().training["code"].clone();
    let measured: CodeCertainty = serde_json::from_value(recorded).ok()?;
    Some(format!("{measured}, on training motion"))
}
