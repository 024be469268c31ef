//! Facts about the model, the capture and the machine, in groups of name and value.

use super::{machine, text};
use crate::{commands::eval::training_overlap::counted, model_file, timing::Timing};
use anyhow::Result;
use serde_json::Value;
use std::{fs, path::Path, time::Duration};
use unic_core::{
    IntersectionMode, Model,
    config::{ModelConfig, StateConfig},
};
use unic_io::{Capture, Split};
use unic_report::{Fact, Facts};

/// Group of facts. Those without a value are left out.
fn facts(title: &str, rows: impl IntoIterator<Item = (&'static str, Option<String>)>) -> Facts {
    let rows = rows.into_iter();
    Facts {
        title: title.to_owned(),
        rows: rows
            .filter_map(|(name, value)| {
                Some(Fact {
                    name: name.to_owned(),
                    value: value?,
                })
            })
            .collect(),
    }
}

/// Facts about the model and its training.
pub(super) fn of_model(model: &Model, path: &Path) -> Facts {
    let config = model.config();
    let training = &model.about().training;
    let bytes = fs::metadata(path).ok().map(|file| file.len() as f64);
    let steps = training.get("steps").and_then(|s| s.as_u64());
    // The name without its folder, which means nothing to other readers of the page.
    let file = path.file_name().map(|name| name.to_string_lossy().into_owned());
    let encoder = &config.encoder;
    let hidden: Vec<String> = encoder.hidden.iter().map(usize::to_string).collect();
    facts(
        "Model",
        [
            ("file", file),
            ("size", bytes.map(|bytes| format!("{:.1} MB", bytes / 1e6))),
            ("parameters", Some(grouped(model.parameter_count()))),
            ("vertices", Some(grouped(model.vertex_count()))),
            (
                "field",
                Some(format!(
                    "{} hidden layers of {}",
                    config.field.hidden_layers, config.field.width
                )),
            ),
            (
                "motion encoder",
                Some(format!(
                    "{}, {} codes of {} categories",
                    hidden.join(" · "),
                    encoder.channels,
                    encoder.categories
                )),
            ),
            ("mean top probability", model_file::code_certainty(model)),
            ("state", Some(state(config))),
            ("intersections", Some(intersections(config))),
            ("training time", training_time(training)),
            ("training steps", steps.map(|steps| grouped(steps as usize))),
            ("validation", validation(training)),
        ],
    )
}

/// Training time with the part of it that the prior took. `None` if the model file has none.
fn training_time(training: &Value) -> Option<String> {
    let duration = |key: &str| {
        let seconds = training.get(key)?.as_f64()?;
        // The account of the training is free-form JSON: numbers may be negative or huge.
        let duration = Duration::try_from_secs_f64(seconds.round()).ok()?;
        Some(humantime::format_duration(duration).to_string())
    };
    let all = duration("seconds")?;
    match duration("prior_seconds") {
        Some(prior) => Some(format!("{all}, {prior} of it for the prior")),
        None => Some(all),
    }
}

/// Validation error of the training, with the clips and whether training had seen them.
fn validation(training: &Value) -> Option<String> {
    let validation = training.get("validation")?;
    let rmse = validation.get("rmse_mm")?.as_f64()?;
    let clips = validation.get("clips")?.as_array()?;
    let clips: Vec<&str> = clips.iter().filter_map(Value::as_str).collect();
    let what = match validation.get("motion").and_then(Value::as_str) {
        Some("trained_on") => ", which it was trained on",
        _ => ", held out",
    };
    Some(format!("{rmse:.1} mm on {}{what}", clips.join(", ")))
}

fn state(config: &ModelConfig) -> String {
    match &config.state {
        StateConfig::RootRelative => "positions relative to the root joint, as in the paper".to_owned(),
        StateConfig::Displacement(d) => {
            format!("displacement from a prior, with a memory of {} s", d.memory_s)
        }
    }
}

fn intersections(config: &ModelConfig) -> String {
    match config.intersection {
        IntersectionMode::Off => "not handled".to_owned(),
        IntersectionMode::Paper { relaxation_m } => {
            format!("moved {:.1} mm off the nearest body vertex", 1e3 * relaxation_m)
        }
        IntersectionMode::Robust { margin_m, .. } => {
            format!(
                "moved the shortest way to {:.1} mm above the skin",
                1e3 * margin_m
            )
        }
    }
}

/// Facts about the capture and the clips that are measured.
pub(super) fn of_capture(capture: &Capture, clips: &[String]) -> Result<Facts> {
    let rest = &capture.garment.rest;
    let mut frames = 0;
    for name in clips {
        frames += capture.summarise_clip(name)?.pose_frames;
    }
    let fps = capture.manifest.fps;
    let training = capture.clip_names(Split::Train).len();
    // Line breaks of the manifest become single spaces.
    let provenance = capture
        .manifest
        .provenance
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ");
    Ok(facts(
        "Capture",
        [
            ("name", Some(capture.manifest.name.clone())),
            (
                "garment",
                Some(format!(
                    "{}{} vertices, {} triangles",
                    text::garment_name(capture).map_or_else(String::new, |name| format!("{name}, ")),
                    grouped(rest.vertices.len()),
                    grouped(rest.faces.len())
                )),
            ),
            (
                "character",
                Some(format!(
                    "{} joints, {} vertices",
                    capture.character.skeleton.len(),
                    grouped(capture.character.body.vertices.len())
                )),
            ),
            (
                "measured",
                Some(format!(
                    "{}, {:.1} s at {fps} frames a second",
                    counted(clips.len(), "clip"),
                    frames as f32 / fps
                )),
            ),
            ("training clips", Some(training.to_string())),
            ("provenance", Some(provenance).filter(|text| !text.is_empty())),
        ],
    ))
}

/// Facts about the machine, with the time of a frame.
pub(super) fn of_machine(timing: Option<&Timing>) -> Facts {
    let rate = |timing: &Timing| {
        let (ms, threads) = (timing.frame_ms, counted(timing.threads, "thread"));
        format!("{ms:.2} ms, {:.0} a second ({threads}, median)", 1e3 / ms)
    };
    facts(
        "Machine",
        [
            ("processor", Some(machine::processor())),
            ("cores", Some(machine::cores().to_string())),
            (
                "system",
                Some(format!("{} {}", std::env::consts::OS, std::env::consts::ARCH)),
            ),
            ("frame of the model", timing.map(rate)),
        ],
    )
}

/// Decimal text of a number with a comma between groups of three digits.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn training_time_includes_the_part_of_the_prior() {
        let time = |text: &str| training_time(&serde_json::from_str(text).unwrap_or_default());
        assert_eq!(
            time(r#"{"seconds": 35.2, "prior_seconds": 31.9}"#).as_deref(),
            Some("35s, 32s of it for the prior")
        );
        assert_eq!(time(r#"{"seconds": 61}"#).as_deref(), Some("1m 1s"));
        assert_eq!(time(r#"{"seconds": -1e300}"#), None);
        assert_eq!(time("{}"), None);
    }

    #[test]
    fn digits_are_grouped_by_thousands() {
        assert_eq!(
            [7, 999, 3019, 1_234_567].map(grouped),
            ["7", "999", "3,019", "1,234,567"]
        );
    }
}
