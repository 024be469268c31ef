//! The library's own worker threads.
//!
//! A pool allocates nothing while it works, unlike rayon's, whose queue grows by blocks.

use crate::{error::Error, job::JobSlot};
use std::{
    sync::{
        Arc, Condvar, Mutex, PoisonError, Weak,
        atomic::{AtomicU64, Ordering},
    },
    thread::JoinHandle,
};
use unic_core::Threads;

/// Looks at the round before a worker sleeps. A step has several jobs, some microseconds apart, and
/// waking a thread takes longer than that.
const SPINS: u32 = 500;

/// Worker threads that instances with the same number of threads share.
#[derive(Debug)]
pub(crate) struct Pool {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    slot: JobSlot,
    /// Number of jobs so far; [`STOP`] ends the workers.
    round: AtomicU64,
    /// Guards changes of `round` against workers that are about to sleep.
    sleep: Mutex<()>,
    wake: Condvar,
}

/// Round in which workers end.
const STOP: u64 = u64::MAX;

/// Pools in use, one for each number of threads.
static POOLS: Mutex<Vec<Weak<Pool>>> = Mutex::new(Vec::new());

impl Pool {
    /// Finds or starts the pool of `count` threads, the calling one included.
    ///
    /// # Errors
    /// Threads that the system does not start.
    pub(crate) fn shared(count: usize) -> Result<Arc<Self>, Error> {
        let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
        pools.retain(|pool| pool.strong_count() > 0);
        let mut alive = pools.iter().filter_map(Weak::upgrade);
        if let Some(pool) = alive.find(|pool| pool.workers.len() + 1 == count) {
            return Ok(pool);
        }
        let pool = Arc::new(Self::start(count)?);
        pools.push(Arc::downgrade(&pool));
        Ok(pool)
    }

    fn start(count: usize) -> Result<Self, Error> {
        let mut pool = Self {
            shared: Arc::default(),
            workers: Vec::new(),
        };
        for _ in 1..count {
            let shared = Arc::clone(&pool.shared);
            let thread = std::thread::Builder::new().name("unic".to_owned());
            // Workers that have started end with the pool.
            pool.workers
                .push(thread.spawn(move || shared.work()).map_err(Error::Threads)?);
        }
        Ok(pool)
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.shared.announce(|_| STOP);
        for worker in self.workers.drain(..) {
            // A worker catches the panics of jobs, and there is nothing else that could panic.
            let _ = worker.join();
        }
    }
}

impl Threads for Pool {
    fn thread_count(&self) -> usize {
        self.workers.len() + 1
    }

    fn run(&self, _: usize, job: &(dyn Fn() + Sync)) {
        self.shared.slot.offer(job, || {
            self.shared.announce(|round| round + 1);
            job();
        });
    }
}

impl Shared {
    fn announce(&self, next: impl Fn(u64) -> u64) {
        let _sleep = self.sleep.lock().unwrap_or_else(PoisonError::into_inner);
        let round = self.round.load(Ordering::Relaxed);
        self.round.store(next(round), Ordering::Release);
        self.wake.notify_all();
    }

    /// Loop of a worker.
    fn work(&self) {
        let mut seen = 0;
        loop {
            seen = self.next_round(seen);
            if seen == STOP {
                return;
            }
            self.slot.enter();
        }
    }

    /// Waits until the round is another than `seen`.
    fn next_round(&self, seen: u64) -> u64 {
        for _ in 0..SPINS {
            let round = self.round.load(Ordering::Acquire);
            if round != seen {
                return round;
            }
            std::hint::spin_loop();
        }
        let mut sleep = self.sleep.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            let round = self.round.load(Ordering::Acquire);
            if round != seen {
                return round;
            }
            sleep = self.wake.wait(sleep).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    #[test]
    fn a_job_runs_on_all_threads_at_once() {
        let pool = Pool::start(3).unwrap();
        assert_eq!(pool.thread_count(), 3);
        let arrived = AtomicUsize::new(0);
        // Ends only when three threads are in it.
        pool.run(3, &|| {
            arrived.fetch_add(1, Ordering::SeqCst);
            while arrived.load(Ordering::SeqCst) < 3 {
                std::thread::yield_now();
            }
        });
        assert_eq!(arrived.into_inner(), 3);
    }

    #[test]
    fn pools_of_one_size_are_shared_and_end_with_their_last_user() {
        let (a, b) = (Pool::shared(2).unwrap(), Pool::shared(2).unwrap());
        assert!(Arc::ptr_eq(&a, &b) && !Arc::ptr_eq(&a, &Pool::shared(1).unwrap()));
        let shared = Arc::downgrade(&a.shared);
        drop((a, b));
        assert!(shared.upgrade().is_none(), "a worker is still alive");
    }
}
