//! Result of `unic bench`: JSON for programs, a table for people.

use super::{error::AddedError, instances::Instances, machine::Machine, timing::Timing};
use crate::{
    args::BenchArgs,
    output::{print, print_json},
};
use anyhow::Result;
use serde::Serialize;
use std::{collections::BTreeMap, fmt};
use unic_core::{Model, animator::Stage};

/// Result of the benchmark. The JSON form is a public contract.
#[derive(Serialize)]
pub(super) struct SpeedReport {
    machine: Machine,
    /// Name of a graphics processor. `None`: none is measured.
    adapter: Option<String>,
    pub(super) cases: Vec<BenchmarkCase>,
}

/// One measured case: a model in one precision with one sampling, on a number of threads.
#[derive(Serialize)]
pub(super) struct BenchmarkCase {
    vertices: usize,
    network: String,
    precision: &'static str,
    device: &'static str,
    threads: usize,
    sampling_percent: f64,
    /// Median time of a frame, milliseconds.
    frame_ms: f64,
    /// Time that nine of ten frames exceed, milliseconds.
    frame_tenth_ms: f64,
    fps: f64,
    /// Time of encoder and field, mean of five runs, milliseconds.
    forward_only_ms: f64,
    /// Error of one step against f32 at all vertices, millimetres. `None` for random weights.
    added_rmse_mm: Option<f64>,
    /// Error after up to 10 s of free running, millimetres. `None` for random weights.
    added_free_running_rmse_mm: Option<f64>,
    /// Time and memory of many instances that share the model. `None` where none are asked for.
    pub(super) instances: Option<Instances>,
    /// Median time of each stage, milliseconds.
    stages_ms: BTreeMap<&'static str, f64>,
    /// Time of each stage that nine of ten frames exceed, milliseconds.
    stages_tenth_ms: BTreeMap<&'static str, f64>,
}

impl SpeedReport {
    pub(super) fn new() -> Self {
        Self {
            machine: Machine::this(),
            adapter: None,
            cases: Vec::new(),
        }
    }

    /// Prints the result as JSON or as a table.
    pub(super) fn show(&self, args: &BenchArgs) -> Result<()> {
        if args.json {
            return print_json(self);
        }
        let mut text = format!("{}\n\n{HEADER}\n", self.machine.line());
        self.cases.iter().for_each(|case| text += &format!("{case}\n"));
        print(&text)
    }
}

impl BenchmarkCase {
    pub(super) fn new(
        network: &str,
        model: &Model,
        threads: usize,
        timing: Timing,
        error: Option<AddedError>,
    ) -> Self {
        Self {
            vertices: model.vertex_count(),
            network: network.to_owned(),
            precision: model.precision().name(),
            device: "cpu",
            threads,
            sampling_percent: model.sampling().map_or(100.0, |s| 100.0 * f64::from(s.share())),
            frame_ms: timing.frame,
            frame_tenth_ms: timing.frame_tenth,
            // Frames per second of the median frame, not of the mean.
            fps: 1e3 / timing.frame,
            forward_only_ms: timing.forward,
            added_rmse_mm: error.map(|e| e.one_step),
            added_free_running_rmse_mm: error.map(|e| e.free_running),
            instances: None,
            stages_ms: by_name(&timing.stages),
            stages_tenth_ms: by_name(&timing.stages_tenth),
        }
    }

    /// Returns the median time of a stage, milliseconds.
    fn stage(&self, name: &str) -> f64 {
        self.stages_ms.get(name).copied().unwrap_or(f64::NAN)
    }
}

/// Returns times by the name of their stage.
fn by_name(stages: &[(Stage, f64)]) -> BTreeMap<&'static str, f64> {
    stages.iter().map(|(stage, ms)| (stage.name(), *ms)).collect()
}

/// Heading of the table.
const HEADER: &str = "vertices network  precision sampled threads  frame ms     fps  forward  encoder    field   skin  \
                      strain  inters.  normals  each us  each KiB  +RMSE mm  +RMSE free";

impl fmt::Display for BenchmarkCase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (vertices, network, precision) = (self.vertices, &self.network, self.precision);
        write!(
            f,
            "{vertices:8} {network:8} {precision:9} {:5.1} % {:7}",
            self.sampling_percent, self.threads
        )?;
        write!(
            f,
            " {:9.2} {:7.1} {:8.2}",
            self.frame_ms, self.fps, self.forward_only_ms
        )?;
        write!(f, " {:8.2} {:8.2}", self.stage("encoder"), self.stage("field"))?;
        write!(
            f,
            " {:6.2} {:7.2} {:8.2}",
            self.stage("skinning"),
            self.stage("projection"),
            self.stage("intersections")
        )?;
        write!(f, " {:8.2}", self.stage("normals"))?;
        match &self.instances {
            Some(each) => write!(f, " {:8.0} {:9.0}", each.frame_us, each.bytes as f64 / 1024.0)?,
            None => write!(f, " {:>8} {:>9}", "-", "-")?,
        }
        for error in [self.added_rmse_mm, self.added_free_running_rmse_mm]
            .into_iter()
            .flatten()
        {
            write!(f, " {error:9.3}")?;
        }
        Ok(())
    }
}
