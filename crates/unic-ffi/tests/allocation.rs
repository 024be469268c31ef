//! Contract: a step allocates nothing after the first few, on no thread; neither do the display, the
//! body and moved colliders.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

use common::*;
use std::{
    alloc::{GlobalAlloc, Layout, System},
    ffi::c_void,
    sync::atomic::{AtomicUsize, Ordering},
};
use unic::*;

/// Allocator that counts the allocations of all threads.
struct Counting;

static COUNT: AtomicUsize = AtomicUsize::new(0);

// SAFETY: the system's allocator does the work.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::SeqCst);
        // SAFETY: passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Calls the job on the calling thread.
unsafe extern "C" fn serial_for(_: *mut c_void, jobs: u32, job: UnicJob, data: *mut c_void) {
    for _ in 0..jobs {
        // SAFETY: the job with its own data.
        unsafe { job.unwrap()(data) };
    }
}

// One test, because the counter is that of the whole process.
#[test]
fn a_step_allocates_nothing() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let (poses, vertices) = (motion(&model, 14), model.vertex_count());
    let body_vertices = model.character().body.vertices.len();
    for (threads, sampling) in [
        (UnicThreads::None, 1.0),
        (UnicThreads::Pool, 0.5),
        (UnicThreads::Caller, 1.0),
    ] {
        let instance = InstanceHandle::new(&handle, |o| {
            o.threads = threads as u32;
            o.thread_count = 3;
            o.sampling = sampling;
            o.intersection = UnicIntersection::Robust as u32;
            o.parallel_for = Some(serial_for);
        });
        let mut out = [(); 2].map(|()| vec![[0.0; 3]; vertices]);
        let mut body = [(); 2].map(|()| vec![[0.0; 3]; body_vertices]);
        let (to, body) = (buffers(&mut out), buffers(&mut body));
        let mut before = 0;
        for (t, pose) in poses.iter().enumerate() {
            if t == 4 {
                before = COUNT.load(Ordering::SeqCst);
            }
            let ball = UnicCollider {
                shape: UnicShape::Sphere as u32,
                radius: 0.1,
                a: [0.01 * t as f32, 1.0, 0.1],
                b: [0.0; 3],
            };
            let pose = c_pose(pose);
            // SAFETY: structs and buffers of their sizes.
            unsafe {
                ok(unic_instance_set_colliders(instance.0, &ball, 1));
                ok(unic_instance_step(instance.0, &c_input(&pose), &to));
                ok(unic_instance_display(instance.0, &pose, 0.5, &to));
                ok(unic_instance_body(instance.0, &body));
            }
        }
        assert_eq!(COUNT.load(Ordering::SeqCst) - before, 0, "{threads:?}");
    }
}
