//! Times of a frame and of its stages.

use super::scene::Scene;
use crate::interrupt;
use anyhow::Result;
use std::{
    hint::black_box,
    time::{Duration, Instant},
};
use unic_core::{Animator, Start, animator::Stage};

/// Time after which a case ends, if it has [`FEWEST`] frames.
const LONGEST: Duration = Duration::from_secs(2);
/// Least number of frames of a case.
const FEWEST: usize = 7;
/// Number of frames before the first that counts. They fill caches and buffers.
const WARM_UP: usize = 3;
/// Number of runs of the networks whose mean the paper reports.
const FORWARD_RUNS: usize = 5;

/// Times of a case, milliseconds.
#[derive(Clone, Debug)]
pub(super) struct Timing {
    /// Median of the frames.
    pub(super) frame: f64,
    /// Time that nine of ten frames exceed. It depends less on other programs on the machine than
    /// the median.
    pub(super) frame_tenth: f64,
    /// Encoder and field, mean of five frames.
    pub(super) forward: f64,
    /// Median of each stage.
    pub(super) stages: Vec<(Stage, f64)>,
    /// Time of each stage that nine of ten frames exceed.
    pub(super) stages_tenth: Vec<(Stage, f64)>,
}

impl Timing {
    /// Steps at most `most` frames, after a warm-up.
    pub(super) fn measure(mut animator: Animator, scene: &Scene, most: usize) -> Result<Self> {
        animator.reset(&scene.input(0), Start::MeanShape)?;
        let (started, mut frames) = (Instant::now(), Vec::new());
        for t in 1..=WARM_UP + most.max(FORWARD_RUNS) {
            interrupt::check()?;
            let times = frame(&mut animator, scene, t)?;
            if t > WARM_UP {
                frames.push(times);
            }
            // A slow case still needs enough frames for a median.
            if started.elapsed() > LONGEST && frames.len() >= FEWEST {
                break;
            }
        }
        let of = |stage: Stage| frames.iter().map(move |f| f[stage as usize]);
        let forward = (frames.iter().rev().take(FORWARD_RUNS))
            .map(|f| f[Stage::Encoder as usize] + f[Stage::Field as usize]);
        let whole = || frames.iter().map(|f| f.iter().sum::<f64>());
        Ok(Self {
            frame: quantile(whole(), 0.5),
            frame_tenth: quantile(whole(), 0.1),
            forward: forward.sum::<f64>() / FORWARD_RUNS as f64,
            stages: Stage::ALL.map(|s| (s, quantile(of(s), 0.5))).to_vec(),
            stages_tenth: Stage::ALL.map(|s| (s, quantile(of(s), 0.1))).to_vec(),
        })
    }
}

/// Steps one frame. Returns the time of each stage, milliseconds. Their sum is the time of the
/// frame.
fn frame(animator: &mut Animator, scene: &Scene, t: usize) -> Result<[f64; Stage::ALL.len()]> {
    let mut times = [0.0; Stage::ALL.len()];
    let mut last = Instant::now();
    let garment = animator.step_observed(&scene.input(t), &mut |stage| {
        let now = Instant::now();
        times[stage as usize] += (now - last).as_secs_f64() * 1e3;
        last = now;
    })?;
    // Keeps the compiler from leaving out work whose result is not used.
    black_box(garment.positions);
    Ok(times)
}

/// Returns the value below which a share of the values lies.
pub(super) fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    // Times are not averaged: single frames are slowed down by other programs.
    values.sort_by(f64::total_cmp);
    let at = (values.len() as f64 * share) as usize;
    values.get(at).copied().unwrap_or(f64::NAN)
}
