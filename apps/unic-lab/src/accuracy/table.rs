//! Results as text: a Markdown table, which can be pasted.

use super::{AccuracyResults, CaptureResults, RowResults, stored::Trained};
use std::fmt::{self, Display, Formatter};
use unic_eval::{Evaluation, Metrics, Scores};

/// Baselines whose better one is compared with a row on each clip.
const LINEAR: [&str; 2] = ["ridge", "linear_dynamics"];

/// Column of the table: heading, digits after the point, value.
type Column = (&'static str, usize, fn(&Metrics) -> Option<f64>);

/// Columns of all rows. Lengths are in mm, shares in %.
const COLUMNS: [Column; 9] = [
    ("RMSE", 2, |m| Some(m.rmse_mm)),
    ("mean error", 2, |m| Some(m.mean_vertex_error_mm)),
    ("at 1 s", 1, |m| m.rmse_mm_at_1s),
    ("at 10 s", 1, |m| m.rmse_mm_at_10s),
    ("at 60 s", 1, |m| m.rmse_mm_at_60s),
    ("Hausdorff", 1, |m| Some(m.hausdorff_mm)),
    ("inside %", 2, |m| Some(m.intersecting_vertices_percent_closest)),
    ("jitter", 2, |m| Some(m.jitter_ratio)),
    ("edges %", 2, |m| Some(m.edge_length_error_percent)),
];

/// Headings of the columns that only trained rows have.
const TRAINED_COLUMNS: [&str; 5] = [
    "one step",
    "worst clip / linear",
    "exceeds skinning",
    "training s",
    "frame ms",
];

impl Display for AccuracyResults {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} for each training, on {}\n",
            self.budget_in_words, self.machine
        )?;
        self.captures
            .iter()
            .try_for_each(|capture| writeln!(f, "{capture}"))
    }
}

impl Display for CaptureResults {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {:.0} s of motion, free running on {}; mm\n",
            self.capture,
            self.training_seconds,
            self.test_clips.join(", ")
        )?;
        let headings: Vec<&str> = (COLUMNS.iter().map(|(heading, ..)| *heading))
            .chain(TRAINED_COLUMNS)
            .collect();
        writeln!(f, "| row | {} |", headings.join(" | "))?;
        writeln!(f, "|---{}|", "|---".repeat(headings.len()))?;
        for (name, by_mode) in &self.baselines.pooled.baselines {
            if let Some(metrics) = &by_mode.free_running {
                let cells: Vec<String> = COLUMNS.iter().map(|c| cell(&[(c.2)(metrics)], c.1)).collect();
                writeln!(
                    f,
                    "| {name} | {} |{}",
                    cells.join(" | "),
                    " |".repeat(TRAINED_COLUMNS.len())
                )?;
            }
        }
        for row in &self.rows {
            let cells = row.cells(&self.baselines);
            writeln!(f, "| {} | {} |", row.title, cells.join(" | "))?;
        }
        Ok(())
    }
}

impl RowResults {
    /// Returns the cells of the row, one for each column.
    fn cells(&self, baselines: &Evaluation) -> Vec<String> {
        let over = |value: &dyn Fn(&Trained) -> Option<f64>, digits| {
            let values: Vec<Option<f64>> = self.seeds.iter().map(value).collect();
            cell(&values, digits)
        };
        let free = COLUMNS
            .iter()
            .map(|(_, digits, value)| over(&|t| free_running(&t.evaluation.pooled).and_then(value), *digits));
        let one_step = over(
            &|t| Some(t.evaluation.pooled.model.as_ref()?.one_step.as_ref()?.rmse_mm),
            2,
        );
        let skinning = baselines.pooled.baselines.get("skinning");
        let limit = skinning.and_then(|s| s.free_running.as_ref()).map(|m| m.rmse_mm);
        let exceeds = |t: &Trained| {
            let drift = &free_running(&t.evaluation.pooled)?.drift_mm;
            let limit = limit?;
            // NaN belongs to a diverged run and exceeds every limit.
            let exceeds = |mm: &f64| mm.is_nan() || *mm > limit;
            Some((drift.iter().position(exceeds)? + 1) as f64)
        };
        let last = [
            one_step,
            over(&|t| worst_against_linear(&t.evaluation, baselines), 2),
            over(&exceeds, 0),
            over(&|t| Some(t.training_seconds), 0),
            over(&|t| Some(t.frame_ms), 2),
        ];
        free.chain(last).collect()
    }
}

/// Returns the metrics of a row in free running.
fn free_running(scores: &Scores) -> Option<&Metrics> {
    scores.model.as_ref()?.free_running.as_ref()
}

/// Returns the largest ratio over clips of a row's error to that of the better linear baseline.
fn worst_against_linear(evaluation: &Evaluation, baselines: &Evaluation) -> Option<f64> {
    let ratio = |(name, scores): (&String, &Scores)| {
        let linear = &baselines.clips.get(name)?.baselines;
        let error = |row: &str| Some(linear.get(row)?.free_running.as_ref()?.rmse_mm);
        let best = LINEAR.into_iter().filter_map(error).min_by(f64::total_cmp)?;
        Some(free_running(scores)?.rmse_mm / best)
    };
    evaluation.clips.iter().filter_map(ratio).max_by(f64::total_cmp)
}

/// Formats the mean of the seeds that have the number and, for several seeds, half the distance
/// between the extremes.
fn cell(values: &[Option<f64>], digits: usize) -> String {
    let known: Vec<f64> = values.iter().flatten().copied().collect();
    if known.is_empty() {
        return "–".to_owned();
    }
    // A mean over the other seeds would hide a diverged one.
    if known.iter().any(|v| !v.is_finite()) {
        return "diverged".to_owned();
    }
    let mean = known.iter().sum::<f64>() / known.len() as f64;
    let most = known.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = known.iter().copied().fold(f64::INFINITY, f64::min);
    match known.len() {
        1 => format!("{mean:.digits$}"),
        _ => format!("{mean:.digits$} ± {:.digits$}", (most - least) / 2.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_show_mean_and_spread_of_known_numbers() {
        assert_eq!(cell(&[Some(1.0), Some(3.0)], 1), "2.0 ± 1.0");
        assert_eq!(cell(&[Some(1.25)], 1), "1.2");
        assert_eq!(cell(&[Some(1.0), None], 0), "1");
        assert_eq!(cell(&[None], 0), "–");
        assert_eq!(cell(&[Some(1.0), Some(f64::NAN)], 0), "diverged");
    }
}
