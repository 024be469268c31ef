//! What `unic bench` prints.

use super::{error::AddedError, instances::Instances, machine::Machine, timing::Timing};
use crate::{
    args::SpeedArgs,
    output::{print, print_json},
};
use anyhow::Result;
use serde::Serialize;
use std::{collections::BTreeMap, fmt};
use unic_core::{animator::Stage, model::Model};

/// The JSON contract.
#[derive(Serialize)]
pub(super) struct Report {
    machine: Machine,
    /// A graphics processor's name; none is measured.
    adapter: Option<String>,
    pub(super) cases: Vec<Case>,
}

#[derive(Serialize)]
pub(super) struct Case {
    vertices: usize,
    network: String,
    precision: &'static str,
    device: &'static str,
    threads: usize,
    sampling_percent: f64,
    /// Median.
    frame_ms: f64,
    /// What nine of ten frames take longer than.
    frame_tenth_ms: f64,
    fps: f64,
    /// Encoder and field, mean of five runs.
    forward_only_ms: f64,
    /// One step, against f32 at full sampling; none for random weights.
    added_rmse_mm: Option<f64>,
    /// The same after up to 10 s of free running.
    added_free_running_rmse_mm: Option<f64>,
    /// Many at once that share the model; none where none were asked for.
    pub(super) instances: Option<Instances>,
    /// Medians.
    stages_ms: BTreeMap<&'static str, f64>,
    /// What nine of ten frames take longer for.
    stages_tenth_ms: BTreeMap<&'static str, f64>,
}

impl Report {
    pub(super) fn new() -> Self {
        Self {
            machine: Machine::this(),
            adapter: None,
            cases: Vec::new(),
        }
    }

    pub(super) fn show(&self, args: &SpeedArgs) -> Result<()> {
        if args.json {
            return print_json(self);
        }
        let mut text = format!("{}\n\n{HEADER}\n", self.machine.line());
        self.cases.iter().for_each(|case| text += &format!("{case}\n"));
        print(&text)
    }
}

impl Case {
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
            fps: 1e3 / timing.frame,
            forward_only_ms: timing.forward,
            added_rmse_mm: error.map(|e| e.one_step),
            added_free_running_rmse_mm: error.map(|e| e.free_running),
            instances: None,
            stages_ms: by_name(&timing.stages),
            stages_tenth_ms: by_name(&timing.stages_tenth),
        }
    }

    fn stage(&self, name: &str) -> f64 {
        self.stages_ms.get(name).copied().unwrap_or(f64::NAN)
    }
}

fn by_name(stages: &[(Stage, f64)]) -> BTreeMap<&'static str, f64> {
    stages.iter().map(|(stage, ms)| (stage.name(), *ms)).collect()
}

const HEADER: &str = "vertices network  precision sampled threads  frame ms     fps  forward  encoder    field   skin  \
                      inters.  normals  each us  each KiB  +RMSE mm  +RMSE free";

impl fmt::Display for Case {
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
            " {:6.2} {:8.2}",
            self.stage("skinning"),
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
