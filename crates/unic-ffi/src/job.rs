//! Jobs that threads other than the caller's take part in, and the callback of the caller's threads.

use crate::registry::Registry;
use std::{
    any::Any,
    ffi::c_void,
    fmt::{Debug, Formatter},
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
};
use unic_core::Threads;

/// Work that parallel_for is given; called with its data.
pub type UnicJob = Option<unsafe extern "C" fn(data: *mut c_void)>;

/// Callback that runs a job on the caller's threads: calls `job(data)` up to `jobs` times, in
/// parallel where it can.
///
/// It may call the job less often or more often, and return early: the calling thread does what is
/// left. A job that is called after parallel_for has returned takes part in the work of the moment; if
/// there is none, or the instance is released, it does nothing. `data` is a number, not memory. The
/// callback must not throw. It is called on the thread that steps the instance. A second
/// callback, to wait for the jobs, is not needed: the library itself waits for those that have begun.
/// Jobs wait for each other without sleeping, so the threads must have the same priority.
pub type UnicParallelFor =
    Option<unsafe extern "C" fn(context: *mut c_void, jobs: u32, job: UnicJob, data: *mut c_void)>;

/// A [`UnicParallelFor`] that is not null.
type ParallelFor = unsafe extern "C" fn(context: *mut c_void, jobs: u32, job: UnicJob, data: *mut c_void);

/// Job on the stack of a caller, without its lifetime.
type Job = &'static (dyn Fn() + Sync);

/// Place for one job at a time. Threads that come too late find nothing to do.
#[derive(Default)]
pub(crate) struct JobSlot {
    gate: Mutex<Gate>,
    /// Signalled when the last thread leaves.
    left: Condvar,
}

#[derive(Default)]
struct Gate {
    /// Job that threads may enter.
    job: Option<Job>,
    /// Threads in the job, without its owner.
    inside: usize,
    /// First panic of such a thread.
    panic: Option<Box<dyn Any + Send>>,
}

impl JobSlot {
    /// Offers a job to other threads while `invite` runs, and returns when none is left in it.
    ///
    /// If the slot has a job already, the calling thread runs the job alone. A panic of a thread in
    /// the job is resumed here.
    pub(crate) fn offer(&self, job: &(dyn Fn() + Sync), invite: impl FnOnce()) {
        // SAFETY: the reference does not outlive `job`. It is in the slot only while `open` lives,
        // whose drop takes it out and waits for every thread that has taken it.
        let job: Job = unsafe { std::mem::transmute::<&(dyn Fn() + Sync), Job>(job) };
        let mut gate = self.lock();
        if gate.job.is_some() {
            drop(gate);
            return job();
        }
        gate.job = Some(job);
        // One that its owner did not see, because it was in a panic of its own.
        gate.panic = None;
        drop(gate);
        let open = Open(self);
        invite();
        drop(open);
        if let Some(payload) = self.lock().panic.take() {
            resume_unwind(payload);
        }
    }

    /// Takes part in the job, if there is one.
    pub(crate) fn enter(&self) {
        let mut gate = self.lock();
        let Some(job) = gate.job else { return };
        gate.inside += 1;
        drop(gate);
        let result = catch_unwind(AssertUnwindSafe(job));
        let mut gate = self.lock();
        gate.inside -= 1;
        if let Err(payload) = result {
            gate.panic.get_or_insert(payload);
        }
        if gate.inside == 0 {
            self.left.notify_all();
        }
    }

    /// No code panics with the lock, so that a poisoned one is taken anyway.
    fn lock(&self) -> MutexGuard<'_, Gate> {
        self.gate.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Job that is offered. Its drop ends that, after a panic as well.
struct Open<'a>(&'a JobSlot);

