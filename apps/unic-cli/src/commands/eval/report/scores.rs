//! Tables of the report: errors of each clip, with a row per predictor and a column per metric.

use super::{
    life,
    rows::{display_name, rows},
};
use unic_eval::{ByMode, Evaluation, Metrics, Scores};
use unic_report::{Order, Table, TableColumn, TableRow, Value};

/// Mode and metric of a column.
enum Source {
    OneStep(fn(&Metrics) -> Option<f64>),
    FreeRunning(fn(&Metrics) -> Option<f64>),
}
use Source::{FreeRunning, OneStep};

/// Column of the tables.
pub(super) struct ScoreColumn {
    /// Heading.
    pub(super) name: &'static str,
    unit: &'static str,
    /// Digits after the decimal point.
    digits: usize,
    /// Values that are good, which the page marks.
    order: Order,
    source: Source,
    /// Definition for the end of the page. Empty if another column's definition covers it.
    pub(super) meaning: &'static str,
}

/// Column of an error in millimetres.
const fn millimetres(name: &'static str, source: Source, meaning: &'static str) -> ScoreColumn {
    ScoreColumn {
        name,
        unit: "mm",
        digits: 1,
        order: Order::LessIsBetter,
        source,
        meaning,
    }
}

/// Column of a share in percent.
const fn percent(name: &'static str, source: Source, meaning: &'static str) -> ScoreColumn {
    ScoreColumn {
        unit: "%",
        digits: 2,
        ..millimetres(name, source, meaning)
    }
}

const COLUMNS: [ScoreColumn; 10] = [
    millimetres(
        "RMSE",
        FreeRunning(|m| Some(m.rmse_mm)),
        "square root of the mean squared distance between predicted and simulated vertices, over all vertices and frames of free running, in which the row starts from the first frame and then sees the motion alone. This is the number to compare.",
    ),
    millimetres(
        "one step",
        OneStep(|m| Some(m.rmse_mm)),
        "RMSE with every frame predicted from the true frame before it. It is easier, and does not show how errors grow in free running.",
    ),
    millimetres(
        "at 1 s",
        FreeRunning(|m| m.rmse_mm_at_1s),
        "RMSE of free running over the first second. The columns at 5, 10 and 60 s are over the second that ends there.",
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
        "share of garment vertices inside the body, by the side of the closest point of its surface. Intersection handling, which moves vertices out of the body, is applied to the model, its prior and ridge handled alone.",
    ),
    ScoreColumn {
        unit: "ratio",
        digits: 2,
        order: Order::OneIsBest,
        ..millimetres(
            "jitter",
            FreeRunning(|m| Some(m.jitter_ratio)),
            "root mean square of the second difference over time, divided by that of the simulation: 1 is as lively, less moves too smoothly, more trembles.",
        )
    },
    percent(
        "edge length",
        FreeRunning(|m| Some(m.edge_length_error_percent)),
        "mean relative error of the lengths of the garment's edges, by which cloth looks stretched or compressed.",
    ),
];

/// Columns in which at least one row has a number.
pub(super) fn columns(evaluation: &Evaluation) -> Vec<&'static ScoreColumn> {
    // A constant slice is promoted to static, which references to elements of `COLUMNS` are not.
    const ALL: &[ScoreColumn] = &COLUMNS;
    let has_number = |column: &&ScoreColumn| {
        let mut rows = rows(&evaluation.pooled).into_iter();
        rows.any(|(_, by_mode)| column.value(by_mode) != Value::None)
    };
    ALL.iter().filter(has_number).collect()
}

impl ScoreColumn {
    /// Number of a row in this column.
    fn value(&self, row: &ByMode) -> Value {
        let number = match &self.source {
            OneStep(number) => row.one_step.as_ref().and_then(number),
            FreeRunning(number) => row.free_running.as_ref().and_then(number),
        };
        number.map_or(Value::None, Value::Number)
    }

    /// Heading of the column for the page.
    fn heading(&self) -> TableColumn {
        TableColumn {
            name: self.name.to_owned(),
            unit: self.unit.to_owned(),
            digits: self.digits,
            order: self.order,
        }
    }
}

/// Tables of the report: all clips together if there are several, then each clip. A table of errors
/// is followed by that of the measures of life.
pub(super) fn tables(evaluation: &Evaluation) -> Vec<Table> {
    let columns = columns(evaluation);
    let table = |title: String, scores: &Scores| Table {
        title,
        columns: columns.iter().map(|column| column.heading()).collect(),
        rows: rows(scores)
            .into_iter()
            .map(|(name, by_mode)| row(name, by_mode, &columns))
            .collect(),
    };
    let both = |title: &str, scores: &Scores| {
        let life = life::table(title, scores);
        std::iter::once(table(title.to_owned(), scores)).chain(life)
    };
    let clips = evaluation.clips.iter();
    let clips = clips.flat_map(|(name, scores)| both(name, scores));
    match evaluation.clips.len() {
        0 | 1 => clips.collect(),
        n => both(&format!("All {n} clips"), &evaluation.pooled)
            .chain(clips)
            .collect(),
    }
}

fn row(name: &str, by_mode: &ByMode, columns: &[&ScoreColumn]) -> TableRow {
    TableRow {
        name: display_name(name),
        values: columns.iter().map(|column| column.value(by_mode)).collect(),
    }
}
