//! Tables of an evaluation.

use unic_eval::{
    ByMode, Evaluation, MODEL, Metrics, PRIOR, Scores,
    baselines::{RIDGE, RIDGE_HANDLED},
};
use unic_report::{Column, Order, Row, Table, Value};

/// Rows from top to bottom; the others follow in their own order.
const ORDER: [&str; 9] = [
    MODEL,
    "skinning",
    RIDGE_HANDLED,
    RIDGE,
    "linear_dynamics",
    "skinning_mean",
    PRIOR,
    "skinning_first",
    "mean_shape",
];
/// Places of the movies' rows among the lines of the chart, whose colours they have. Without intersection
/// handling there is no handled ridge, and ridge stands in its place.
pub(super) const MODEL_SERIES: usize = 0;
pub(super) const SKINNING_SERIES: usize = 1;
pub(super) const RIVAL_SERIES: usize = 2;

/// Where a row stands.
pub(super) fn place(row: &str) -> usize {
    ORDER.iter().position(|name| *name == row).unwrap_or(ORDER.len())
}

/// A row's name as text.
pub(super) fn display_name(row: &str) -> String {
    row.replace('_', " ")
}

/// Where a column's number comes from.
enum Source {
    OneStep(fn(&Metrics) -> Option<f64>),
    FreeRunning(fn(&Metrics) -> Option<f64>),
}
use Source::{FreeRunning, OneStep};

/// A column: heading, unit, digits, what is good, its number, what it means.
pub(super) struct Measure {
    pub(super) name: &'static str,
    unit: &'static str,
    digits: usize,
    order: Order,
    source: Source,
    pub(super) meaning: &'static str,
}

const fn millimetres(name: &'static str, source: Source, meaning: &'static str) -> Measure {
    Measure {
        name,
        unit: "mm",
        digits: 1,
        order: Order::LessIsBetter,
        source,
        meaning,
    }
}

const fn percent(name: &'static str, source: Source, meaning: &'static str) -> Measure {
    Measure {
        unit: "%",
        digits: 2,
        ..millimetres(name, source, meaning)
    }
}

const MEASURES: [Measure; 10] = [
    millimetres(
        "RMSE",
        FreeRunning(|m| Some(m.rmse_mm)),
        "square root of the mean squared distance between predicted and simulated vertices, over all vertices and frames of free running: the row starts from the first frame and sees no other. The main number.",
    ),
    millimetres(
        "one step",
        OneStep(|m| Some(m.rmse_mm)),
        "the same with every frame predicted from the true one before it. Easier, and no measure of a long run.",
    ),
    millimetres(
        "at 1 s",
        FreeRunning(|m| m.rmse_mm_at_1s),
        "RMSE of free running over the first second; likewise, over the second that ends there, at 5, 10 and 60 s.",
    ),
    millimetres("at 5 s", FreeRunning(|m| m.rmse_mm_at_5s), ""),
    millimetres("at 10 s", FreeRunning(|m| m.rmse_mm_at_10s), ""),
    millimetres("at 60 s", FreeRunning(|m| m.rmse_mm_at_60s), ""),
    millimetres(
        "Hausdorff",
        FreeRunning(|m| Some(m.hausdorff_mm)),
        "largest distance from a vertex of either garment to the nearest vertex of the other, averaged over frames.",
    ),
    percent(
        "inside",
        FreeRunning(|m| Some(m.intersecting_vertices_percent_closest)),
        "garment vertices inside the body, by the side of the closest point of its surface. Intersections are handled for the model, its prior and ridge handled; other rows are as they are predicted.",
    ),
    Measure {
        unit: "ratio",
        digits: 2,
        order: Order::OneIsBest,
        ..millimetres(
            "jitter",
            FreeRunning(|m| Some(m.jitter_ratio)),
            "root mean square of the second difference over time, divided by the simulation's: 1 is as lively, less is stiffer, more trembles.",
        )
    },
    percent(
        "edge length",
        FreeRunning(|m| Some(m.edge_length_error_percent)),
        "mean relative error of the lengths of the garment's edges: how much the cloth is stretched or squeezed.",
    ),
];

/// The columns that have a number anywhere.
pub(super) fn measures(evaluation: &Evaluation) -> Vec<&'static Measure> {
    const ALL: &[Measure] = &MEASURES;
    let has_number = |measure: &&Measure| {
        let mut rows = rows(&evaluation.pooled).into_iter();
        rows.any(|(_, by_mode)| measure.value(by_mode) != Value::None)
    };
    ALL.iter().filter(has_number).collect()
}

impl Measure {
    fn value(&self, row: &ByMode) -> Value {
        let number = match &self.source {
            OneStep(number) => row.one_step.as_ref().and_then(number),
            FreeRunning(number) => row.free_running.as_ref().and_then(number),
        };
        number.map_or(Value::None, Value::Number)
    }

    fn column(&self) -> Column {
        Column {
            name: self.name.to_owned(),
            unit: self.unit.to_owned(),
            digits: self.digits,
            order: self.order,
        }
    }
}

/// Names and numbers in the order of the tables.
pub(super) fn rows(scores: &Scores) -> Vec<(&str, &ByMode)> {
    let baselines = scores
        .baselines
        .iter()
        .map(|(name, by_mode)| (name.as_str(), by_mode));
    let mut rows: Vec<_> = scores.model.iter().map(|m| (MODEL, m)).chain(baselines).collect();
    rows.sort_by_key(|(name, _)| place(name));
    rows
}

/// All clips together first, then, where there are several, each on its own.
pub(super) fn tables(evaluation: &Evaluation) -> Vec<Table> {
    let measures = measures(evaluation);
    let table = |title: String, scores: &Scores| Table {
        title,
        columns: measures.iter().map(|measure| measure.column()).collect(),
        rows: rows(scores)
            .into_iter()
            .map(|(name, by_mode)| row(name, by_mode, &measures))
            .collect(),
    };
    let clips = evaluation
        .clips
        .iter()
        .map(|(name, scores)| table(name.clone(), scores));
    match evaluation.clips.len() {
        0 | 1 => clips.collect(),
        n => std::iter::once(table(format!("All {n} clips"), &evaluation.pooled))
            .chain(clips)
            .collect(),
    }
}

fn row(name: &str, by_mode: &ByMode, measures: &[&Measure]) -> Row {
    Row {
        name: display_name(name),
        values: measures.iter().map(|measure| measure.value(by_mode)).collect(),
    }
}
