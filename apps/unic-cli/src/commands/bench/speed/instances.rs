//! Many characters in the same garment: instances that share one model.

use super::scene::Scene;
use crate::{HEAP, interrupt};
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

/// Rounds end after so long, if there are [`FEWEST`].
const LONGEST: Duration = Duration::from_secs(1);
const FEWEST: usize = 3;
/// Frames that an instance is ahead of the one before.
const AHEAD: usize = 7;

/// What each of many instances takes.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Instances {
    count: usize,
    /// That an instance allocates beside the shared model.
    pub(super) bytes: usize,
    /// The fastest round of one frame for each, by their number: microseconds by the clock.
    pub(super) frame_us: f64,
}

impl Instances {
    /// One thread steps an instance, all threads of the pool as many at once.
    pub(super) fn measure(animator: &Animator, scene: &Scene, count: NonZeroUsize) -> Result<Self> {
        let count = count.get();
        let before = HEAP.current_usage();
        let mut crowd = (0..count)
            .map(|instance| start(animator, scene, instance * AHEAD))
            .collect::<Result<Vec<Animator>>>()?;
        let mut round = |t: usize| -> Result<()> {
            interrupt::check()?;
            let instances = crowd.par_iter_mut().enumerate();
            instances.try_for_each(|(instance, animator)| -> Result<()> {
                animator.step(&scene.input(instance * AHEAD + t))?;
                Ok(())
            })
        };
        // What a frame needs is allocated by the first.
        round(1)?;
        let bytes = HEAP.current_usage().saturating_sub(before) / count;
        let (started, mut rounds) = (Instant::now(), 0);
        let mut fastest = Duration::MAX;
        while rounds < FEWEST || started.elapsed() < LONGEST {
            let begun = Instant::now();
            round(2 + rounds)?;
            fastest = fastest.min(begun.elapsed());
            rounds += 1;
        }
        Ok(Self {
            count,
            bytes,
            frame_us: fastest.as_secs_f64() * 1e6 / count as f64,
        })
    }
}

fn start(animator: &Animator, scene: &Scene, frame: usize) -> Result<Animator> {
    let mut instance = animator.clone();
    instance.set_threads(Arc::new(Serial));
    instance.reset(&scene.input(frame), Start::MeanShape)?;
    Ok(instance)
}
