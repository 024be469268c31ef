//! Contract: what a library can see of a wrong call is a code and a text, and changes nothing. Null,
//! misaligned and released handles, wrong counts, strides and sizes, NaN, unknown values, damaged
//! files and states, calls on an instance that is in use.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

#[path = "../common/mod.rs"]
mod common;
mod damage;
mod numbers;
mod pointers;
mod sizes;

use common::*;
use std::{
    ffi::{CString, c_void},
    mem::size_of,
    ptr::{null, null_mut},
};
use unic::*;
use unic_core::Pose;

/// Model, instance and a pose that works.
struct Scene {
    model: ModelHandle,
    instance: InstanceHandle,
    poses: Vec<Pose>,
    vertices: usize,
}

fn scene() -> Scene {
    let (core, model) = (core_model(), ModelHandle::open());
    Scene {
        instance: InstanceHandle::new(&model, |_| ()),
        poses: motion(&core, 4),
        vertices: core.vertex_count(),
        model,
    }
}

/// Calls the instance that is being stepped, whose handle is the context.
unsafe extern "C" fn call_again(context: *mut c_void, _: u32, job: UnicJob, data: *mut c_void) {
    // SAFETY: the cell of the test below.
    let instance: *const UnicInstance = unsafe { *context.cast::<*const UnicInstance>() };
    if !instance.is_null() {
        let stride = 0;
        // SAFETY: structs of their sizes; the job with its data.
        unsafe {
            let status = unic_instance_mesh_faces(instance, 0, null_mut(), stride);
            refused(status, UnicStatus::InUse, "one thread at a time");
            job.unwrap()(data);
        }
    }
}

#[test]
fn an_instance_in_use_refuses_other_calls() {
    let Scene { model, poses, .. } = scene();
    let mut cell: *const UnicInstance = null();
    let context = &raw mut cell;
    let instance = InstanceHandle::new(&model, |o| {
        o.threads = UnicThreads::Caller as u32;
        o.thread_count = 2;
        o.parallel_for = Some(call_again);
        o.parallel_context = context.cast();
    });
    // SAFETY: the cell above, which only the callback on this thread reads.
    unsafe { context.write(instance.0) };
    let pose = c_pose(&poses[0]);
    // SAFETY: structs of their sizes.
    ok(unsafe { unic_instance_step(instance.0, &c_input(&pose), null()) });
}
