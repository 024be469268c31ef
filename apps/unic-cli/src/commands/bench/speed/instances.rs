//! Many characters in the same garment: instances that share one model.

use super::{scene::Scene, timing::quantile};
use crate::{HEAP, failure::Usage, interrupt, limits};
use anyhow::Result;
use rayon::prelude::*;
use serde::Serialize;
use std::{
    num::NonZeroUsize,
    sync::Arc,
    time::{Duration, Instant},
};
use unic_core::{
    animator::{Animator, Start},
    parallel::Serial,
};

/// Rounds end after so long, if there is one.
const LONGEST: Duration = Duration::from_secs(1);
/// Frames that an instance is ahead of the one before.
const AHEAD: usize = 7;

/// What each of many instances takes.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Instances {
    count: usize,
    /// That an instance allocates beside the shared model.
    pub(super) bytes: usize,
    /// The median time of one frame of all of them, by their number: microseconds by the clock.
    pub(super) frame_us: f64,
}

impl Instances {
    /// One thread steps an instance, all threads of the pool as many at once.
    pub(super) fn measure(animator: &Animator, scene: &Scene, count: NonZeroUsize) -> Result<Self> {
        let count = count.get();
        let before = HEAP.allocated();
        let mut crowd = vec![start(animator, scene, 0)?];
        check_memory(HEAP.allocated().saturating_sub(before), count)?;
        for instance in 1..count {
            crowd.push(start(animator, scene, instance * AHEAD)?);
        }
        let mut round = |t: usize| -> Result<f64> {
            let begun = Instant::now();
            let instances = crowd.par_iter_mut().enumerate();
            instances.try_for_each(|(instance, animator)| -> Result<()> {
                interrupt::check()?;
                animator.step(&scene.input(instance * AHEAD + t))?;
                Ok(())
            })?;
            Ok(begun.elapsed().as_secs_f64() * 1e6)
        };
        // The first round fills caches and buffers.
        round(1)?;
        let (started, mut rounds) = (Instant::now(), Vec::new());
        while rounds.is_empty() || started.elapsed() < LONGEST {
            rounds.push(round(2 + rounds.len())?);
        }
        Ok(Self {
            count,
            bytes: HEAP.allocated().saturating_sub(before) / count,
            frame_us: quantile(rounds.into_iter(), 0.5) / count as f64,
        })
    }
}

/// `bytes`: of one instance.
fn check_memory(bytes: usize, count: usize) -> Result<()> {
    let most = limits::memory_bytes() / bytes.max(1) as u64;
    match count as u64 <= most {
        true => Ok(()),
        false => Err(Usage(format!(
            "--instances: expected at most {most}, which fit into half of the free memory at {:.1} MB each, found {count}",
            bytes as f64 / 1e6
        ))
        .into()),
    }
}

fn start(animator: &Animator, scene: &Scene, frame: usize) -> Result<Animator> {
    interrupt::check()?;
    let mut instance = animator.clone();
    instance.set_threads(Arc::new(Serial));
    instance.reset(&scene.input(frame), Start::MeanShape)?;
    Ok(instance)
}
