//! The page's first sentence, its large numbers and its footnote.

use super::scores;
use crate::commands::eval::{
    knowledge::{Knowledge, counted},
    timing::Timing,
};
use std::path::Path;
use unic_eval::{
    ByMode, Evaluation, MODEL,
    baselines::{RIDGE, RIDGE_HANDLED},
};
use unic_io::Capture;
use unic_report::{Definition, KeyFigure};

/// The rows that are linear and fitted to training clips: what a model has to beat.
const LINEAR: [&str; 3] = [RIDGE_HANDLED, RIDGE, "linear_dynamics"];

/// The capture's name and, where the capture tells what garment it is, the garment's.
pub(super) fn title(capture: &Capture) -> String {
    let name = &capture.manifest.name;
    match garment_name(capture).filter(|garment| garment != name) {
        Some(garment) => format!("{name}: {garment}"),
        None => name.clone(),
    }
}

/// The name of a built-in garment or of the garment's file, where the capture was simulated here.
pub(super) fn garment_name(capture: &Capture) -> Option<String> {
    let garment = capture.manifest.source.get("garment")?.as_str()?;
    let stem = Path::new(garment).file_stem()?.to_str()?;
    (!stem.is_empty()).then(|| stem.to_owned())
}

/// An error in metres as millimetres; beyond this it means nothing.
pub(super) fn millimetres(metres: f64) -> String {
    match metres < DIVERGED_M {
        true => format!("{:.1} mm", 1e3 * metres),
        false => "diverged".to_owned(),
    }
}

/// A garment that is so far away is not a garment any more, metres.
const DIVERGED_M: f64 = 100.0;

fn rmse(by_mode: &ByMode) -> Option<f64> {
    by_mode.free_running.as_ref().map(|metrics| metrics.rmse_mm)
}

/// Name and free-running RMSE of the best of some rows, mm.
fn best<'a>(evaluation: &'a Evaluation, names: &[&str]) -> Option<(&'a str, f64)> {
    let rows = scores::rows(&evaluation.pooled).into_iter();
    let found = rows.filter_map(|(name, by_mode)| Some((name, rmse(by_mode)?)));
    let named = found.filter(|(name, error)| names.contains(name) && *error < 1e3 * DIVERGED_M);
    named.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// One sentence.
pub(super) fn lead(evaluation: &Evaluation, knowledge: &Knowledge) -> String {
    let on = knowledge.on_clips();
    let model = match best(evaluation, &[MODEL]) {
        Some((_, error)) => format!("the model, running freely, is {error:.1} mm RMSE from the simulation"),
        None => "the model, running freely, diverges".to_owned(),
    };
    let skinning = best(evaluation, &["skinning"]).map(|(_, error)| format!("skinning is {error:.1} mm"));
    let linear = best(evaluation, &LINEAR).map(|(name, error)| {
        let name = scores::display_name(name);
        format!("the best linear baseline ({name}) {error:.1} mm")
    });
    let others: Vec<String> = skinning.into_iter().chain(linear).collect();
    match others.as_slice() {
        [] => format!("{on}, {model}."),
        others => format!("{on}, {model}; {}.", others.join(" and ")),
    }
}

/// The same from afar, and the time of a frame.
pub(super) fn figures(evaluation: &Evaluation, timing: Option<&Timing>) -> Vec<KeyFigure> {
    let error = |names: &[&str], label: &str| {
        let (name, error) = best(evaluation, names)?;
        Some(KeyFigure {
            value: format!("{error:.1}"),
            unit: "mm".into(),
            label: label.replace("{}", &scores::display_name(name)),
        })
    };
    let frame = timing.map(|timing| KeyFigure {
        value: format!("{:.2}", timing.frame_ms),
        unit: "ms".into(),
        label: format!("a frame of the model, {}", counted(timing.threads, "thread")),
    });
    let errors = [
        error(&[MODEL], "model, RMSE of free running"),
        error(&["skinning"], "skinning of the rest shape"),
        error(&LINEAR, "best linear baseline: {}"),
    ];
    errors.into_iter().chain([frame]).flatten().collect()
}

/// What each row is.
const ROWS: [(&str, &str); 10] = [
    (
        MODEL,
        "the model under evaluation, with its handling of intersections.",
    ),
    (
        "skinning",
        "the rest shape carried by the skeleton, with weights diffused over the garment. Nothing is fitted.",
    ),
    (
        "skinning_mean",
        "the same with the mean of the training clips' unposed shapes in place of the rest shape.",
    ),
    (
        RIDGE,
        "ridge regression from two motion vectors to 60 principal components of the unposed shape.",
    ),
    (
        RIDGE_HANDLED,
        "the same with the model's handling of intersections: what its vertices inside the body compare with.",
    ),
    (
        "linear_dynamics",
        "ridge regression with the previous components as further inputs.",
    ),
    ("prior", "the model's own prior, without the network's field."),
    ("skinning_first", "skinning of the clip's first frame, unposed."),
    (
        "mean_shape",
        "the mean of the training clips, turned to where the character faces.",
    ),
    ("hold", "the previous true frame, carried along with the root."),
];

/// Columns first, then rows.
pub(super) fn definitions(evaluation: &Evaluation) -> Vec<Definition> {
    let definition = |term: &str, meaning: &str| Definition {
        term: term.to_owned(),
        meaning: meaning.to_owned(),
    };
    let measures = scores::measures(evaluation).into_iter();
    let columns = measures
        .filter(|m| !m.meaning.is_empty())
        .map(|m| definition(m.name, m.meaning));
    let present: Vec<&str> = scores::rows(&evaluation.pooled)
        .iter()
        .map(|(name, _)| *name)
        .collect();
    let rows = ROWS.into_iter().filter(|(name, _)| present.contains(name));
    let rows = rows.map(|(name, meaning)| definition(&scores::display_name(name), meaning));
    columns.chain(rows).collect()
}
