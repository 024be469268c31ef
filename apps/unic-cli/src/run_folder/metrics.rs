//! Training curves of a run, `metrics.jsonl`.

use anyhow::{Result, anyhow};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::{
    fs::{self, File, OpenOptions},
    io::Write,
    path::{Path, PathBuf},
};
use unic_io::atomic;
use unic_train::{Event, Fit};

/// Number of steps over which a line about training takes the mean.
const STEPS_A_LINE: u64 = 50;

/// Writer of `metrics.jsonl`, one JSON object per line. The keys are a contract:
///
/// | when | keys |
/// |---|---|
/// | every 50 steps | `fit`, `step`, `loss`, `gradient_norm`, `learning_rate`, `seconds` |
/// | every validation in free running | `fit`, `step`, `validation_rmse_mm`, `best_mm`, `seconds` |
/// | every measurement of one step | `fit`, `step`, `one_step_rmse_mm`, `seconds` |
///
/// `loss` and `gradient_norm` are means over the steps since the previous such line. A measurement
/// of one step has `validation_one_step_rmse_mm` too if clips are held out. `step` counts from the
/// beginning of the fit. `seconds` counts training time from the beginning of the run, over all
/// fits and resumes.
pub(crate) struct MetricsLog {
    path: PathBuf,
    file: File,
    fit: Fit,
    seconds: f64,
    loss: f64,
    gradient_norm: f64,
    steps: u64,
}

/// Position in a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunPosition {
    /// Present fit.
    pub(crate) fit: Fit,
    /// Number of steps done of that fit.
    pub(crate) step: u64,
    /// Training time of the run in seconds.
    pub(crate) seconds: f64,
}

/// Keys of a line that give its position. Compared in the order of the fields.
#[derive(Deserialize, PartialEq, PartialOrd)]
struct LinePosition {
    fit: Fit,
    step: u64,
}

impl MetricsLog {
    /// Opens the file to continue from a position. Removes later lines and incomplete ones.
    ///
    /// # Errors
    /// A file that cannot be read or written.
    pub(crate) fn open(path: &Path, now: RunPosition) -> Result<Self> {
        let failed = |e: std::io::Error| anyhow!("{}: cannot write: {e}", path.display());
        if path.exists() {
            let text = fs::read_to_string(path).map_err(failed)?;
            atomic::write(path, lines_until(&text, now).as_bytes())?;
        }
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(path)
            .map_err(failed)?;
        let path = path.to_path_buf();
        Ok(Self {
            path,
            file,
            fit: now.fit,
            seconds: now.seconds,
            loss: 0.0,
            gradient_norm: 0.0,
            steps: 0,
        })
    }

    /// Handles an event of the training.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn observe(&mut self, event: &Event) -> Result<()> {
        // Seconds are summed from the events instead of read from a clock: a resumed run continues
        // the sum of its checkpoint.
        match *event {
            Event::Step {
                step,
                loss,
                gradient_norm,
                learning_rate,
                seconds,
            } => {
                self.seconds += seconds;
                self.loss += f64::from(loss);
                self.gradient_norm += gradient_norm;
                self.steps += 1;
                if step.is_multiple_of(STEPS_A_LINE) {
                    self.write_step(step, learning_rate)
                } else {
                    Ok(())
                }
            }
            Event::OneStep {
                step,
                training_rmse,
                validation_rmse,
                seconds,
            } => {
                self.seconds += seconds;
                let mut line = json!({
                    "fit": self.fit, "step": step,
                    "one_step_rmse_mm": 1e3 * training_rmse, "seconds": self.seconds
                });
                if let Some(rmse) = validation_rmse {
                    line["validation_one_step_rmse_mm"] = json!(1e3 * rmse);
                }
                self.write(&line)
            }
            Event::Validated {
                step,
                rmse,
                best,
                seconds,
            } => {
                self.seconds += seconds;
                let (rmse, best, seconds) = (1e3 * rmse, 1e3 * best, self.seconds);
                self.write(&json!({
                    "fit": self.fit, "step": step,
                    "validation_rmse_mm": rmse, "best_mm": best, "seconds": seconds
                }))
            }
            Event::Measuring { .. } | Event::Previewed { .. } | Event::Saved { .. } => Ok(()),
        }
    }

    fn write_step(&mut self, step: u64, learning_rate: f64) -> Result<()> {
        // After a resume there may be fewer than `STEPS_A_LINE` steps since the previous line.
        let mean = |sum: f64| sum / self.steps as f64;
        let line = json!({
            "fit": self.fit,
            "step": step,
            "loss": mean(self.loss),
            "gradient_norm": mean(self.gradient_norm),
            "learning_rate": learning_rate,
            "seconds": self.seconds,
        });
        (self.loss, self.gradient_norm, self.steps) = (0.0, 0.0, 0);
        self.write(&line)
    }

    fn write(&mut self, line: &impl Serialize) -> Result<()> {
        // One call writes the whole line, so that readers and crashes see no half line.
        let line = format!("{}\n", serde_json::to_string(line)?);
        self.file
            .write_all(line.as_bytes())
            .map_err(|e| anyhow!("{}: cannot write: {e}", self.path.display()))
    }
}

