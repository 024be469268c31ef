//! Progress of several trainings that run at once, and the request to stop them.

use crate::event::Control;
use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicU64, Ordering},
};

/// Callback of the prior's training, called after every step, from several threads: steps done and
/// steps in all. After a stop it must always answer stop.
pub type Watch<'a> = dyn Fn(u64, u64) -> Control + Sync + 'a;

/// Steps done by all trainings together.
pub(super) struct Progress<'a> {
    done: AtomicU64,
    all: u64,
    watch: &'a Watch<'a>,
    /// Seconds of training that checkpoints had done.
    restored_seconds: Mutex<f64>,
}

impl<'a> Progress<'a> {
    pub(super) fn new(all: u64, watch: &'a Watch<'a>) -> Self {
        Self {
            done: AtomicU64::new(0),
            all,
            watch,
            restored_seconds: Mutex::new(0.0),
        }
    }

    /// Counts steps and asks the callback whether to go on.
    pub(super) fn add(&self, steps: u64) -> Control {
        // Relaxed is enough: the counter orders no other memory access.
        let done = self.done.fetch_add(steps, Ordering::Relaxed) + steps;
        (self.watch)(done, self.all)
    }

    /// Counts seconds of training that a checkpoint had done.
    pub(super) fn add_restored(&self, seconds: f64) {
        // A poisoned lock means that another training panicked; the sum is sound all the same.
        *self
            .restored_seconds
            .lock()
            .unwrap_or_else(PoisonError::into_inner) += seconds;
    }

    /// Seconds of training that checkpoints had done, of all trainings together.
    pub(super) fn restored_seconds(self) -> f64 {
        self.restored_seconds
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
