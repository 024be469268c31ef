//! `metrics.jsonl`: the curves of a run.

use anyhow::{Result, anyhow};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::{
    fs::{self, File, OpenOptions},
    io::Write,
    path::{Path, PathBuf},
};
use unic_io::atomic;
use unic_train::Event;

/// Steps that a line about training is the mean of.
const STEPS_A_LINE: u64 = 50;

/// Writes one JSON object a line: `step`, `loss`, `gradient_norm` (means over the steps since the
/// line before), `learning_rate`, `seconds` every 50 steps; `step`, `validation_rmse_mm`, `best_mm`,
/// `seconds` a validation. `seconds` counts from the beginning of the run, over all resumes.
pub(crate) struct MetricsLog {
    path: PathBuf,
    file: File,
    seconds: f64,
    loss: f64,
    gradient_norm: f64,
    steps: u64,
}

/// The part of a line that says where it belongs.
#[derive(Deserialize)]
struct Line {
    step: u64,
}

impl MetricsLog {
    /// Goes on after `step` and `seconds`: later lines, and a line that a crash has cut short, go.
    pub(crate) fn open(path: &Path, step: u64, seconds: f64) -> Result<Self> {
        let failed = |e: std::io::Error| anyhow!("{}: cannot write: {e}", path.display());
        if path.exists() {
            let text = fs::read_to_string(path).map_err(failed)?;
            atomic::write(path, kept(&text, step).as_bytes())?;
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
            seconds,
            loss: 0.0,
            gradient_norm: 0.0,
            steps: 0,
        })
    }

    /// Takes part in a run.
    pub(crate) fn observe(&mut self, event: &Event) -> Result<()> {
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
            Event::Validated {
                step,
                rmse,
                best,
                seconds,
            } => {
                self.seconds += seconds;
                let (rmse, best, seconds) = (1e3 * rmse, 1e3 * best, self.seconds);
                self.write(&json!({
                    "step": step, "validation_rmse_mm": rmse, "best_mm": best, "seconds": seconds
                }))
            }
            Event::Saved { .. } => Ok(()),
        }
    }

    fn write_step(&mut self, step: u64, learning_rate: f64) -> Result<()> {
        let mean = |sum: f64| sum / self.steps as f64;
        let line = json!({
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
        // One call a line: a reader, or a crash, finds whole lines.
        let line = format!("{}\n", serde_json::to_string(line)?);
        self.file
            .write_all(line.as_bytes())
            .map_err(|e| anyhow!("{}: cannot write: {e}", self.path.display()))
    }
}

/// The whole lines up to a step.
fn kept(text: &str, step: u64) -> String {
    let belongs = |line: &&str| serde_json::from_str::<Line>(line).is_ok_and(|line| line.step <= step);
    text.lines()
        .filter(belongs)
        .map(|line| format!("{line}\n"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn lines_are_means_and_go_on_where_the_checkpoint_does() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.jsonl");
        let mut log = MetricsLog::open(&path, 0, 0.0).unwrap();
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
        let means =
            json!({"step": 100, "loss": 0.5, "gradient_norm": 1.0, "learning_rate": 0.5, "seconds": 200.0});
        assert_eq!(lines[1], means);
        let validated = json!({"step": 100, "validation_rmse_mm": 500.0, "best_mm": 250.0, "seconds": 201.0});
        assert_eq!(lines[2], validated);
        fs::write(&path, format!("{text}{{\"step\": 1")).unwrap();
        MetricsLog::open(&path, 60, 120.0).unwrap();
        let after = fs::read_to_string(&path).unwrap();
        assert_eq!(after.lines().collect::<Vec<_>>(), [text.lines().next().unwrap()]);
    }
}
