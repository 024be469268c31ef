//! Tables of the measures of life in free running: wrinkles by wavelength, strain, bending,
//! popping, cloth through itself.

use super::rows::{display_name, rows};
use unic_eval::{BandMetrics, Evaluation, Metrics, Scores};
use unic_report::{Definition, Order, Table, TableColumn, TableRow, Value};

/// Definitions for the end of the page.
const DEFINITIONS: [(&str, &str); 6] = [
    (
        "living ratio",
        "standard deviation over time of the wrinkles of a band of wavelengths at each vertex, divided by that of the simulation: below 1 wrinkles come and go too little. Wrinkles are the difference of two smoothings of the garment, along its normals.",
    ),
    (
        "amplitude",
        "root mean square of the wrinkles of a band of wavelengths, divided by that of the simulation: below 1 the garment is too smooth.",
    ),
    (
        "strain",
        "1st and 99th percentile of the change in length of the garment's edges from the rest shape. The last row has the simulation's.",
    ),
    (
        "bending",
        "root mean square of the change from the rest shape of the angles between neighbouring triangles, divided by that of the simulation.",
    ),
    (
        "popping",
        "99th percentile of the second difference over time of a vertex, divided by that of the simulation: above 1 the garment jumps.",
    ),
    (
        "self-crossing",
        "share of the garment's edges that pass through another part of the garment. The last row has the simulation's.",
    ),
];

/// Definitions of the columns. Empty if nothing was measured in free running.
pub(super) fn definitions(evaluation: &Evaluation) -> Vec<Definition> {
    let definition = |(term, meaning): (&str, &str)| Definition {
        term: term.to_owned(),
        meaning: meaning.to_owned(),
    };
    match measured(&evaluation.pooled).is_empty() {
        true => Vec::new(),
        false => DEFINITIONS.into_iter().map(definition).collect(),
    }
}

/// Table of one clip, or of all. `None` if nothing was measured in free running.
pub(super) fn table(title: &str, scores: &Scores) -> Option<Table> {
    let rows = measured(scores);
    let (_, any) = rows.first()?;
    let truth = TableRow {
        name: "simulation".to_owned(),
        values: truth_values(any),
    };
    let row = |(name, metrics): &(&str, &Metrics)| TableRow {
        name: display_name(name),
        values: values(metrics),
    };
    Some(Table {
        title: format!("{title}: life in free running"),
        columns: columns(&any.bands),
        rows: rows.iter().map(row).chain([truth]).collect(),
    })
}

/// Rows with measures of life, in the order of the tables.
fn measured(scores: &Scores) -> Vec<(&str, &Metrics)> {
    let metrics = |(name, by_mode)| {
        let by_mode: &unic_eval::ByMode = by_mode;
        Some((name, by_mode.free_running.as_ref()?))
    };
    let rows = rows(scores).into_iter().filter_map(metrics);
    rows.filter(|(_, metrics)| !metrics.bands.is_empty()).collect()
}

fn columns(bands: &[BandMetrics]) -> Vec<TableColumn> {
    let column = |name: String, unit: &str, digits: usize, order: Order| TableColumn {
        name,
        unit: unit.to_owned(),
        digits,
        order,
    };
    let of_bands = |what: &str| -> Vec<TableColumn> {
        let of_band =
            |band: &BandMetrics| column(format!("{what} {} cm", band.name()), "", 2, Order::OneIsBest);
        bands.iter().map(of_band).collect()
    };
    let strain = ["strain 1 %", "strain 99 %"].map(|name| column(name.into(), "%", 1, Order::Unordered));
    let ratios = ["bending", "popping"].map(|name| column(name.into(), "ratio", 2, Order::OneIsBest));
    let bands = of_bands("living").into_iter().chain(of_bands("amplitude"));
    let crossing = column("self-crossing".into(), "%", 2, Order::LessIsBetter);
    bands.chain(strain).chain(ratios).chain([crossing]).collect()
}

fn values(metrics: &Metrics) -> Vec<Value> {
    let living = metrics.bands.iter().map(|band| Some(band.living_ratio));
    let amplitude = metrics.bands.iter().map(|band| Some(band.amplitude_ratio));
    let others = [
        metrics.strain_p01_percent,
        metrics.strain_p99_percent,
        metrics.bending_ratio,
        metrics.popping_ratio,
        metrics.self_crossing_edges_percent,
    ];
    let all = living.chain(amplitude).chain(others);
    all.map(|value| value.map_or(Value::None, Value::Number))
        .collect()
}

/// Values of the simulation: its strain and self-crossings alone, because ratios to itself are 1.
fn truth_values(metrics: &Metrics) -> Vec<Value> {
    let none = std::iter::repeat_n(None, 2 * metrics.bands.len());
    let strain = [metrics.strain_p01_percent_truth, metrics.strain_p99_percent_truth];
    let others = [None, None, metrics.self_crossing_edges_percent_truth];
    let all = none.chain(strain).chain(others);
    all.map(|value| value.map_or(Value::None, Value::Number))
        .collect()
}
