//! Progress of several trainings that run at once, and the request to stop them.

use crate::event::Control;
use std::sync::atomic::{AtomicU64, Ordering};

/// Callback of the prior's training, called after every step, from several threads: steps done and
/// steps in all. After a stop it must always answer stop.
pub type Watch<'a> = dyn Fn(u64, u64) -> Control + Sync + 'a;

/// Steps done by all trainings together.
pub(super) struct Progress<'a> {
    done: AtomicU64,
    all: u64,
    watch: &'a Watch<'a>,
}

impl<'a> Progress<'a> {
    pub(super) fn new(all: u64, watch: &'a Watch<'a>) -> Self {
        Self {
            done: AtomicU64::new(0),
            all,
            watch,
        }
    }

    /// Counts steps and asks the callback whether to go on.
    pub(super) fn add(&self, steps: u64) -> Control {
        // Relaxed is enough: the counter orders no other memory access.
        let done = self.done.fetch_add(steps, Ordering::Relaxed) + steps;
        (self.watch)(done, self.all)
    }
}
