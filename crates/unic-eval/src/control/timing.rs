//! Times of searches and steps, on one thread.

use super::{run::ControlRun, script::Player};
use std::{hint::black_box, time::Instant};
use unic_core::motion_matching::{Controller, ControllerError, Query, RootFrame, SearchScratch, TagFilter};

/// Runs over all queries before the one that counts: they fill the caches.
const WARM_UP: usize = 1;

/// Times, microseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Times {
    /// Median of a search over the whole database.
    pub(super) search: f64,
    /// 99th percentile of a search.
    pub(super) search_p99: f64,
    /// Median of a step, searches included where they are due.
    pub(super) step: f64,
    /// 99th percentile of a step.
    pub(super) step_p99: f64,
}

impl Times {
    /// Measures the searches and the steps of runs again.
    pub(super) fn measure(
        controller: &mut Controller,
        runs: &[ControlRun],
        seed: u64,
    ) -> Result<Self, ControllerError> {
        let searches = searches(controller, runs);
        let steps = steps(controller, runs, seed)?;
        Ok(Self {
            search: quantile(&searches, 0.5),
            search_p99: quantile(&searches, 0.99),
            step: quantile(&steps, 0.5),
            step_p99: quantile(&steps, 0.99),
        })
    }
}

/// Searches for every query of the runs, without a frame that continues and without a window.
fn searches(controller: &Controller, runs: &[ControlRun]) -> Vec<f64> {
    let mut scratch = SearchScratch::default();
    let mut times = Vec::new();
    for _ in 0..=WARM_UP {
        times.clear();
        for features in runs.iter().flat_map(|run| &run.queries) {
            let query = Query {
                features,
                tags: TagFilter::default(),
                window: 0..0,
                continuing: None,
            };
            let started = Instant::now();
            black_box(controller.database().search(&query, &mut scratch));
            times.push(started.elapsed().as_secs_f64() * 1e6);
        }
    }
    times
}

fn steps(controller: &mut Controller, runs: &[ControlRun], seed: u64) -> Result<Vec<f64>, ControllerError> {
    let mut times = Vec::new();
    for run in runs {
        controller.reset(RootFrame::default());
        let mut player = Player::new(run.script, seed);
        for tick in 0..run.ticks.len() {
            let command = player.command(tick as f32 / run.fps, controller.state().object());
            let started = Instant::now();
            black_box(controller.step(&command)?);
            times.push(started.elapsed().as_secs_f64() * 1e6);
        }
    }
    Ok(times)
}

fn quantile(values: &[f64], share: f64) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let at = (values.len() as f64 * share) as usize;
    values.get(at).copied().unwrap_or(f64::NAN)
}
