//! Contract: many instances of one model, in many threads, give the same bytes as one; models and
//! instances may come and go meanwhile; two threads on one instance get a code; jobs that the
//! caller's threads run late, twice or not at all are harmless.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

use common::*;
use std::{
    ffi::c_void,
    ptr::{null, null_mut, with_exposed_provenance_mut},
    sync::{
        Barrier, Mutex,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};
use unic::*;

const THREADS: usize = 8;

#[test]
fn many_instances_of_one_model_in_many_threads_give_the_same_bytes() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let (poses, vertices) = (motion(&model, 4), model.vertex_count());
    let expected = core_frames(&model, &poses);
    let barrier = Barrier::new(THREADS);
    std::thread::scope(|scope| {
        for thread in 0..THREADS {
            let (barrier, handle, poses, expected) = (&barrier, &handle, &poses, &expected);
            scope.spawn(move || {
                barrier.wait();
                // Some on their own threads, some on a pool that they share.
                let kind = [UnicThreads::None, UnicThreads::Pool][thread % 2];
                let new = || {
                    InstanceHandle::new(handle, |o| {
                        o.threads = kind as u32;
                        o.thread_count = 3;
                    })
                };
                let instances = [new(), new(), new()];
                for (t, pose) in poses.iter().enumerate() {
                    let pose = c_pose(pose);
                    let call = if t == 0 { Call::Reset } else { Call::Step };
                    for instance in &instances {
                        let found = instance.play(call, &c_input(&pose), vertices);
                        assert!(found == expected[t], "thread {thread}, frame {t}");
                    }
                    // An owner more and less, and an instance that comes and goes.
                    ok(unic_model_retain(handle.0));
                    drop(InstanceHandle::new(handle, |o| {
                        o.precision = UnicPrecision::Int8 as u32
                    }));
                    ok(unic_model_release(handle.0));
                }
            });
        }
    });
}

#[test]
fn a_second_thread_on_an_instance_gets_a_code() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let pose = &motion(&model, 1)[0];
    let instance = InstanceHandle::new(&handle, |_| ());
    let (steps, refusals) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let barrier = Barrier::new(THREADS);
    std::thread::scope(|scope| {
        for _ in 0..THREADS {
            scope.spawn(|| {
                let pose = c_pose(pose);
                barrier.wait();
                for _ in 0..20 {
                    // SAFETY: structs of their sizes.
                    match unsafe { unic_instance_step(instance.raw(), &c_input(&pose), null()) } {
                        UnicStatus::Ok => steps.fetch_add(1, Ordering::Relaxed),
                        status => {
                            refused(status, UnicStatus::InUse, "one thread at a time");
                            refusals.fetch_add(1, Ordering::Relaxed)
                        }
                    };
                }
            });
        }
    });
    let (steps, refusals) = (steps.into_inner(), refusals.into_inner());
    assert_eq!(steps + refusals, THREADS * 20);
    assert!(steps > 0 && refusals > 0, "{steps} steps, {refusals} refusals");
}

/// A release during a step ends the handle, and the step finishes.
#[test]
fn an_instance_may_be_released_while_another_thread_steps_it() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let pose = &motion(&model, 1)[0];
    for _ in 0..10 {
        let instance = std::mem::ManuallyDrop::new(InstanceHandle::new(&handle, |_| ()));
        let barrier = Barrier::new(2);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let pose = c_pose(pose);
                barrier.wait();
                // SAFETY: structs of their sizes.
                while unsafe { unic_instance_step(instance.raw(), &c_input(&pose), null()) } == UnicStatus::Ok
                {
                }
                assert!(last_error().contains("released"), "{}", last_error());
            });
            barrier.wait();
            ok(unic_instance_release(instance.0));
        });
    }
}

/// Instances own their model: its handle may end while another thread steps one.
#[test]
fn a_model_may_be_released_while_its_instances_are_in_use() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let (poses, vertices) = (motion(&model, 6), model.vertex_count());
    let expected = core_frames(&model, &poses);
    let instance = InstanceHandle::new(&handle, |_| ());
    let (released, is_released) = (handle.0, AtomicBool::new(false));
    std::thread::scope(|scope| {
        let (instance, poses, expected, is_released) = (&instance, &poses, &expected, &is_released);
        let stepping = scope.spawn(move || {
            // The last sequence begins after the release.
            loop {
                let is_last = is_released.load(Ordering::Acquire);
                assert!(c_frames(instance, poses, vertices) == *expected);
                if is_last {
                    break;
                }
            }
        });
        drop(handle);
        is_released.store(true, Ordering::Release);
        stepping.join().unwrap();
    });
    let mut other = null_mut();
    // SAFETY: handles are not dereferenced.
    let status = unsafe { unic_instance_create(released, null(), &mut other) };
    refused(status, UnicStatus::InvalidHandle, "released");
}

/// Jobs that a pool of the caller has got, and how often it has run each.
#[derive(Default)]
struct Late {
    jobs: Mutex<Vec<(UnicJob, usize)>>,
    asked: AtomicUsize,
}

impl Late {
    /// Runs all jobs so far again, on another thread.
    fn run_all(&self) {
        let jobs = self.jobs.lock().unwrap().clone();
        assert!(!jobs.is_empty());
        let run = move || {
            for (job, data) in jobs {
                // SAFETY: a job with its data, which may be called at any time.
                unsafe { job.unwrap()(with_exposed_provenance_mut(data)) };
            }
        };
        std::thread::spawn(run).join().unwrap();
    }
}

/// Keeps the job for later. Runs those of earlier calls, and this one not at all, once or twice.
unsafe extern "C" fn late_parallel_for(context: *mut c_void, _: u32, job: UnicJob, data: *mut c_void) {
    // SAFETY: the value of the test, which outlives the instance.
    let late = unsafe { &*context.cast::<Late>() };
    if late.asked.fetch_add(1, Ordering::Relaxed) % 3 == 2 {
        late.run_all();
    }
    for _ in 0..late.asked.load(Ordering::Relaxed) % 3 {
        // SAFETY: the job with its data.
        unsafe { job.unwrap()(data) };
    }
    late.jobs.lock().unwrap().push((job, data.expose_provenance()));
}

#[test]
fn jobs_that_run_late_twice_or_not_at_all_are_harmless() {
    let model = lively_model();
    let (handle, poses) = (ModelHandle::of(&model), motion(&model, 5));
    let expected = core_frames(&model, &poses);
    let late = Late::default();
    let new = || {
        InstanceHandle::new(&handle, |o| {
            o.threads = UnicThreads::Caller as u32;
            o.thread_count = 3;
            o.parallel_for = Some(late_parallel_for);
            o.parallel_context = (&raw const late).cast_mut().cast();
        })
    };
    let instance = new();
    assert!(c_frames(&instance, &poses, model.vertex_count()) == expected);
    assert!(late.asked.load(Ordering::Relaxed) > 6);
    late.run_all();
    assert!(c_frames(&instance, &poses, model.vertex_count()) == expected);
    drop(instance);
    late.run_all();
    // Jobs of a released instance do not reach another one.
    assert!(c_frames(&new(), &poses, model.vertex_count()) == expected);
}