/// Complete lines up to a position.
fn lines_until(text: &str, now: RunPosition) -> String {
    let last = LinePosition {
        fit: now.fit,
        step: now.step,
    };
    // A line that a crash has cut short does not parse.
    let belongs = |line: &&str| serde_json::from_str::<LinePosition>(line).is_ok_and(|line| line <= last);
    text.lines()
        .filter(belongs)
        .map(|line| format!("{line}\n"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn position(fit: Fit, step: u64, seconds: f64) -> RunPosition {
        RunPosition { fit, step, seconds }
    }

    fn step(step: u64, loss: f32) -> Event<'static> {
        Event::Step {
            step,
            loss,
            gradient_norm: 1.0,
            learning_rate: 0.5,
            seconds: 2.0,
        }
    }

    #[test]
    fn lines_are_means_and_continue_from_the_checkpoint() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.jsonl");
        let mut log = MetricsLog::open(&path, position(Fit::HeldOut, 0, 0.0)).unwrap();
        for i in 1..=100 {
            log.observe(&step(i, if i <= 50 { 4.0 } else { (i % 2) as f32 }))
                .unwrap();
        }
        log.observe(&Event::Validated {
            step: 100,
            rmse: 0.5,
            best: 0.25,
            seconds: 1.0,
        })
        .unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let lines: Vec<serde_json::Value> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
        let means = json!({"fit": "held_out", "step": 100, "loss": 0.5, "gradient_norm": 1.0, "learning_rate": 0.5, "seconds": 200.0});
        assert_eq!(lines[1], means);
        let validated = json!({"fit": "held_out", "step": 100, "validation_rmse_mm": 500.0, "best_mm": 250.0, "seconds": 201.0});
        assert_eq!(lines[2], validated);
        fs::write(&path, format!("{text}{{\"step\": 1")).unwrap();
        MetricsLog::open(&path, position(Fit::HeldOut, 60, 120.0)).unwrap();
        let after = fs::read_to_string(&path).unwrap();
        assert_eq!(after.lines().collect::<Vec<_>>(), [text.lines().next().unwrap()]);
    }

    #[test]
    fn a_second_fit_keeps_the_lines_of_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.jsonl");
        for fit in [Fit::HeldOut, Fit::AllClips] {
            let mut log = MetricsLog::open(&path, position(fit, 0, 0.0)).unwrap();
            (1..=100).for_each(|i| log.observe(&step(i, 1.0)).unwrap());
        }
        let lines = || -> Vec<(Fit, u64)> {
            let text = fs::read_to_string(&path).unwrap();
            let line = |l: &str| serde_json::from_str::<LinePosition>(l).unwrap();
            text.lines().map(line).map(|l| (l.fit, l.step)).collect()
        };
        let [first, second] = [Fit::HeldOut, Fit::AllClips].map(|fit| [(fit, 50), (fit, 100)]);
        assert_eq!(lines(), [first, second].concat());
        MetricsLog::open(&path, position(Fit::AllClips, 60, 0.0)).unwrap();
        assert_eq!(lines(), [&first[..], &second[..1]].concat());
        MetricsLog::open(&path, position(Fit::HeldOut, 60, 0.0)).unwrap();
        assert_eq!(lines(), first[..1]);
    }
}
