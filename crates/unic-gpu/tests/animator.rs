//! Contract of a GPU animator besides equal numbers: states move between devices, instances share
//! only their asset, a caller may bring the device, and errors leave the state as it was.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

#[path = "../../unic-core/tests/common/mod.rs"]
mod common;
mod device;

use device::{context, gpu_animator};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{Animator, AnimatorError, Model, Start, config::FieldConfig};
use unic_gpu::{GpuAnimator, GpuError, GpuModel, Precision, wgpu};

fn largest_distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

#[test]
fn a_state_continues_on_the_other_device() {
    let Some(context) = context() else { return };
    let poses = common::motion(12);
    for name in ["paper", "second order", "displacement in the paper's layout"] {
        let model = common::model(&common::variant(name));
        // The state moves before the first step, or after some.
        for handed_over in [0, 5] {
            let mut cpu = Animator::new(Arc::clone(&model));
            let mut gpu = gpu_animator(&context, &model, Precision::F32);
            cpu.reset(&common::input(&poses, 0), Start::MeanShape).unwrap();
            for t in 1..=handed_over {
                cpu.step(&common::input(&poses, t)).unwrap();
            }
            gpu.restore(cpu.state().clone()).unwrap();
            let shown = gpu.read_back().unwrap().positions;
            assert!(largest_distance(&shown, cpu.garment().positions) < 1e-5);
            for t in handed_over + 1..8 {
                cpu.step(&common::input(&poses, t)).unwrap();
                gpu.step(&common::input(&poses, t)).unwrap();
            }
            let state = gpu.state().unwrap();
            let mut back = Animator::new(Arc::clone(&model));
            back.restore(state).unwrap();
            for t in 8..12 {
                cpu.step(&common::input(&poses, t)).unwrap();
                back.step(&common::input(&poses, t)).unwrap();
            }
            let error = largest_distance(back.garment().positions, cpu.garment().positions);
            assert!(error < 1e-3, "{name}: {error} m");
        }
    }
}

#[test]
fn instances_share_only_their_asset() {
    let Some(context) = context() else { return };
    let model = common::model(&common::variant("second order"));
    let asset = Arc::new(GpuModel::new(&context, Arc::clone(&model), Precision::F32).unwrap());
    let poses = common::motion(12);
    let mut alone = GpuAnimator::new(Arc::clone(&asset)).unwrap();
    let mut run = |start: usize, mut other: Option<&mut GpuAnimator>| {
        alone
            .reset(&common::input(&poses, start), Start::MeanShape)
            .unwrap();
        for t in start + 1..start + 6 {
            alone.step(&common::input(&poses, t)).unwrap();
            if let Some(other) = &mut other {
                other.step(&common::input(&poses, t % 3)).unwrap();
            }
        }
        alone.read_back().unwrap()
    };
    let expected = run(2, None);
    let mut other = GpuAnimator::new(asset).unwrap();
    assert_eq!(run(2, Some(&mut other)), expected);
    assert!(largest_distance(&other.read_back().unwrap().positions, &expected.positions) > 1e-3);
}

#[test]
fn a_garment_starts_at_given_positions() {
    let Some(context) = context() else { return };
    let poses = common::motion(4);
    let model = common::model(&common::variant("second order"));
    let given: Vec<Vec3> = (model.garment().rest.vertices.iter())
        .map(|v| *v * 1.1 + Vec3::X)
        .collect();
    let mut cpu = Animator::new(Arc::clone(&model));
    let mut gpu = gpu_animator(&context, &model, Precision::F32);
    let start = || Start::Positions(&given);
    cpu.reset(&common::input(&poses, 0), start()).unwrap();
    gpu.reset(&common::input(&poses, 0), start()).unwrap();
    assert!(largest_distance(&gpu.read_back().unwrap().positions, &given) < 1e-5);
    for t in 1..4 {
        cpu.step(&common::input(&poses, t)).unwrap();
        gpu.step(&common::input(&poses, t)).unwrap();
        cpu.set_garment(&given).unwrap();
        gpu.set_garment(&given).unwrap();
    }
    cpu.step(&common::input(&poses, 3)).unwrap();
    gpu.step(&common::input(&poses, 3)).unwrap();
    let error = largest_distance(&gpu.read_back().unwrap().positions, cpu.garment().positions);
    assert!(error < 1e-3, "{error} m");
}

/// Uses a device with the default limits of WebGPU: smaller tiles, eight storage buffers.
#[test]
fn default_limits_suffice_for_a_callers_device() {
    let Some(own) = device::context_with_default_limits() else {
        return;
    };
    let model = common::model(&common::variant("second order"));
    let mut gpu = gpu_animator(&own, &model, Precision::F32);
    let mut cpu = Animator::new(Arc::clone(&model));
    let poses = common::motion(5);
    cpu.reset(&common::input(&poses, 0), Start::MeanShape).unwrap();
    gpu.reset(&common::input(&poses, 0), Start::MeanShape).unwrap();
    for t in 1..5 {
        cpu.step(&common::input(&poses, t)).unwrap();
        gpu.step(&common::input(&poses, t)).unwrap();
    }
    let error = largest_distance(&gpu.read_back().unwrap().positions, cpu.garment().positions);
    assert!(error < 1e-3, "{error} m");
    assert!(gpu.vertex_buffer().usage().contains(wgpu::BufferUsages::VERTEX));
    assert_eq!(
        gpu.vertex_buffer().size(),
        GpuAnimator::VERTEX_STRIDE * model.vertex_count() as u64
    );
    // The device was requested without f16 and timestamps.
    let half = GpuModel::new(&own, model, Precision::F16);
    assert!(matches!(
        half,
        Err(GpuError::Feature {
            feature: "SHADER_F16",
            ..
        })
    ));
    let timed = gpu.step_timed(&common::input(&poses, 4));
    assert!(matches!(timed, Err(GpuError::Feature { .. })));
}

#[test]
fn input_that_does_not_fit_the_model_is_refused() {
    let Some(context) = context() else { return };
    let model = common::model(&common::variant("second order"));
    let mut gpu = gpu_animator(&context, &model, Precision::F32);
    let poses = common::motion(2);
    let before = gpu.state().unwrap();
    let mut other = poses.clone();
    other[1].local.pop();
    let refused = gpu.step(&common::input(&other, 1)).unwrap_err();
    assert!(matches!(refused, GpuError::Input(AnimatorError::Joints { .. })));
    let refused = gpu.set_garment(&[Vec3::ZERO]).unwrap_err();
    assert!(matches!(refused, GpuError::Input(AnimatorError::Vertices { .. })));
    let mut lost = before.clone();
    lost.vertices[3].value.x = f32::NAN;
    let refused = gpu.restore(lost).unwrap_err();
    assert_eq!(refused, GpuError::Input(AnimatorError::Position { vertex: 3 }));
    assert_eq!(gpu.state().unwrap(), before);
}

#[test]
fn a_field_that_is_too_wide_for_the_device_is_refused() {
    let Some(context) = context() else { return };
    let mut parts = common::parts(&common::variant("pose only"));
    parts.config.field = FieldConfig {
        width: 8192,
        hidden_layers: 1,
        skip: None,
    };
    let parts = common::with_networks(parts.config, parts.garment, parts.prior, None);
    let model = Arc::new(Model::new(parts).unwrap());
    let refused = GpuModel::new(&context, model, Precision::F32).unwrap_err();
    assert!(
        matches!(refused, GpuError::TooLarge { found: 8192, .. }),
        "{refused}"
    );
}
