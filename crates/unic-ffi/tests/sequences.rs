//! Contract: a reset and a restored state begin anew for the display too, every intersection rule is
//! that of the Rust library, a state continues at another sampling, and one of another model is
//! refused.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

use common::*;
use std::{
    ffi::CString,
    ptr::{null, null_mut},
    sync::Arc,
};
use unic::*;
use unic_core::{Animator, Corrects, IntersectionMode, Pose, Precision, PrecisionErrors, Start};

/// Garment that an instance displays on a pose, half-way from the tick before to the last one.
fn displayed(instance: &InstanceHandle, pose: &Pose, vertices: usize) -> [Vec<[f32; 3]>; 2] {
    let mut out = [(); 2].map(|()| vec![[0.0; 3]; vertices]);
    // SAFETY: structs and buffers of their sizes.
    ok(unsafe { unic_instance_display(instance.0, &c_pose(pose), 0.5, &buffers(&mut out)) });
    out
}

/// Bytes of an instance's state.
fn saved(instance: &InstanceHandle) -> Vec<u8> {
    let mut size = 0;
    // SAFETY: null bytes ask for the size.
    ok(unsafe { unic_instance_save(instance.0, null_mut(), 0, &mut size) });
    let mut bytes = vec![0; size];
    // SAFETY: room for `size` bytes.
    ok(unsafe { unic_instance_save(instance.0, bytes.as_mut_ptr().cast(), size, &mut size) });
    bytes
}

#[test]
fn the_display_forgets_what_was_before_a_reset_or_a_restored_state() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let (poses, vertices) = (motion(&model, 6), model.vertex_count());
    let fresh = InstanceHandle::new(&handle, |_| ());
    c_frames(&fresh, &poses[..1], vertices);
    let expected = displayed(&fresh, &poses[2], vertices);
    let (state, used) = (saved(&fresh), InstanceHandle::new(&handle, |_| ()));
    c_frames(&used, &poses, vertices);
    assert!(displayed(&used, &poses[2], vertices) != expected);
    c_frames(&used, &poses[..1], vertices);
    assert!(displayed(&used, &poses[2], vertices) == expected, "after a reset");
    c_frames(&used, &poses, vertices);
    // SAFETY: bytes of their length.
    ok(unsafe { unic_instance_restore(used.0, state.as_ptr().cast(), state.len(), null()) });
    assert!(
        displayed(&used, &poses[2], vertices) == expected,
        "after a restored state"
    );
}

#[test]
fn every_intersection_rule_is_that_of_the_rust_library() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let (poses, vertices) = (motion(&model, 3), model.vertex_count());
    let robust = |margin_m, corrects| IntersectionMode::Robust { margin_m, corrects };
    let mut all = Vec::new();
    for (given, distance_m, mode) in [
        (UnicIntersection::Model, 0.0, model.config().intersection),
        (UnicIntersection::Off, 0.0, IntersectionMode::Off),
        (
            UnicIntersection::Paper,
            0.0,
            IntersectionMode::Paper { relaxation_m: 0.005 },
        ),
        (
            UnicIntersection::Paper,
            0.01,
            IntersectionMode::Paper { relaxation_m: 0.01 },
        ),
        (UnicIntersection::Robust, 0.0, robust(0.003, Corrects::Display)),
        (UnicIntersection::Robust, 0.01, robust(0.01, Corrects::Display)),
        (UnicIntersection::RobustState, 0.01, robust(0.01, Corrects::State)),
    ] {
        let instance = InstanceHandle::new(&handle, |o| {
            o.intersection = given as u32;
            o.intersection_distance_m = distance_m;
        });
        let found = c_frames(&instance, &poses, vertices).pop().unwrap();
        let mut animator = Animator::new(Arc::clone(&model));
        animator.set_intersection(mode);
        animator.reset(&input(&poses[0]), Start::MeanShape).unwrap();
        for pose in &poses[1..] {
            animator.step(&input(pose)).unwrap();
        }
        let expected: Vec<_> = animator
            .garment()
            .positions
            .iter()
            .map(|p| p.to_array())
            .collect();
        assert!(found[0] == expected, "{given:?}, {distance_m}");
        all.push(expected);
    }
    // The first one may be the same as one of the others.
    for (i, a) in all.iter().enumerate().skip(1) {
        assert!(all[1..i].iter().all(|b| a != b), "two rules do the same");
    }
}

