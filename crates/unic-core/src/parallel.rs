//! Threads for the work on many vertices, provided by the caller.
//!
//! For engines, which implement [`Threads`] over their own job system. An animator is given its
//! threads once ([`Animator::set_threads`](crate::Animator::set_threads)). For other calls,
//! [`install`] puts threads around a closure, as a rayon pool does:
//!
//! ```
//! use unic_core::parallel::{Threads, install};
//!
//! /// Stands for an engine's workers; here they are started for every call.
//! #[derive(Debug)]
//! struct Workers(usize);
//!
//! impl Threads for Workers {
//!     fn thread_count(&self) -> usize {
//!         self.0
//!     }
//!     fn run(&self, jobs: usize, job: &(dyn Fn() + Sync)) {
//!         std::thread::scope(|scope| {
//!             for _ in 1..jobs {
//!                 scope.spawn(job);
//!             }
//!             job();
//!         });
//!     }
//! }
//!
//! # use glam::Vec3;
//! # use unic_core::{folds::Folds, mesh::TriMesh, surface::Surface};
//! # let body = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
//! #     vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
//! # let surface = Surface::build(&body);
//! let mut folds = Folds::default();
//! install(std::sync::Arc::new(Workers(4)), || folds.find(&surface));
//! # Ok::<(), unic_core::mesh::MeshError>(())
//! ```
//!
//! Without installed threads, work runs on the current rayon pool ([`Rayon`]), or on the calling
//! thread if feature `rayon` is off.
//!
//! Results are the same bytes for all implementations. No result depends on how work is split, and
//! an implementation only decides when and where each part runs.

use std::{
    cell::RefCell,
    fmt::Debug,
    sync::{Arc, Mutex, PoisonError},
};

/// Worker threads of the caller.
pub trait Threads: Debug + Send + Sync {
    /// Number of threads that work at the same time, the calling one included; 0 counts as 1.
    fn thread_count(&self) -> usize;

    /// Calls `job` `jobs` times, in parallel where it can, and returns when all calls have
    /// returned.
    ///
    /// `jobs` is at most [`thread_count`](Self::thread_count). Each call takes one part of the work
    /// after another until none is left. A call that starts late finds nothing to do, and the
    /// caller of `run` does what is left afterwards. How often and where `job` is called therefore
    /// affects speed alone. A panic in `job` must be resumed on the thread that called `run`.
    fn run(&self, jobs: usize, job: &(dyn Fn() + Sync));
}

/// [`Threads`] that are the calling thread alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Serial;

impl Threads for Serial {
    fn thread_count(&self) -> usize {
        1
    }
    fn run(&self, _: usize, job: &(dyn Fn() + Sync)) {
        job();
    }
}

/// [`Threads`] of the rayon pool that the calling thread belongs to, or of the global pool.
#[cfg(feature = "rayon")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rayon;

#[cfg(feature = "rayon")]
impl Threads for Rayon {
    fn thread_count(&self) -> usize {
        rayon::current_num_threads()
    }
    fn run(&self, jobs: usize, job: &(dyn Fn() + Sync)) {
        use rayon::prelude::*;
        // Pieces of one job: rayon might otherwise run several jobs on one thread, one after
        // another.
        (0..jobs).into_par_iter().with_max_len(1).for_each(|_| job());
    }
}

/// Runs `work` with `threads` for everything that this crate spreads over threads within it.
pub fn install<R>(threads: Arc<dyn Threads>, work: impl FnOnce() -> R) -> R {
    let _restore = RestoreOnDrop(INSTALLED.replace(Some(threads)));
    work()
}

/// Runs `work` with `threads` if there are any, and with those of the caller otherwise.
pub(crate) fn install_if_some<R>(threads: Option<Arc<dyn Threads>>, work: impl FnOnce() -> R) -> R {
    match threads {
        Some(threads) => install(threads, work),
        None => work(),
    }
}

thread_local! {
    // Thread-local, not a parameter: queries of a surface, for one, are reached through functions
    // that have nothing to do with threads.
    static INSTALLED: RefCell<Option<Arc<dyn Threads>>> = const { RefCell::new(None) };
}

/// Restores the threads that were installed before, after a panic as well.
struct RestoreOnDrop(Option<Arc<dyn Threads>>);

impl Drop for RestoreOnDrop {
    fn drop(&mut self) {
        INSTALLED.set(self.0.take());
    }
}

