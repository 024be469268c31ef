//! Result of an evaluation: JSON for programs, tables for people.

use crate::{
    life::{BandMetrics, JudgeReport},
    metrics::Metrics,
    predictor::{MODEL, Mode},
};
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::fmt::{self, Display, Formatter, Write};

/// All metrics of an evaluation. The JSON form is a public contract: `{"model": {"one_step": M,
/// "free_running": M}, "baselines": {NAME: {MODE: M}}, "clips": {CLIP: the same for one clip}}`
/// with M as [`Metrics`], and the keys of [`JudgeReport`].
///
/// A predictor without a mode lacks its key. Without a model there is no `"model"`. The prior of a
/// displacement model is the baseline `"prior"`.
///
/// [`Display`] writes the tables, the drift curves and the judge.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Metrics over all clips, pooled by sums.
    #[serde(flatten)]
    pub pooled: Scores,
    /// Metrics of each clip, in the order of the evaluation.
    pub clips: IndexMap<String, Scores>,
    /// Judge of predictions and truth.
    #[serde(flatten)]
    pub judge: JudgeReport,
}

/// Metrics of all predictors: the rows of one table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Metrics of the model under evaluation.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub model: Option<ByMode>,
    /// Metrics of the baselines by name, in the order of the evaluation.
    pub baselines: IndexMap<String, ByMode>,
}

/// Metrics of one predictor in both modes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ByMode {
    /// Metrics of one-step prediction.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub one_step: Option<Metrics>,
    /// Metrics of free running.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub free_running: Option<Metrics>,
}

impl Scores {
    /// Iterates over the metrics of every predictor in every mode with their names, the model
    /// first.
    pub fn rows(&self) -> impl Iterator<Item = (&str, Mode, &Metrics)> {
        let model = self.model.iter().map(|by_mode| (MODEL, by_mode));
        let baselines = self
            .baselines
            .iter()
            .map(|(name, by_mode)| (name.as_str(), by_mode));
        model.chain(baselines).flat_map(|(name, by_mode)| {
            let one_step = by_mode.one_step.iter().map(|m| (Mode::OneStep, m));
            let free_running = by_mode.free_running.iter().map(|m| (Mode::FreeRunning, m));
            one_step.chain(free_running).map(move |(mode, m)| (name, mode, m))
        })
    }
}

/// Column of the table: heading, digits after the point, value.
type Column = (&'static str, usize, fn(&Metrics) -> Option<f64>);

/// Columns of the table. Lengths are in mm, shares in %.
const COLUMNS: [Column; 13] = [
    ("rmse", 2, |m| Some(m.rmse_mm)),
    ("mean", 2, |m| Some(m.mean_vertex_error_mm)),
    ("hausdorff", 1, |m| Some(m.hausdorff_mm)),
    ("at 1 s", 1, |m| m.rmse_mm_at_1s),
    ("at 5 s", 1, |m| m.rmse_mm_at_5s),
    ("at 10 s", 1, |m| m.rmse_mm_at_10s),
    ("at 60 s", 1, |m| m.rmse_mm_at_60s),
    ("inside %", 2, |m| Some(m.intersecting_vertices_percent_closest)),
    ("paper's %", 2, |m| Some(m.intersecting_vertices_percent_paper)),
    ("depth", 1, |m| Some(m.mean_depth_mm)),
    ("deepest", 1, |m| Some(m.max_depth_mm)),
    ("jitter", 2, |m| Some(m.jitter_ratio)),
    ("edges %", 2, |m| Some(m.edge_length_error_percent)),
];

/// Seconds of the drift curve that the table shows. JSON holds all.
const DRIFT_SECONDS: [usize; 17] = [1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 30, 45, 60, 90, 120, 180, 300];

impl Display for Evaluation {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if self.clips.len() > 1 {
            for (name, scores) in &self.clips {
                writeln!(f, "{name}\n{scores}")?;
            }
            writeln!(f, "all {} clips", self.clips.len())?;
        } else if let Some(name) = self.clips.keys().next() {
            writeln!(f, "{name}")?;
        }
        Display::fmt(&self.pooled, f)?;
        Display::fmt(&self.judge, f)
    }
}

impl Display for Scores {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let mut lines = vec![header(COLUMNS.iter().map(|(heading, ..)| (*heading).to_owned()))];
        for (name, mode, metrics) in self.rows() {
            let cells = COLUMNS
                .iter()
                .map(|(_, digits, value)| cell(value(metrics), *digits));
            lines.push(line(name, mode, cells));
        }
        write_aligned(f, "mm", &lines)?;
        self.write_life(f)?;
        self.write_drift(f)
    }
}

