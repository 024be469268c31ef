//! Contract: many instances of one model, in many threads, give the same bytes as one; models and
//! instances may come and go meanwhile; two threads on one instance get a code.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

use common::*;
use std::{
    ptr::null,
    sync::{
        Barrier,
        atomic::{AtomicUsize, Ordering},
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
