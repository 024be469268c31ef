//! Threads for the work on many vertices: those that the caller provides.
//!
//! An engine implements [`Threads`] over its own job system and gives it to each animator
//! ([`Animator::set_threads`](crate::animator::Animator::set_threads)), or [`install`]s it around whatever
//! else it calls, as one does with a pool of rayon:
//!
//! ```
//! use unic_core::parallel::{Threads, install};
//!
//! /// Stands for an engine's workers, here started anew every time.
//! #[derive(Debug)]
//! struct Workers(usize);
//!
//! impl Threads for Workers {
//!     fn lanes(&self) -> usize {
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
//! Without any, work runs on the current rayon pool ([`Rayon`]), or on the calling thread where feature `rayon`
//! is off. Results are the same bytes for all of them: an implementation decides when and where a part is worked
//! on, never what the part is.

use std::{
    cell::RefCell,
    fmt::Debug,
    sync::{Arc, Mutex, PoisonError},
};

/// Threads that somebody else owns.
pub trait Threads: Debug + Send + Sync {
    /// How many work at the same time, the calling one included; 0 counts as 1.
    fn lanes(&self) -> usize;

    /// Calls `job` `jobs` times, as many of them at once as can be, and returns when all calls have.
    ///
    /// `jobs` is at most [`lanes`](Self::lanes). Each call works on one part after another until none is left:
    /// one that comes late finds nothing to do, and what no call has done is done by the caller afterwards. So
    /// nothing but speed depends on how often and where `job` is called. A panic in `job` belongs on the thread
    /// that called `run`.
    fn run(&self, jobs: usize, job: &(dyn Fn() + Sync));
}

/// The calling thread alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Serial;

impl Threads for Serial {
    fn lanes(&self) -> usize {
        1
    }
    fn run(&self, _: usize, job: &(dyn Fn() + Sync)) {
        job();
    }
}

/// The rayon pool that the calling thread belongs to, or the global one.
#[cfg(feature = "rayon")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rayon;

#[cfg(feature = "rayon")]
impl Threads for Rayon {
    fn lanes(&self) -> usize {
        rayon::current_num_threads()
    }
    fn run(&self, jobs: usize, job: &(dyn Fn() + Sync)) {
        use rayon::prelude::*;
        (0..jobs).into_par_iter().with_max_len(1).for_each(|_| job());
    }
}

/// Does `work` on `threads`: all that this crate spreads over threads on its way.
pub fn install<R>(threads: Arc<dyn Threads>, work: impl FnOnce() -> R) -> R {
    let _installed = Installed(INSTALLED.replace(Some(threads)));
    work()
}

/// As [`install`], where there are threads of one's own.
pub(crate) fn install_own<R>(threads: Option<Arc<dyn Threads>>, work: impl FnOnce() -> R) -> R {
    match threads {
        Some(threads) => install(threads, work),
        None => work(),
    }
}

thread_local! {
    // What is called on the way, queries of a surface for one, has callers that know nothing of threads.
    static INSTALLED: RefCell<Option<Arc<dyn Threads>>> = const { RefCell::new(None) };
}

/// Puts back what was installed before, after a panic as well.
struct Installed(Option<Arc<dyn Threads>>);

impl Drop for Installed {
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

/// How many threads work at the same time.
pub(crate) fn lanes() -> usize {
    with_current(|threads| threads.lanes().max(1))
}

/// Turns of a thread at a task: threads are not equally fast, and a turn is not free.
const TURNS: usize = 8;

/// Calls `task` with the index of its first item for every `size` items, on all threads.
pub(crate) fn for_each_chunk<T: Send>(
    items: &mut [T],
    size: usize,
    task: impl Fn(usize, &mut [T]) + Sync + Send,
) {
    let turn = items.len().div_ceil(size).div_ceil(TURNS * lanes()).max(1) * size;
    for_each(items.chunks_mut(turn).enumerate(), |(i, items)| {
        for (k, chunk) in items.chunks_mut(size).enumerate() {
            task(i * turn + k * size, chunk);
        }
    });
}

/// Calls `task` with each of `parts`, on all threads.
pub(crate) fn for_each<I>(mut parts: I, task: impl Fn(I::Item) + Sync)
where
    I: ExactSizeIterator + Send,
{
    with_current(|threads| {
        let jobs = parts.len().min(threads.lanes());
        if jobs <= 1 {
            return parts.by_ref().for_each(&task);
        }
        let parts = Mutex::new(&mut parts);
        // A task that panics leaves the iterator whole.
        let next = || parts.lock().unwrap_or_else(PoisonError::into_inner).next();
        let job = || {
            while let Some(part) = next() {
                task(part);
            }
        };
        threads.run(jobs, &job);
        job();
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Calls the job as often as it likes, one call after another.
    #[derive(Debug)]
    struct Careless(usize);

    impl Threads for Careless {
        fn lanes(&self) -> usize {
            3
        }
        fn run(&self, jobs: usize, job: &(dyn Fn() + Sync)) {
            assert!(jobs <= 3, "{jobs} jobs");
            (0..self.0).for_each(|_| job());
        }
    }

    /// How often each of 1000 items was worked on, in chunks of seven.
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
    fn every_chunk_is_worked_on_once_however_often_the_job_is_called() {
        assert_eq!(counts(), [1; 1000]);
        let everyone: [Arc<dyn Threads>; 4] = [
            Arc::new(Serial),
            Arc::new(Careless(0)),
            Arc::new(Careless(1)),
            Arc::new(Careless(5)),
        ];
        for threads in everyone {
            assert_eq!(install(Arc::clone(&threads), counts), [1; 1000], "{threads:?}");
        }
    }

    #[test]
    fn what_was_installed_before_comes_back() {
        install(Arc::new(Careless(1)), || {
            install(Arc::new(Serial), || assert_eq!(lanes(), 1));
            let caught = std::panic::catch_unwind(|| install(Arc::new(Serial), || panic!("on purpose")));
            assert!(caught.is_err() && lanes() == 3);
        });
    }
}