impl Scores {
    /// Writes the measures of life of free running, and the truth's strain in a last line.
    fn write_life(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let rows = || self.rows().filter(|(.., metrics)| !metrics.bands.is_empty());
        let Some((.., any)) = rows().next() else {
            return Ok(());
        };
        let bands = any.bands.iter().map(BandMetrics::name);
        let headings = bands.chain(["amplitude:".to_owned()]);
        let headings = headings.chain(any.bands.iter().map(BandMetrics::name));
        let others = ["strain 1 %", "strain 99 %", "bending", "popping", "self %"].map(str::to_owned);
        let mut lines = vec![header(headings.chain(others))];
        for (name, mode, metrics) in rows() {
            let living = metrics.bands.iter().map(|band| cell(Some(band.living_ratio), 2));
            let amplitude = metrics
                .bands
                .iter()
                .map(|band| cell(Some(band.amplitude_ratio), 2));
            let strain = [metrics.strain_p01_percent, metrics.strain_p99_percent].map(|s| cell(s, 1));
            let others = [
                metrics.bending_ratio,
                metrics.popping_ratio,
                metrics.self_crossing_edges_percent,
            ];
            let others = others.map(|value| cell(value, 2));
            let cells = living.chain([String::new()]).chain(amplitude);
            lines.push(line(name, mode, cells.chain(strain).chain(others)));
        }
        let truth = [any.strain_p01_percent_truth, any.strain_p99_percent_truth].map(|s| cell(s, 1));
        let crossing = cell(any.self_crossing_edges_percent_truth, 2);
        let dash = || cell(None, 0);
        let ratios = any.bands.iter().map(|_| dash());
        let cells = ratios.clone().chain([String::new()]).chain(ratios).chain(truth);
        lines.push(line(
            "truth",
            Mode::FreeRunning,
            cells.chain([dash(), dash(), crossing]),
        ));
        let title = "life: living ratio by wavelength in cm, amplitude ratio, strain in %, ratios, \
                     edges through the garment itself in %";
        write_aligned(f, title, &lines)
    }

    /// Writes the RMSE of single seconds of free running.
    fn write_drift(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let length = self.rows().map(|(_, _, m)| m.drift_mm.len()).max().unwrap_or(0);
        let seconds = || DRIFT_SECONDS.into_iter().filter(|&s| s <= length);
        // A drift curve of a single second is no curve.
        if length < 2 {
            return Ok(());
        }
        let mut lines = vec![header(seconds().map(|s| format!("{s} s")))];
        for (name, mode, metrics) in self.rows().filter(|(_, mode, _)| *mode == Mode::FreeRunning) {
            let cells = seconds().map(|s| cell(metrics.drift_mm.get(s - 1).copied(), 1));
            lines.push(line(name, mode, cells));
        }
        write_aligned(f, "rmse in mm over the second that ends at", &lines)
    }
}

/// Returns the heading of a table whose first two columns are names.
fn header(headings: impl Iterator<Item = String>) -> Vec<String> {
    let names = [String::new(), String::new()];
    names.into_iter().chain(headings).collect()
}

/// Returns the line of one predictor in one mode.
fn line(name: &str, mode: Mode, cells: impl Iterator<Item = String>) -> Vec<String> {
    let mode = match mode {
        Mode::OneStep => "one step",
        Mode::FreeRunning => "free running",
    };
    let names = [name.to_owned(), mode.to_owned()];
    names.into_iter().chain(cells).collect()
}

/// Formats a number. A value that is not finite belongs to a diverged prediction.
fn cell(value: Option<f64>, digits: usize) -> String {
    match value {
        None => "-".to_owned(),
        Some(value) if value.is_finite() => format!("{value:.digits$}"),
        Some(_) => "diverged".to_owned(),
    }
}

/// Writes lines in columns: the first two aligned to the left, numbers to the right.
fn write_aligned(f: &mut Formatter<'_>, title: &str, lines: &[Vec<String>]) -> fmt::Result {
    let columns = lines.first().map_or(0, Vec::len);
    let width = |c: usize| lines.iter().map(|l| l[c].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    writeln!(f, "{title}")?;
    for line in lines {
        let mut text = String::new();
        for (c, (cell, &width)) in line.iter().zip(&widths).enumerate() {
            match c {
                0 => write!(text, "{cell:<width$}")?,
                1 => write!(text, "  {cell:<width$}")?,
                _ => write!(text, "  {cell:>width$}")?,
            }
        }
        writeln!(f, "{}", text.trim_end())?;
    }
    Ok(())
}
