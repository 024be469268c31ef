//! Result of all scripts, and its table.

use super::{
    metrics::ControlMetrics, reference::DataReference, run::ControlRun, script::Script, timing::Times,
};
use indexmap::IndexMap;
use serde::Serialize;
use std::{fmt, sync::Arc};
use unic_core::motion_matching::{Controller, ControllerError, ControllerSettings, Database, TagFilter};

/// Result of all scripts on one database. The JSON form is a public contract.
#[derive(Clone, Debug, Serialize)]
pub struct ControlReport {
    /// Metrics by script.
    pub scripts: IndexMap<&'static str, ControlMetrics>,
    /// Median time of a search over the whole database, microseconds.
    pub search_us: f64,
    /// 99th percentile of that time, microseconds.
    pub search_p99_us: f64,
    /// Median time of a step, microseconds.
    pub step_us: f64,
    /// 99th percentile of that time, microseconds. Steps that search are slower than the median.
    #[serde(skip)]
    pub step_p99_us: f64,
    /// Number of frames of the database, mirrored ones included.
    pub frames: usize,
}

impl ControlReport {
    /// Runs all scripts that have targets. `observe` gets each run.
    ///
    /// # Errors
    /// A command that is not finite, which no script gives, or an error of `observe`.
    pub fn measure<E: From<ControllerError>>(
        database: &Arc<Database>,
        settings: ControllerSettings,
        tags: TagFilter,
        seed: u64,
        observe: &mut dyn FnMut(&ControlRun) -> Result<(), E>,
    ) -> Result<Self, E> {
        let reference = DataReference::measure(database, tags);
        let mut controller = Controller::new(Arc::clone(database), settings);
        controller.set_tags(tags)?;
        let mut runs = Vec::new();
        let mut scripts = IndexMap::new();
        for script in Script::MEASURED {
            let run = ControlRun::new(&mut controller, script, seed)?;
            scripts.insert(script.name(), ControlMetrics::measure(&run, database, &reference));
            observe(&run)?;
            runs.push(run);
        }
        let times = Times::measure(&mut controller, &runs, seed)?;
        Ok(Self {
            scripts,
            search_us: times.search,
            search_p99_us: times.search_p99,
            step_us: times.step,
            step_p99_us: times.step_p99,
            frames: database.len(),
        })
    }
}

/// Target of a metric.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Name of the metric.
    pub metric: &'static str,
    /// Largest value that meets the target.
    pub most: f64,
    /// Value of a script; none where it has none.
    pub value: fn(&ControlMetrics) -> Option<f64>,
}

/// Targets of the metrics of a script.
pub const TARGETS: [Target; 8] = [
    target("trajectory m", 0.15, |m| Some(m.trajectory_error_m)),
    target("heading deg", 10.0, |m| Some(m.heading_error_deg)),
    target("response s", 0.8, |m| m.response_s),
    target("skating", 1.2, |m| Some(m.foot_skating_ratio)),
    target("transition", 1.5, |m| Some(m.transition_ratio)),
    target("stuck s", 1.0, |m| Some(m.stuck_s)),
    target("clamped %", 2.0, |m| Some(m.clamped_percent)),
    target("locked m/s", 0.01, |m| Some(m.locked_foot_m_s)),
];

const fn target(metric: &'static str, most: f64, value: fn(&ControlMetrics) -> Option<f64>) -> Target {
    Target { metric, most, value }
}

/// Targets of the times, microseconds.
const SEARCH_US: f64 = 50.0;
const STEP_US: f64 = 100.0;

impl fmt::Display for ControlReport {
    /// Writes a table: a row a script, a column a metric, the targets below. Missed targets have a
    /// star.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:13}", "script")?;
        TARGETS.iter().try_for_each(|t| write!(f, " {:>13}", t.metric))?;
        writeln!(f, " {:>11}", "adjusted m")?;
        for (name, metrics) in &self.scripts {
            write!(f, "{name:13}")?;
            for target in &TARGETS {
                match (target.value)(metrics) {
                    Some(value) => write!(f, " {:12.3}{}", value, mark(value, target.most))?,
                    None => write!(f, " {:>12} ", "-")?,
                }
            }
            writeln!(f, " {:11.2}", metrics.adjusted_m)?;
        }
        write!(f, "{:13}", "target")?;
        TARGETS.iter().try_for_each(|t| write!(f, " {:12.3} ", t.most))?;
        writeln!(f, "\n\n{} frames", self.frames)?;
        let search = mark(self.search_us, SEARCH_US);
        writeln!(
            f,
            "search {:.1} us{search} (99th percentile {:.1}), target {SEARCH_US}",
            self.search_us, self.search_p99_us
        )?;
        let step = mark(self.step_us, STEP_US);
        writeln!(
            f,
            "step   {:.1} us{step} (99th percentile {:.1}), target {STEP_US}",
            self.step_us, self.step_p99_us
        )?;
        write!(f, "* misses its target")
    }
}

fn mark(value: f64, most: f64) -> char {
    // Written so that NaN misses.
    if value <= most { ' ' } else { '*' }
}
