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
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
    },
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
    ///
    /// Calls that have begun may wait for each other without sleeping. The threads must therefore
    /// have the same priority.
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

/// Calls `task` with the index of a stage and of a part of it, for all parts of all stages, of which
/// stage i has `parts_of(i)`. A stage starts when the one before has ended.
///
/// For many short stages over the same data: threads are woken once, not once for each stage, and
/// wait between stages without sleeping. Each thread begins with its own block of neighbouring
/// parts, the same share of every stage, so that data stay in its cache.
pub(crate) fn for_each_stage(
    stages: usize,
    parts_of: impl Fn(usize) -> usize + Sync,
    task: impl Fn(usize, usize) + Sync,
) {
    with_current(|threads| {
        let most = (0..stages).map(&parts_of).max().unwrap_or_default();
        let jobs = threads.thread_count().min(most);
        if jobs <= 1 {
            return (0..stages).for_each(|stage| (0..parts_of(stage)).for_each(|part| task(stage, part)));
        }
        let progress = Progress::new(jobs);
        let job = || {
            let own = progress.joined.fetch_add(1, Ordering::Relaxed);
            let mut end = 0;
            for stage in 0..stages {
                let count = parts_of(stage);
                end += count;
                if progress.done.load(Ordering::Acquire) >= end {
                    continue;
                }
                for block in (0..progress.blocks_in_use).map(|k| own + k) {
                    while let Some(part) = progress.take(block, stage, count) {
                        let stop = StopOnPanic(&progress.stopped);
                        task(stage, part);
                        std::mem::forget(stop);
                        // Release: what this part wrote is visible to threads that wait for it.
                        progress.done.fetch_add(1, Ordering::Release);
                    }
                }
                // The parts that are left are with threads that are at work on them, so that they
                // end, however few threads there are.
                if !progress.wait_for(end) {
                    return;
                }
            }
        };
        threads.run(jobs, &job);
        // Finishes the work if `run` has called `job` too rarely.
        job();
    });
}

/// Progress of [`for_each_stage`].
struct Progress {
    /// Number of calls of the job that have begun.
    joined: AtomicUsize,
    /// Number of parts that have ended. A stage starts when all before have ended, so that this
    /// says which parts.
    done: AtomicUsize,
    /// Whether a part has panicked.
    stopped: AtomicBool,
    /// Blocks of neighbouring parts; the first ones are in use.
    blocks: [Block; BLOCKS],
    blocks_in_use: usize,
}

/// Largest number of blocks. More threads share them.
const BLOCKS: usize = 32;

/// Last stage of which a part of the block was taken, and the number of its parts that were taken,
/// in the upper and lower 32 bits. On a cache line of its own.
#[derive(Default)]
#[repr(align(64))]
struct Block(AtomicU64);

impl Block {
    /// Takes the next of `count` parts of a stage. Returns its place in the block.
    fn take(&self, stage: u64, count: u64) -> Option<u64> {
        let taken = |packed: u64| match (packed >> 32).cmp(&stage) {
            std::cmp::Ordering::Less => Some(0),
            std::cmp::Ordering::Equal => Some(packed & u64::from(u32::MAX)),
            // The stage has ended.
            std::cmp::Ordering::Greater => None,
        };
        let next = |packed| {
            let taken = taken(packed).filter(|taken| *taken < count)?;
            Some((stage << 32) | (taken + 1))
        };
        let before = self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, next);
        before.ok().and_then(taken)
    }
}

impl Progress {
    fn new(jobs: usize) -> Self {
        Self {
            joined: AtomicUsize::new(0),
            done: AtomicUsize::new(0),
            stopped: AtomicBool::new(false),
            blocks: std::array::from_fn(|_| Block::default()),
            blocks_in_use: jobs.min(BLOCKS),
        }
    }

    /// Takes a part of a stage of `count` parts from a block. `block` may be any number.
    fn take(&self, block: usize, stage: usize, count: usize) -> Option<usize> {
        let blocks = self.blocks_in_use;
        let block = block % blocks;
        let [first, end] = [block, block + 1].map(|block| block * count / blocks);
        let place = self.blocks[block].take(stage as u64, (end - first) as u64)?;
        Some(first + place as usize)
    }

    /// Waits until this many parts have ended. Returns false if one has panicked.
    fn wait_for(&self, parts: usize) -> bool {
        let mut spins = 0;
        while self.done.load(Ordering::Acquire) < parts {
            if self.stopped.load(Ordering::Relaxed) {
                return false;
            }
            spins += 1;
            match spins < SPINS {
                true => std::hint::spin_loop(),
                false => std::thread::yield_now(),
            }
        }
        true
    }
}

/// Rounds of waiting before a thread lets others run.
const SPINS: usize = 1000;

/// Lets the threads that wait for a part stop when it panics. Forgotten otherwise.
struct StopOnPanic<'a>(&'a AtomicBool);

impl Drop for StopOnPanic<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// Threads of the standard library, as many as are asked for.
    #[derive(Debug)]
    struct Scoped;

    impl Threads for Scoped {
        fn thread_count(&self) -> usize {
            4
        }
        fn run(&self, jobs: usize, job: &(dyn Fn() + Sync)) {
            std::thread::scope(|scope| {
                let spawned: Vec<_> = (0..jobs).map(|_| scope.spawn(job)).collect();
                let ended: Vec<_> = spawned.into_iter().map(|thread| thread.join()).collect();
                if let Some(panic) = ended.into_iter().find_map(Result::err) {
                    std::panic::resume_unwind(panic);
                }
            });
        }
    }

    #[test]
    fn a_stage_starts_when_all_parts_of_the_one_before_have_ended() {
        let part_counts = [3, 0, 1, 7, 2, 0];
        let implementations: [Arc<dyn Threads>; 5] = [
            Arc::new(Serial),
            Arc::new(FixedCalls(0)),
            Arc::new(FixedCalls(1)),
            Arc::new(FixedCalls(5)),
            Arc::new(Scoped),
        ];
        for threads in implementations {
            let ended = Mutex::new(Vec::new());
            let task = |stage: usize, part: usize| {
                // The first parts of a stage take longest.
                std::thread::sleep(std::time::Duration::from_millis(4 - part.min(4) as u64));
                ended.lock().unwrap().push((stage, part));
            };
            install(Arc::clone(&threads), || {
                for_each_stage(part_counts.len(), |stage| part_counts[stage], task)
            });
            let mut ended = ended.into_inner().unwrap();
            assert!(
                ended.is_sorted_by_key(|(stage, _)| *stage),
                "{threads:?}: {ended:?}"
            );
            ended.sort_unstable();
            let parts = |(stage, &count): (usize, &usize)| (0..count).map(move |part| (stage, part));
            let expected: Vec<_> = part_counts.iter().enumerate().flat_map(parts).collect();
            assert_eq!(ended, expected, "{threads:?}");
        }
    }

    #[test]
    fn a_panic_in_a_stage_reaches_the_caller() {
        for threads in [Arc::new(Serial) as Arc<dyn Threads>, Arc::new(Scoped)] {
            let task = |stage: usize, part: usize| assert!((stage, part) != (1, 2), "on purpose");
            let staged = || install(threads, || for_each_stage(3, |_| 4, task));
            assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(staged)).is_err());
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
