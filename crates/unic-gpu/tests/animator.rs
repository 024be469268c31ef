//! What callers rely on beside equal numbers: states that go from one device to another, instances that
//! share an asset, a device of the caller's own, errors that leave the state as it was.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

#[path = "../../unic-core/tests/common/mod.rs"]
mod common;
mod device;

use device::{context, gpu_animator};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{Animator, AnimatorError, Model, Start, config::FieldConfig};
use unic_gpu::{GpuAnimator, GpuContext, GpuError, GpuModel, Precision, wgpu};

fn largest_distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

#[test]
fn a_state_goes_on_on_the_other_device() {
    let Some(context) = context() else { return };
    let poses = common::motion(12);
    for name in ["paper", "second order", "displacement in the paper's layout"] {
        let model = common::model(&common::variant(name));
        // Handed over before the first step and after some.
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
fn instances_share_an_asset_and_nothing_else() {
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
fn a_garment_is_placed_where_it_is_told() {
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

/// A device with the least that WebGPU promises: smaller tiles, eight storage buffers.
#[test]
fn a_device_of_the_callers_needs_no_more_than_default_limits() {
    if context().is_none() {
        return;
    }
    let (device, queue) = pollster::block_on(async {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter = instance.request_adapter(&Default::default()).await.unwrap();
        adapter.request_device(&Default::default()).await.unwrap()
    });
    let own = GpuContext::from_device(device, queue);
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
    // Neither halves nor timestamps were asked for.
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
fn what_does_not_belong_to_the_model_is_refused() {
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
fn a_field_wider_than_the_device_holds_is_refused() {
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