fn with_current<R>(work: impl FnOnce(&dyn Threads) -> R) -> R {
    match INSTALLED.with_borrow(Clone::clone) {
        Some(threads) => work(&*threads),
        #[cfg(feature = "rayon")]
        None => work(&Rayon),
        #[cfg(not(feature = "rayon"))]
        None => work(&Serial),
    }
}

/// Returns the number of threads that work at the same time, at least 1.
pub(crate) fn thread_count() -> usize {
    with_current(|threads| threads.thread_count().max(1))
}

/// Chunk size for work that takes about the same time for every vertex.
pub(crate) const VERTICES_PER_TASK: usize = 64;

/// Parts of the work for each thread.
///
/// Threads are not equally fast, so that several small parts balance better than one large part.
/// More parts cost more: taking one locks a mutex.
const PARTS_PER_THREAD: usize = 8;

/// Calls `task` for every chunk of `size` items, on all threads.
///
/// `task` gets the index of the chunk's first item and the chunk. Chunks do not depend on the
/// number of threads; a part of the work is a run of chunks.
pub(crate) fn for_each_chunk<T: Send>(
    items: &mut [T],
    size: usize,
    task: impl Fn(usize, &mut [T]) + Sync + Send,
) {
    let chunks = items.len().div_ceil(size);
    let part_len = chunks.div_ceil(PARTS_PER_THREAD * thread_count()).max(1) * size;
    for_each(items.chunks_mut(part_len).enumerate(), |(i, items)| {
        for (k, chunk) in items.chunks_mut(size).enumerate() {
            task(i * part_len + k * size, chunk);
        }
    });
}

/// Calls `task` with each of `parts`, on all threads, in any order.
pub(crate) fn for_each<I>(mut parts: I, task: impl Fn(I::Item) + Sync)
where
    I: ExactSizeIterator + Send,
{
    with_current(|threads| {
        let jobs = parts.len().min(threads.thread_count());
        if jobs <= 1 {
            return parts.by_ref().for_each(&task);
        }
        let parts = Mutex::new(&mut parts);
        // A panic in a task does not harm the iterator, so that a poisoned lock is taken anyway.
        let next = || parts.lock().unwrap_or_else(PoisonError::into_inner).next();
        let job = || {
            while let Some(part) = next() {
                task(part);
            }
        };
        threads.run(jobs, &job);
        // Finishes the work if `run` has called `job` too rarely.
        job();
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Calls the job this many times, one call after another, whatever it is asked for.
    #[derive(Debug)]
    struct FixedCalls(usize);

    impl Threads for FixedCalls {
        fn thread_count(&self) -> usize {
            3
        }
        fn run(&self, jobs: usize, job: &(dyn Fn() + Sync)) {
            assert!(jobs <= 3, "{jobs} jobs");
            (0..self.0).for_each(|_| job());
        }
    }

    /// Visits 1000 items in chunks of seven and returns the number of visits of each.
    fn counts() -> Vec<usize> {
        let mut items: Vec<usize> = vec![0; 1000];
        let chunks = AtomicUsize::new(0);
        for_each_chunk(&mut items, 7, |first, chunk| {
            assert!(chunk.len() == 7.min(1000 - first) && first.is_multiple_of(7));
            chunk.iter_mut().for_each(|count| *count += 1);
            chunks.fetch_add(1, Ordering::Relaxed);
        });
        assert_eq!(chunks.into_inner(), 1000_usize.div_ceil(7));
        items
    }

    #[test]
    fn every_chunk_is_visited_once_however_often_the_job_is_called() {
        assert_eq!(counts(), [1; 1000]);
        let implementations: [Arc<dyn Threads>; 4] = [
            Arc::new(Serial),
            Arc::new(FixedCalls(0)),
            Arc::new(FixedCalls(1)),
            Arc::new(FixedCalls(5)),
        ];
        for threads in implementations {
            assert_eq!(install(Arc::clone(&threads), counts), [1; 1000], "{threads:?}");
        }
    }

    #[test]
    fn threads_installed_before_are_restored_after_return_and_panic() {
        install(Arc::new(FixedCalls(1)), || {
            install(Arc::new(Serial), || assert_eq!(thread_count(), 1));
            let caught = std::panic::catch_unwind(|| install(Arc::new(Serial), || panic!("on purpose")));
            assert!(caught.is_err() && thread_count() == 3);
        });
    }
}
