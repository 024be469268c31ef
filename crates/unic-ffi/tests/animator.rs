//! Contract: the C interface gives the bits of the Rust animator, for steps, display, body, states
//! and given starts, on any threads.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

use common::*;
use glam::Vec3;
use std::{
    ffi::c_void,
    ptr::{null, null_mut},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};
use unic::*;
use unic_core::{
    Animator, Collider, Corrects, IntersectionMode, Model, Precision, Start, StepInput, mesh::vertex_normals,
};

#[test]
fn steps_give_the_bits_of_the_rust_animator() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let poses = motion(&model, 12);
    let instance = InstanceHandle::new(&handle, |_| ());
    assert!(c_frames(&instance, &poses, model.vertex_count()) == core_frames(&model, &poses));
}

#[test]
fn every_precision_and_sampling_gives_the_same_bits() {
    let lively = lively_model();
    let (handle, poses) = (ModelHandle::of(&lively), motion(&lively, 4));
    let precisions = [
        (UnicPrecision::F32, Precision::F32, 1.0),
        (UnicPrecision::F32, Precision::F32, 0.5),
        (UnicPrecision::Bf16, Precision::Bf16, 1.0),
        (UnicPrecision::Int16, Precision::Int16, 0.25),
        (UnicPrecision::Int8, Precision::Int8, 0.5),
    ];
    let mut all = Vec::new();
    for (given, precision, sampling) in precisions {
        let model = Model::clone(&lively).with_precision(precision);
        let model = Arc::new(model.with_sampling(sampling).unwrap());
        let instance = InstanceHandle::new(&handle, |o| {
            o.precision = given as u32;
            o.sampling = sampling;
        });
        let found = c_frames(&instance, &poses, model.vertex_count());
        assert!(found == core_frames(&model, &poses), "{given:?}, {sampling}");
        assert!(!all.contains(&found), "{given:?}, {sampling}: no change");
        all.push(found);
    }
}

/// Calls the job on two threads more, and sometimes not at all.
unsafe extern "C" fn parallel_for(context: *mut c_void, jobs: u32, job: UnicJob, data: *mut c_void) {
    // SAFETY: the counter of the test, which outlives the instance.
    let calls = unsafe { &*context.cast::<AtomicUsize>() };
    if calls.fetch_add(1, Ordering::Relaxed) % 5 == 4 {
        return;
    }
    let data = data.expose_provenance();
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(move || {
                // SAFETY: the job with its own data, while the instance lives.
                unsafe { job.unwrap()(std::ptr::with_exposed_provenance_mut(data)) }
            });
        }
    });
}

#[test]
fn any_threads_give_the_same_bits() {
    let model = lively_model();
    let handle = ModelHandle::of(&model);
    let poses = motion(&model, 5);
    let expected = core_frames(&model, &poses);
    let calls = AtomicUsize::new(0);
    for (threads, count) in [
        (UnicThreads::Pool, 1),
        (UnicThreads::Pool, 2),
        (UnicThreads::Pool, 5),
        (UnicThreads::Pool, 0),
        (UnicThreads::Caller, 1),
        (UnicThreads::Caller, 3),
    ] {
        let instance = InstanceHandle::new(&handle, |o| {
            o.threads = threads as u32;
            o.thread_count = count;
            o.parallel_for = Some(parallel_for);
            o.parallel_context = (&raw const calls).cast_mut().cast();
        });
        let found = c_frames(&instance, &poses, model.vertex_count());
        assert!(found == expected, "{threads:?}, {count}");
    }
    assert!(calls.into_inner() > 10);
}

#[test]
fn ground_wind_next_pose_and_colliders_reach_the_animator() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let poses = motion(&model, 6);
    let instance = InstanceHandle::new(&handle, |o| {
        o.intersection = UnicIntersection::Robust as u32;
        o.intersection_distance_m = 0.004;
    });
    let colliders = [
        (UnicShape::HalfSpace, 0.0, Vec3::Y * 0.1, Vec3::Y),
        (UnicShape::Sphere, 0.2, Vec3::new(0.1, 1.2, 0.1), Vec3::NAN),
        (
            UnicShape::Capsule,
            0.1,
            Vec3::new(0.0, 1.0, 0.1),
            Vec3::new(0.3, 1.1, 0.2),
        ),
    ]
    .map(|(shape, radius, a, b)| UnicCollider {
        shape: shape as u32,
        radius,
        a: a.to_array(),
        b: b.to_array(),
    });
    // SAFETY: an array of three.
    ok(unsafe { unic_instance_set_colliders(instance.0, colliders.as_ptr(), 3) });
    let mut animator = Animator::new(Arc::clone(&model));
    animator.set_intersection(IntersectionMode::Robust {
        margin_m: 0.004,
        corrects: Corrects::Display,
    });
    animator.set_colliders([
        Collider::ground(0.1),
        Collider::sphere(0.2, Vec3::new(0.1, 1.2, 0.1)),
        Collider::capsule(0.1, Vec3::new(0.0, 1.0, 0.1), Vec3::new(0.3, 1.1, 0.2)),
    ]);
    let mut plain = core_frames(&model, &poses);
    for (t, pose) in poses.iter().enumerate() {
        let next = poses.get(t + 1);
        let (given, given_next) = (c_pose(pose), next.map(c_pose));
        let c = UnicStepInput {
            ground_height: 0.05,
            wind: [3.0, 0.5, -2.0],
            next_pose: given_next.as_ref().map_or(null(), |p| p),
            ..c_input(&given)
        };
        let rust = StepInput {
            pose,
            next_pose: next,
            ground_height: 0.05,
            wind: Vec3::new(3.0, 0.5, -2.0),
        };
        let call = if t == 0 { Call::Reset } else { Call::Step };
        let [found, _] = instance.play(call, &c, model.vertex_count());
        let shown = match call {
            Call::Reset => animator.reset(&rust, Start::MeanShape),
            Call::Step => animator.step(&rust),
        };
        let expected: Vec<_> = shown.unwrap().positions.iter().map(|p| p.to_array()).collect();
        assert!(found == expected, "frame {t}");
        assert!(
            found != plain.remove(0)[0],
            "frame {t}: colliders and wind change nothing"
        );
    }
    // SAFETY: an empty array may be null.
    ok(unsafe { unic_instance_set_colliders(instance.0, null(), 0) });
}