#[test]
fn the_fastest_precision_within_the_allowed_error_is_the_default() {
    let mut parts = lively_model().to_parts();
    let errors = PrecisionErrors {
        f32: 10.0,
        bf16: Some(10.3),
        int16: Some(10.3),
        int8: Some(10.3),
    };
    parts.about.training = serde_json::json!({ PrecisionErrors::KEY: errors });
    let model = unic_core::Model::new(parts).unwrap();
    let handle = ModelHandle::of(&model);
    let (poses, vertices) = (motion(&model, 3), model.vertex_count());
    let width = model.config().field.width;
    let [fastest, ..] = Precision::fastest_first(width);
    for (share, expected) in [(0.0, Precision::F32), (0.05, fastest)] {
        let instance = InstanceHandle::new(&handle, |o| o.precision_error = share);
        let (mut found, mut slower) = (9, 9);
        // SAFETY: a handle and places for two numbers.
        let status = unsafe { unic_instance_precision(instance.0, &mut found, &mut slower) };
        assert_eq!(status, UnicStatus::Ok);
        assert_eq!((found, slower), (UnicPrecision::from(expected) as u32, 0));
        let expected = model.clone().with_precision(expected);
        let expected = core_frames(&Arc::new(expected), &poses);
        assert!(c_frames(&instance, &poses, vertices) == expected, "{share}");
    }
}

/// `unic bench --out` writes such a file.
#[test]
fn the_share_of_samples_of_a_file_is_the_default() {
    let sampled = unic_core::Model::clone(&lively_model())
        .with_sampling(0.3)
        .unwrap();
    let handle = ModelHandle::of(&sampled);
    let (poses, vertices) = (motion(&sampled, 3), sampled.vertex_count());
    let packed = sampled.clone().with_precision(Precision::Int8);
    let whole = sampled.clone().with_sampling(1.0).unwrap();
    let expected = [&sampled, &packed, &whole].map(|m| core_frames(&Arc::new(m.clone()), &poses));
    let cases = [
        (UnicPrecision::Auto, 0.0),
        (UnicPrecision::Int8, 0.0),
        (UnicPrecision::F32, 1.0),
    ];
    for ((precision, sampling), expected) in cases.into_iter().zip(&expected) {
        let instance = InstanceHandle::new(&handle, |o| {
            o.precision = precision as u32;
            o.sampling = sampling;
        });
        assert!(
            c_frames(&instance, &poses, vertices) == *expected,
            "{precision:?}, {sampling}"
        );
    }
    assert!(expected[0] != expected[1] && expected[0] != expected[2]);
}

/// The caller changes the sampling when a character comes nearer or goes away.
#[test]
fn a_state_continues_at_another_sampling_as_in_the_rust_library() {
    let lively = lively_model();
    let (handle, poses) = (ModelHandle::of(&lively), motion(&lively, 6));
    let sampled = |share: f32| Arc::new(unic_core::Model::clone(&lively).with_sampling(share).unwrap());
    let mut ends = Vec::new();
    for (before, after) in [(1.0, 1.0), (1.0, 0.3), (0.3, 1.0)] {
        let new = |share| InstanceHandle::new(&handle, |o| o.sampling = share);
        let (first, second) = (new(before), new(after));
        c_frames(&first, &poses[..3], lively.vertex_count());
        let state = saved(&first);
        // SAFETY: bytes of their length.
        ok(unsafe { unic_instance_restore(second.0, state.as_ptr().cast(), state.len(), null()) });
        let (mut near, mut far) = (Animator::new(sampled(before)), Animator::new(sampled(after)));
        near.reset(&input(&poses[0]), Start::MeanShape).unwrap();
        for pose in &poses[1..3] {
            near.step(&input(pose)).unwrap();
        }
        far.restore(near.state().clone()).unwrap();
        for pose in &poses[3..] {
            let found = second.play(Call::Step, &c_input(&c_pose(pose)), lively.vertex_count());
            let shown = far.step(&input(pose)).unwrap().positions.iter();
            let expected: Vec<_> = shown.map(|p| p.to_array()).collect();
            assert!(found[0] == expected, "from {before} to {after}");
            ends.push(expected);
        }
    }
    assert!(
        ends[2] != ends[5] && ends[2] != ends[8],
        "sampling changes nothing"
    );
}

#[test]
fn a_state_of_another_model_is_refused() {
    let (shirt, skirt) = (ModelHandle::open(), garment_path().with_file_name("skirt.unic"));
    let path = CString::new(skirt.to_str().unwrap()).unwrap();
    let mut model = null_mut();
    // SAFETY: a text and a place for a handle.
    ok(unsafe { unic_model_from_path(path.as_ptr(), &mut model) });
    let skirt = InstanceHandle::new(&ModelHandle(model), |_| ());
    let state = saved(&skirt);
    let shirt = InstanceHandle::new(&shirt, |_| ());
    // SAFETY: bytes of their length.
    let status = unsafe { unic_instance_restore(shirt.0, state.as_ptr().cast(), state.len(), null()) };
    refused(status, UnicStatus::BadState, "a state of this model");
}