impl Drop for Open<'_> {
    fn drop(&mut self) {
        let mut gate = self.0.lock();
        gate.job = None;
        while gate.inside > 0 {
            gate = self.0.left.wait(gate).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Debug for JobSlot {
    fn fmt(&self, f: &mut Formatter) -> std::fmt::Result {
        f.write_str("JobSlot")
    }
}

/// Slots of the caller's threads, by the number that their jobs have as data: a job that a pool of the
/// caller runs late finds none.
static SLOTS: Registry<JobSlot> = Registry::new("job");

/// The caller's threads.
#[derive(Debug)]
pub(crate) struct WorkerThreads {
    count: usize,
    parallel_for: ParallelFor,
    context: *mut c_void,
    /// Job of the moment. A slot and not the job itself is what the callback gets, so that it may
    /// return early.
    slot: Arc<JobSlot>,
    /// Number of the slot.
    data: *mut c_void,
}

// SAFETY: the data is a number, and the context is only passed to the caller's callback, which the interface asks to be
// callable on every thread that steps the instance.
unsafe impl Send for WorkerThreads {}
// SAFETY: as above.
unsafe impl Sync for WorkerThreads {}

impl WorkerThreads {
    pub(crate) fn new(count: usize, parallel_for: ParallelFor, context: *mut c_void) -> Self {
        let slot = Arc::default();
        Self {
            count,
            parallel_for,
            context,
            data: SLOTS.insert(Arc::clone(&slot)),
            slot,
        }
    }
}

impl Drop for WorkerThreads {
    fn drop(&mut self) {
        // It is there since `new`, and nobody else ends it.
        let _ = SLOTS.release(self.data);
    }
}

impl Threads for WorkerThreads {
    fn thread_count(&self) -> usize {
        self.count
    }

    fn run(&self, jobs: usize, job: &(dyn Fn() + Sync)) {
        self.slot.offer(job, || {
            // SAFETY: the caller's function, called as the interface says: on the thread that steps,
            // with its own context.
            unsafe { (self.parallel_for)(self.context, jobs as u32, Some(enter_slot), self.data) };
        });
    }
}

/// Job of [`UnicParallelFor`]: `data` is the number of a slot.
unsafe extern "C" fn enter_slot(data: *mut c_void) {
    // A slot that is gone has no work left.
    if let Ok(slot) = SLOTS.get(data) {
        slot.enter();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn late_threads_find_nothing_and_early_ones_are_waited_for() {
        let slot = Arc::new(JobSlot::default());
        let done = AtomicUsize::new(0);
        for round in 0..200 {
            let job = || {
                done.fetch_add(1, Ordering::Relaxed);
            };
            let threads = std::cell::RefCell::new(Vec::new());
            slot.offer(&job, || {
                let slot = Arc::clone(&slot);
                // Returns before the thread has begun, or after, or in between.
                threads
                    .borrow_mut()
                    .push(std::thread::spawn(move || slot.enter()));
                if round % 2 == 0 {
                    std::thread::yield_now();
                }
            });
            let after = done.load(Ordering::Relaxed);
            threads.into_inner().into_iter().for_each(|t| t.join().unwrap());
            assert_eq!(
                done.load(Ordering::Relaxed),
                after,
                "a job ran after its owner had left"
            );
        }
    }

    #[test]
    fn a_panic_of_another_thread_is_resumed_on_the_owner() {
        let slot = Arc::new(JobSlot::default());
        let owner = std::thread::current().id();
        let job = || {
            assert!(std::thread::current().id() == owner, "on purpose");
        };
        let caught = catch_unwind(AssertUnwindSafe(|| {
            slot.offer(&job, || {
                let slot = Arc::clone(&slot);
                std::thread::spawn(move || slot.enter()).join().unwrap();
            });
        }));
        assert!(caught.is_err());
        // The slot is free again.
        let count = AtomicUsize::new(0);
        let job = || {
            count.fetch_add(1, Ordering::Relaxed);
        };
        slot.offer(&job, || slot.enter());
        assert_eq!(count.into_inner(), 1);
    }

    /// The panic of the owner hides that of another thread, which nobody may get later.
    #[test]
    fn a_panic_that_nobody_saw_is_forgotten() {
        let slot = JobSlot::default();
        let job = || panic!("on purpose");
        let caught = catch_unwind(AssertUnwindSafe(|| {
            slot.offer(&job, || {
                slot.enter();
                job();
            });
        }));
        assert!(caught.is_err());
        slot.offer(&|| (), || slot.enter());
    }

    #[test]
    fn a_job_within_a_job_runs_alone() {
        let slot = JobSlot::default();
        let count = AtomicUsize::new(0);
        let inner = || {
            count.fetch_add(1, Ordering::Relaxed);
        };
        slot.offer(&|| slot.offer(&inner, || panic!("nobody is invited")), || {
            slot.enter()
        });
        assert_eq!(count.into_inner(), 1);
    }
}
