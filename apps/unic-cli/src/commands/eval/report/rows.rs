//! Rows of the report: their order, their names as shown and their colours.

use unic_eval::{
    ByMode, MODEL, PRIOR, Scores,
    baselines::{RIDGE, RIDGE_HANDLED},
};

/// Names of rows in the order of the tables. Other rows follow in the order of the evaluation.
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
// Views of the movies have the colours of their rows in the chart of the error over time. These
// numbers are the indices of those rows among its lines, in the order of `ORDER`.
/// Index of the model among the lines of the chart.
pub(super) const MODEL_SERIES: usize = 0;
/// Index of skinning among the lines of the chart.
pub(super) const SKINNING_SERIES: usize = 1;
/// Index of handled ridge among the lines of the chart; of ridge if intersections are not handled.
pub(super) const RIVAL_SERIES: usize = 2;

/// Sort key of a row by its name.
pub(super) fn row_order(row: &str) -> usize {
    ORDER.iter().position(|name| *name == row).unwrap_or(ORDER.len())
}

/// Name of a row as it is shown.
pub(super) fn display_name(row: &str) -> String {
    row.replace('_', " ")
}

/// Names and metrics of all rows, in the order of the tables.
pub(super) fn rows(scores: &Scores) -> Vec<(&str, &ByMode)> {
    let baselines = scores
        .baselines
        .iter()
        .map(|(name, by_mode)| (name.as_str(), by_mode));
    let mut rows: Vec<_> = scores.model.iter().map(|m| (MODEL, m)).chain(baselines).collect();
    // The sort is stable: rows that `ORDER` does not name keep their order.
    rows.sort_by_key(|(name, _)| row_order(name));
    rows
}