#[test]
fn display_and_body_are_those_of_the_rust_library() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let poses = motion(&model, 6);
    let instance = InstanceHandle::new(&handle, |_| ());
    c_frames(&instance, &poses[..5], model.vertex_count());
    let (animator, mut display) = core_display(&model, &poses[..5]);
    for share in [0.0, 0.3, 1.0, 7.0] {
        let mut out = [(); 2].map(|()| vec![[0.0; 3]; model.vertex_count()]);
        // SAFETY: structs and buffers of their sizes.
        ok(unsafe { unic_instance_display(instance.0, &c_pose(&poses[5]), share, &buffers(&mut out)) });
        let shown = display.show(&animator, &poses[5], share).unwrap();
        let expected = [shown.positions, shown.normals];
        assert!(out == expected.map(|v| v.iter().map(|p| p.to_array()).collect::<Vec<_>>()));
    }
    let body = &model.character().body;
    let mut out = [(); 2].map(|()| vec![[0.0; 3]; body.vertices.len()]);
    // SAFETY: as above.
    ok(unsafe { unic_instance_body(instance.0, &buffers(&mut out)) });
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    animator.body(&mut positions);
    vertex_normals(&positions, &body.faces, &mut normals);
    assert!(out == [positions, normals].map(|v| v.iter().map(|p| p.to_array()).collect::<Vec<_>>()));
}

/// Bytes of an instance's state.
fn saved(instance: &InstanceHandle) -> Vec<u8> {
    let mut size = 0;
    // SAFETY: null bytes ask for the size.
    ok(unsafe { unic_instance_save(instance.0, null_mut(), 0, &mut size) });
    let mut bytes = vec![0; size];
    // SAFETY: room for `size` bytes.
    ok(unsafe { unic_instance_save(instance.0, bytes.as_mut_ptr().cast(), size, &mut size) });
    assert_eq!(bytes.len(), size);
    bytes
}

#[test]
fn a_restored_state_continues_with_the_same_bits_in_any_instance() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let (poses, vertices) = (motion(&model, 8), model.vertex_count());
    for cut in [1, 2, 5] {
        let instance = InstanceHandle::new(&handle, |_| ());
        let shown = c_frames(&instance, &poses[..cut], vertices).pop().unwrap();
        let bytes = saved(&instance);
        let finish = |instance: &InstanceHandle| -> Vec<_> {
            let step = |pose| instance.play(Call::Step, &c_input(&c_pose(pose)), vertices);
            poses[cut..].iter().map(step).collect()
        };
        let expected = finish(&instance);
        let other = InstanceHandle::new(&handle, |o| {
            o.threads = UnicThreads::Pool as u32;
            o.thread_count = 2;
        });
        let mut out = [(); 2].map(|()| vec![[0.0; 3]; vertices]);
        let to = buffers(&mut out);
        // SAFETY: bytes and buffers of their sizes.
        ok(unsafe { unic_instance_restore(other.0, bytes.as_ptr().cast(), bytes.len(), &to) });
        assert!(out == shown, "cut at {cut}");
        assert!(finish(&other) == expected, "cut at {cut}");
    }
}

#[test]
fn given_positions_start_a_sequence() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let (poses, vertices) = (motion(&model, 3), model.vertex_count());
    let given: Vec<Vec3> = model.garment().rest.vertices.iter().map(|v| *v * 1.01).collect();
    // In a buffer with gaps.
    let rows: Vec<[f32; 5]> = given
        .iter()
        .map(|p| [p.x, p.y, p.z, f32::NAN, f32::NAN])
        .collect();
    let instance = InstanceHandle::new(&handle, |_| ());
    let mut out = [(); 2].map(|()| vec![[0.0; 3]; vertices]);
    let (pose, to) = (c_pose(&poses[0]), buffers(&mut out));
    let first = rows.as_ptr().cast();
    // SAFETY: rows of 20 bytes, buffers of their sizes.
    ok(unsafe { unic_instance_reset_to(instance.0, &c_input(&pose), first, 20, vertices, &to) });
    let mut animator = Animator::new(model);
    let shown = animator
        .reset(&input(&poses[0]), Start::Positions(&given))
        .unwrap();
    assert!(
        out[0]
            .iter()
            .zip(shown.positions)
            .all(|(a, b)| *a == b.to_array())
    );
}
