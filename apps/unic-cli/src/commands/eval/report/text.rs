//! Texts of the page: title, first sentence, key figures and definitions.

use super::{life, rows, scores};
use crate::{
    commands::eval::training_overlap::{TrainingOverlap, counted},
    timing::Timing,
};
use std::path::Path;
use unic_eval::{
    ByMode, CONTROL, Evaluation, MODEL,
    baselines::{RIDGE, RIDGE_HANDLED},
};
use unic_io::Capture;
use unic_report::{Definition, KeyFigure};

/// Names of the linear baselines, which are fitted to training clips.
const LINEAR: [&str; 3] = [RIDGE_HANDLED, RIDGE, "linear_dynamics"];

/// Title of the page: the capture's name and, if known, the garment's.
pub(super) fn title(capture: &Capture) -> String {
    let name = &capture.manifest.name;
    match garment_name(capture).filter(|garment| garment != name) {
        Some(garment) => format!("{name}: {garment}"),
        None => name.clone(),
    }
}

/// Name of the garment, or of its file, if `unic simulate` has made the capture.
pub(super) fn garment_name(capture: &Capture) -> Option<String> {
    let garment = capture.manifest.source.get("garment")?.as_str()?;
    let stem = Path::new(garment).file_stem()?.to_str()?;
    (!stem.is_empty()).then(|| stem.to_owned())
}

/// Text of an error in metres as millimetres, or "diverged" from [`DIVERGED_M`] on.
pub(super) fn millimetres(metres: f64) -> String {
    // False for NaN too.
    match metres < DIVERGED_M {
        true => format!("{:.1} mm", 1e3 * metres),
        false => "diverged".to_owned(),
    }
}

/// Error in metres from which a prediction counts as diverged.
const DIVERGED_M: f64 = 100.0;

/// Row with its error.
struct RowError<'a> {
    name: &'a str,
    /// RMSE of free running, mm.
    rmse_mm: f64,
}

fn rmse_mm(by_mode: &ByMode) -> Option<f64> {
    by_mode.free_running.as_ref().map(|metrics| metrics.rmse_mm)
}

/// Row with the smallest error among `names`. `None` if all have diverged.
fn best<'a>(evaluation: &'a Evaluation, names: &[&str]) -> Option<RowError<'a>> {
    let rows = rows::rows(&evaluation.pooled).into_iter();
    let rows = rows.filter_map(|(name, by_mode)| {
        let rmse_mm = rmse_mm(by_mode)?;
        Some(RowError { name, rmse_mm })
    });
    let named = rows.filter(|row| names.contains(&row.name) && row.rmse_mm < 1e3 * DIVERGED_M);
    named.min_by(|a, b| a.rmse_mm.total_cmp(&b.rmse_mm))
}

/// First sentence of the page: the errors of the model, of skinning and of the best linear
/// baseline.
pub(super) fn lead(evaluation: &Evaluation, overlap: &TrainingOverlap) -> String {
    let on = overlap.on_clips();
    let model = match best(evaluation, &[MODEL]) {
        Some(RowError { rmse_mm, .. }) => {
            format!("the model, in free running, is {rmse_mm:.1} mm RMSE from the simulation")
        }
        None => "the model, in free running, diverges".to_owned(),
    };
    // Rows that have diverged are left out: their errors mean nothing.
    let skinning = best(evaluation, &["skinning"]).map(|row| format!("skinning is {:.1} mm", row.rmse_mm));
    let linear = best(evaluation, &LINEAR).map(|row| {
        let name = rows::display_name(row.name);
        format!("the best linear baseline ({name}) {:.1} mm", row.rmse_mm)
    });
    let others: Vec<String> = skinning.into_iter().chain(linear).collect();
    match others.as_slice() {
        [] => format!("{on}, {model}."),
        others => format!("{on}, {model}; {}.", others.join(" and ")),
    }
}

/// Key figures: the errors of the first sentence, and the time of a frame.
pub(super) fn figures(evaluation: &Evaluation, timing: Option<&Timing>) -> Vec<KeyFigure> {
    let error = |names: &[&str], label: &str| {
        let row = best(evaluation, names)?;
        Some(KeyFigure {
            value: format!("{:.1}", row.rmse_mm),
            unit: "mm".into(),
            label: label.replace("{}", &rows::display_name(row.name)),
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

/// Definitions of the rows by their names.
const ROWS: [(&str, &str); 11] = [
    (
        MODEL,
        "the model under evaluation, with its intersection handling.",
    ),
    (
        "skinning",
        "the rest shape carried by the skeleton, with skinning weights diffused over the garment. Nothing is fitted.",
    ),
    (
        "skinning_mean",
        "skinning of the mean unposed shape of the training clips, in place of the rest shape.",
    ),
    (
        RIDGE,
        "ridge regression from two motion vectors to 60 principal components of the unposed shape.",
    ),
    (
        RIDGE_HANDLED,
        "ridge with the model's intersection handling, to compare the vertices inside the body.",
    ),
    (
        "linear_dynamics",
        "ridge regression with the components of the previous frame as further inputs.",
    ),
    ("prior", "the model's own prior, without the network's field."),
    ("skinning_first", "skinning of the clip's first frame, unposed."),
    (
        "mean_shape",
        "the mean shape of the training clips, turned to the direction that the character faces.",
    ),
    (
        "hold",
        "the true previous frame, moved rigidly along with the character.",
    ),
    (
        CONTROL,
        "a second simulation of the same motions, whose garment starts from another history.",
    ),
];

/// Definitions of the columns, then of the rows that the evaluation has.
pub(super) fn definitions(evaluation: &Evaluation) -> Vec<Definition> {
    let definition = |term: &str, meaning: &str| Definition {
        term: term.to_owned(),
        meaning: meaning.to_owned(),
    };
    // The columns at several seconds share one definition; the others have an empty one.
    let columns = scores::columns(evaluation).into_iter();
    let columns = columns
        .filter(|m| !m.meaning.is_empty())
        .map(|m| definition(m.name, m.meaning));
    let present: Vec<&str> = rows::rows(&evaluation.pooled)
        .iter()
        .map(|(name, _)| *name)
        .collect();
    let rows = ROWS.into_iter().filter(|(name, _)| present.contains(name));
    let rows = rows.map(|(name, meaning)| definition(&rows::display_name(name), meaning));
    columns.chain(life::definitions(evaluation)).chain(rows).collect()
}
