//! Measurement of many instances of one model: characters in the same garment.

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
use unic_core::{Animator, Start, parallel::Serial};

/// Longest time of all rounds after the first, if one is complete.
const LONGEST: Duration = Duration::from_secs(1);
/// Number of frames that an instance is ahead of the one before, so that instances differ.
const AHEAD: usize = 7;

/// Time and memory of each of many instances.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Instances {
    /// Number of instances.
    count: usize,
    /// Memory of an instance beside the shared model, bytes.
    pub(super) bytes: usize,
    /// Median wall-clock time of one frame of all instances, divided by their number, microseconds.
    pub(super) frame_us: f64,
}

impl Instances {
    /// Steps `count` instances. Each thread of the pool steps one at a time.
    pub(super) fn measure(animator: &Animator, scene: &Scene, count: NonZeroUsize) -> Result<Self> {
        let count = count.get();
        // The model is shared and already allocated: the difference is the memory of the instances.
        let before = HEAP.allocated();
        let mut crowd = vec![start(animator, scene, 0)?];
        // The first instance shows the size of all before the others are made.
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
        // At least one round, even of many instances on a slow machine.
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

/// Refuses more instances than half of the free memory holds. `bytes` is the size of one.
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

/// Returns an instance that has started at a frame of the scene.
fn start(animator: &Animator, scene: &Scene, frame: usize) -> Result<Animator> {
    interrupt::check()?;
    let mut instance = animator.clone();
    // Instances run in parallel with each other, which is faster than threads within each.
    instance.set_threads(Arc::new(Serial));
    instance.reset(&scene.input(frame), Start::MeanShape)?;
    Ok(instance)
}
