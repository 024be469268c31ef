//! The page's first sentence, its large numbers and its footnote.

use super::scores;
use crate::commands::eval::timing::Timing;
use unic_core::model::Model;
use unic_eval::{ByMode, Evaluation, MODEL};
use unic_io::{Capture, Split};
use unic_report::{Definition, KeyFigure};

/// The rows that are linear and fitted to training clips: what a model has to beat.
const LINEAR: [&str; 2] = ["ridge", "linear_dynamics"];

/// What the clips are to the model.
pub(super) struct Subject {
    clips: usize,
    exposure: Exposure,
}

/// How much training knew of the clips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Exposure {
    Unseen,
    /// Choices were made by some of them.
    Validation,
    /// Some of them were fitted.
    Seen,
}

impl Subject {
    /// By the capture's splits and by what the model says of its training.
    pub(super) fn of(capture: &Capture, model: &Model, clips: &[String]) -> Self {
        let about = model.about();
        let listed = |key: &str| -> Vec<&str> {
            let names = about.training.pointer(key).and_then(|names| names.as_array());
            names
                .into_iter()
                .flatten()
                .filter_map(|name| name.as_str())
                .collect()
        };
        let is_same_capture = about.name == capture.manifest.name;
        let is_in = |clip: &str, split, key: &str| {
            capture.clip_names(split).iter().any(|name| name == clip)
                || is_same_capture && listed(key).contains(&clip)
        };
        let any = |split, key: &str| clips.iter().any(|clip| is_in(clip, split, key));
        let exposure = if any(Split::Train, "/training_clips") {
            Exposure::Seen
        } else if any(Split::Validation, "/validation/clips") {
            Exposure::Validation
        } else {
            Exposure::Unseen
        };
        Self {
            clips: clips.len(),
            exposure,
        }
    }

    fn text(&self) -> String {
        let clips = counted(self.clips, "clip");
        match self.exposure {
            Exposure::Unseen => format!("On {clips} that training has never seen"),
            Exposure::Validation => format!("On {clips}, some of which training was steered by"),
            Exposure::Seen => format!("On {clips}, some of which training has seen"),
        }
    }
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
pub(super) fn lead(evaluation: &Evaluation, subject: &Subject) -> String {
    let on = subject.text();
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

/// As in "2 threads".
pub(super) fn counted(count: usize, thing: &str) -> String {
    match count {
        1 => format!("1 {thing}"),
        n => format!("{n} {thing}s"),
    }
}

/// What each row is.
const ROWS: [(&str, &str); 9] = [
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
        "ridge",
        "ridge regression from two motion vectors to 60 principal components of the unposed shape.",
    ),
    (
        "linear_dynamics",
        "the same with the previous components as further inputs.",
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
