//! Times of a frame, whole and by stage.

use super::scene::Scene;
use crate::interrupt;
use anyhow::Result;
use std::{
    hint::black_box,
    time::{Duration, Instant},
};
use unic_core::animator::{Animator, Stage, Start};

/// A case ends after so long, if it has [`FEWEST`] frames.
const LONGEST: Duration = Duration::from_secs(2);
const FEWEST: usize = 7;
/// Frames before the first that counts: caches and buffers fill.
const WARM_UP: usize = 3;
/// Runs of the networks that the paper takes the mean of.
const FORWARD_RUNS: usize = 5;

/// Milliseconds.
#[derive(Clone, Debug)]
pub(super) struct Timing {
    /// Median of frames.
    pub(super) frame: f64,
    /// What nine of ten frames take longer than: what is left of the others' load on the machine.
    pub(super) frame_tenth: f64,
    /// Encoder and field, mean of five frames.
    pub(super) forward: f64,
    /// Medians.
    pub(super) stages: Vec<(Stage, f64)>,
    /// Of each stage, what nine of ten frames take longer for.
    pub(super) stages_tenth: Vec<(Stage, f64)>,
}

impl Timing {
    pub(super) fn measure(mut animator: Animator, scene: &Scene, most: usize) -> Result<Self> {
        animator.reset(&scene.input(0), Start::MeanShape)?;
        let (started, mut frames) = (Instant::now(), Vec::new());
        for t in 1..=WARM_UP + most.max(FORWARD_RUNS) {
            interrupt::check()?;
            let times = frame(&mut animator, scene, t)?;
            if t > WARM_UP {
                frames.push(times);
            }
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

/// Milliseconds of each stage of one frame; together they are the frame.
fn frame(animator: &mut Animator, scene: &Scene, t: usize) -> Result<[f64; Stage::ALL.len()]> {
    let mut times = [0.0; Stage::ALL.len()];
    let mut last = Instant::now();
    let garment = animator.step_observed(&scene.input(t), &mut |stage| {
        let now = Instant::now();
        times[stage as usize] += (now - last).as_secs_f64() * 1e3;
        last = now;
    })?;
    black_box(garment.positions);
    Ok(times)
}

pub(super) fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let at = (values.len() as f64 * share) as usize;
    values.get(at).copied().unwrap_or(f64::NAN)
}
