//! Threads that a step works on.

use crate::error::{Error, Result};
use std::sync::{Arc, OnceLock};
use unic_core::{
    Threads,
    parallel::{Rayon, Serial, install},
};

/// Largest number of threads of one animator.
const MOST: i64 = 256;

/// Threads of an animator, and the process that they belong to.
#[derive(Clone)]
pub(crate) struct Workers {
    threads: Arc<dyn Threads>,
    /// Process that has started the threads; none if there are none.
    process: Option<u32>,
}

/// Threads of a pool of its own.
#[derive(Debug)]
struct Pool(rayon::ThreadPool);

impl Threads for Pool {
    fn thread_count(&self) -> usize {
        self.0.current_num_threads()
    }

    fn run(&self, jobs: usize, job: &(dyn Fn() + Sync)) {
        self.0.install(|| Rayon.run(jobs, job));
    }
}

impl Workers {
    /// Chooses the threads: one for every core, the calling one alone, or a number.
    ///
    /// # Errors
    /// A number out of range, threads that the system does not start, every core in a fork.
    pub(crate) fn new(count: Option<i64>) -> Result<Self> {
        let own = Some(std::process::id());
        let (threads, process): (Arc<dyn Threads>, _) = match count {
            None => (Arc::new(Rayon), Some(process_of_all_cores())),
            Some(1) => (Arc::new(Serial), None),
            Some(count @ 2..=MOST) => {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(count.unsigned_abs() as usize);
                let pool = pool
                    .build()
                    .map_err(|e| Error::Fault(format!("cannot start threads: {e}")))?;
                (Arc::new(Pool(pool)), own)
            }
            Some(count) => {
                return Err(Error::value(
                    "threads",
                    format!("a number from 1 to {MOST}"),
                    count,
                ));
            }
        };
        let workers = Self { threads, process };
        workers.check_process()?;
        Ok(workers)
    }

    /// Threads for an animator.
    pub(crate) fn threads(&self) -> Arc<dyn Threads> {
        Arc::clone(&self.threads)
    }

    /// Checks that the threads exist: a process that is forked has none of its parent's, and would
    /// wait for them for ever.
    ///
    /// # Errors
    /// Another process than the one that has started the threads.
    pub(crate) fn check_process(&self) -> Result<()> {
        match self.process {
            Some(process) if process != std::process::id() => Err(Error::value(
                "animator",
                "the process that has started its threads",
                "a fork of it; use threads=1, or start processes by 'spawn'",
            )),
            _ => Ok(()),
        }
    }
}

/// Runs work on one thread for every core, and in a fork of the process that has first done so on the
/// calling thread alone: a fork has no others.
pub(crate) fn on_own_threads<T>(work: impl FnOnce() -> T) -> T {
    match process_of_all_cores() == std::process::id() {
        true => work(),
        false => install(Arc::new(Serial), work),
    }
}

/// Process that has first used one thread for every core.
fn process_of_all_cores() -> u32 {
    static PROCESS: OnceLock<u32> = OnceLock::new();
    *PROCESS.get_or_init(std::process::id)
}
