//! Facts about a model, which are listed before the tensors of its file.

use crate::model_file;
use serde_json::{Value, json};
use std::path::Path;
use unic_core::{
    IntersectionMode, Model,
    config::{LatentCode, StateConfig},
    motion::{JointSprings, MotionLayout},
    replay::Replay,
};
use unic_io::inspect::{Fact, Inspection};

/// Opens the model and adds its facts, before those of the file, or the reason why it cannot be
/// opened.
///
/// A model that can be opened can be run.
pub(super) fn add_facts(report: &mut Inspection) {
    match model_file::read(&report.path) {
        Ok(model) => {
            // The model's own facts come before those of the file format.
            let of_file = std::mem::take(&mut report.facts);
            report.facts = facts(&report.path, &model);
            report.facts.extend(of_file);
        }
        Err(error) => report.problems.push(error.to_string()),
    }
}

fn facts(path: &Path, model: &Model) -> Vec<Fact> {
    let (config, about) = (model.config(), model.about());
    let character = model.character();
    let mut facts = vec![
        Fact::plain("trained on", about.name.as_str()),
        Fact::plain("provenance", about.provenance.as_str()),
        Fact::plain("garment vertices", model.vertex_count()),
        Fact::plain("body vertices", character.body.vertices.len()),
        joints(character.skeleton.names()),
        Fact::measured(
            "frames per second",
            config.fps.to_string(),
            json!(rounded(config.fps)),
        ),
        Fact::plain("parameters", model.parameter_count()),
        Fact::plain("precision here", model.precision().name()),
        Fact::plain("state", state(&config.state)),
        Fact::plain("motion vector", layout(config.motion.layout)),
        Fact::plain("intersection handling", intersection(config.intersection)),
    ];
    facts.extend(springs(&config.motion.springs));
    facts.extend(model.prior().replay.as_ref().map(wrinkles));
    facts.extend(file_size(path));
    facts.extend(code(model));
    facts.extend(training(&about.training));
    facts
}

/// Fact about the springs that the motion vector reads.
fn springs(springs: &JointSprings) -> Option<Fact> {
    if springs.is_empty() {
        return None;
    }
    let (per_joint, joints) = (springs.springs.len(), springs.joints.len());
    Some(Fact::measured(
        "springs",
        format!("{per_joint} on each of {joints} joints"),
        json!({ "per_joint": per_joint, "joints": joints }),
    ))
}

/// Fact about a replay of wrinkles.
fn wrinkles(replay: &Replay) -> Fact {
    let (shapes, frames) = (replay.library().coefficients(), replay.library().len());
    Fact::measured(
        "wrinkles",
        model_file::replayed(replay),
        json!({ "shapes": shapes, "frames": frames }),
    )
}

fn joints(names: &[String]) -> Fact {
    let text = format!("{} ({})", names.len(), names.join(" "));
    Fact::measured("joints", text, json!({ "count": names.len(), "names": names }))
}

/// Shortest decimal that stands for the `f32`: 29.97 instead of 29.969999313354492.
fn rounded(number: f32) -> f64 {
    // The text of an `f32` is the shortest that reads back as the same `f32`.
    number.to_string().parse().unwrap_or(f64::from(number))
}

fn file_size(path: &Path) -> Option<Fact> {
    let bytes = std::fs::metadata(path).ok()?.len();
    let text = format!("{:.1} MB", bytes as f64 / 1e6);
    Some(Fact::measured("file size", text, json!({ "bytes": bytes })))
}

fn state(state: &StateConfig) -> &'static str {
    match state {
        StateConfig::RootRelative => "positions relative to the root joint, as published",
        StateConfig::Displacement(_) => "displacements from a linear prior",
    }
}

fn layout(layout: MotionLayout) -> &'static str {
    match layout {
        MotionLayout::Heading => "in the frame of the heading",
        MotionLayout::Paper => "in the frame of the first root rotation, as published",
        MotionLayout::PaperRootRelative => {
            "in the frame of the first root rotation, positions relative to the root joint"
        }
    }
}

fn intersection(mode: IntersectionMode) -> &'static str {
    match mode {
        IntersectionMode::Off => "off",
        IntersectionMode::Paper { .. } => "paper",
        IntersectionMode::Robust { .. } => "robust",
    }
}

/// Facts about the motion code: its size and kind, and its certainty on the training motions.
fn code(model: &Model) -> [Fact; 2] {
    let encoder = &model.config().encoder;
    let kind = match encoder.code {
        LatentCode::PickedLogit => "picked logits",
        LatentCode::OneHot => "one-hot",
    };
    let (channels, categories) = (encoder.channels, encoder.categories);
    let sizes = format!("{channels} channels of {categories} categories, {kind}");
    let certainty = model_file::code_certainty(model).unwrap_or_else(|| "not in this file".to_owned());
    let recorded = model.about().training["code"].clone();
    [
        Fact::measured(
            "motion code",
            sizes,
            json!({ "channels": channels, "categories": categories, "kind": kind }),
        ),
        Fact::measured("mean top probability", certainty, recorded),
    ]
}

/// Facts from the file's record of its training. A model of another program may have none.
fn training(record: &Value) -> Vec<Fact> {
    let mut facts = Vec::new();
    if let Some(clips) = record["training_clips"].as_array() {
        let names: Vec<&str> = clips.iter().filter_map(Value::as_str).collect();
        let text = format!("{}: {}", names.len(), names.join(" "));
        facts.push(Fact::measured("training clips", text, json!(names)));
    }
    if let Some(seed) = record["settings"]["seed"].as_u64() {
        facts.push(Fact::plain("training seed", seed));
    }
    if let Some(version) = record["program"].as_str() {
        facts.push(Fact::plain("trained by", version));
    }
    if let Some(steps) = record["steps"].as_u64() {
        facts.push(Fact::plain("training steps", steps));
    }
    if let Some(seconds) = record["seconds"].as_f64() {
        facts.push(Fact::measured(
            "training time",
            format!("{seconds:.0} s"),
            json!({ "seconds": seconds }),
        ));
    }
    let validation = &record["validation"];
    match validation["rmse_mm"].as_f64() {
        Some(rmse) => {
            let clips: Vec<&str> = validation["clips"]
                .as_array()
                .into_iter()
                .flatten()
                .filter_map(Value::as_str)
                .collect();
            let text = format!("{rmse:.2} mm RMSE in free running on {}", clips.join(", "));
            facts.push(Fact::measured("validation", text, validation.clone()));
        }
        // Listed in any case: a model without a measured error is worth knowing.
        None => facts.push(Fact::measured("validation", "none", Value::Null)),
    }
    facts
}
