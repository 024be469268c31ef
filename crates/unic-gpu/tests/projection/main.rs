//! Contract of the strain projection on a device: it computes the offsets and the shown garment of
//! the CPU in every mode of intersection handling, from every start, and on both sides of a state
//! that moves between the devices.
//!
//! The limits of the models are above the lengths of most predicted edges, so that no offset is
//! zero.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

#[path = "../../../unic-core/tests/common/mod.rs"]
mod common;
#[path = "../device/mod.rs"]
mod device;
mod models;
mod robust;

use common::largest_distance;
use device::{context, gpu_animator};
use models::{
    fine_model, folded_model, masked_fine_model, model, pleated_model, with_projection, without_levels,
};
use std::sync::Arc;
use unic_core::{Animator, AnimatorState, Model, Start, animator::VertexState, config::IntersectionMode};
use unic_gpu::{GpuAnimator, Precision};

const FRAMES: usize = 61;
/// Largest distance between the devices after all frames, metres.
const TOLERANCE: f32 = 1e-3;

const PAPER: IntersectionMode = IntersectionMode::Paper { relaxation_m: 0.005 };

fn start(model: &Arc<Model>, mode: IntersectionMode) -> Option<(Animator, GpuAnimator)> {
    let mut cpu = Animator::new(Arc::clone(model));
    cpu.set_intersection(mode);
    let mut gpu = gpu_animator(&context()?, model, Precision::F32);
    gpu.set_intersection(mode).unwrap();
    Some((cpu, gpu))
}

fn reset(cpu: &mut Animator, gpu: &mut GpuAnimator) {
    let poses = common::motion(2);
    cpu.reset(&common::input(&poses, 0), Start::MeanShape).unwrap();
    gpu.reset(&common::input(&poses, 0), Start::MeanShape).unwrap();
}

fn largest_state_distance(a: &[VertexState], b: &[VertexState]) -> f32 {
    assert_eq!(a.len(), b.len());
    let between = |(a, b): (&VertexState, &VertexState)| {
        let previous = a.previous.distance(b.previous);
        a.value.distance(b.value).max(previous)
    };
    a.iter().zip(b).map(between).fold(0.0, f32::max)
}

/// Largest distance of states and offsets.
fn state_error(cpu: &AnimatorState, gpu: &AnimatorState) -> f32 {
    let states = largest_state_distance(&cpu.vertices, &gpu.vertices);
    states.max(largest_state_distance(&cpu.offsets, &gpu.offsets))
}

fn largest_offset(state: &AnimatorState) -> f32 {
    state.offsets.iter().map(|o| o.value.length()).fold(0.0, f32::max)
}

#[test]
fn offsets_and_positions_agree_with_the_cpu() {
    let with_mask = with_projection(common::parts(&common::variant("masked")));
    for (name, model, mode) in [
        ("paper", model("paper", 0.27), IntersectionMode::Off),
        ("second order", model("second order", 0.27), IntersectionMode::Off),
        ("masked", with_mask, IntersectionMode::Off),
        ("paper", model("paper", 0.17), PAPER),
        ("second order", model("second order", 0.17), PAPER),
    ] {
        let Some((mut cpu, mut gpu)) = start(&model, mode) else {
            return;
        };
        let poses = common::motion(FRAMES);
        reset(&mut cpu, &mut gpu);
        let (mut largest, mut offset) = (0f32, f32::INFINITY);
        for t in 0..FRAMES {
            if t > 0 {
                cpu.step(&common::input(&poses, t)).unwrap();
                gpu.step(&common::input(&poses, t)).unwrap();
            }
            let found = gpu.read_back().unwrap().positions;
            largest = largest.max(largest_distance(&found, cpu.garment().positions));
            largest = largest.max(state_error(cpu.state(), &gpu.state().unwrap()));
            offset = offset.min(largest_offset(cpu.state()));
        }
        assert!(offset > 0.01, "{name}, {mode:?}: offsets of {offset} m");
        assert!(largest < TOLERANCE, "{name}, {mode:?}: {largest} m");
    }
}

/// Compares eight frames of a garment of several workgroups.
fn compare_fine(model: &Arc<Model>, mut cpu: Animator, mut gpu: GpuAnimator) {
    let poses = common::motion(8);
    reset(&mut cpu, &mut gpu);
    for t in 0..8 {
        if t > 0 {
            cpu.step(&common::input(&poses, t)).unwrap();
            gpu.step(&common::input(&poses, t)).unwrap();
        }
        let found = gpu.read_back().unwrap().positions;
        let apart = largest_distance(&found, cpu.garment().positions);
        let apart = apart.max(state_error(cpu.state(), &gpu.state().unwrap()));
        assert!(
            apart < TOLERANCE,
            "{}, frame {t}: {apart} m",
            model.vertex_count()
        );
        assert!(largest_offset(cpu.state()) > 0.01, "frame {t}");
    }
}

#[test]
fn coarse_levels_agree_with_the_cpu() {
    let model = fine_model("second order", 0.27);
    let levels = model.projection().unwrap().levels().unwrap();
    assert_eq!(levels.levels().len(), 2);
    let Some((mut cpu, mut gpu)) = start(&model, IntersectionMode::Off) else {
        return;
    };
    let mut without = Animator::new(without_levels(&model));
    without.set_intersection(IntersectionMode::Off);
    let poses = common::motion(8);
    reset(&mut cpu, &mut gpu);
    let start = common::input(&poses, 0);
    let shown = without.reset(&start, Start::MeanShape).unwrap().positions;
    let apart = largest_distance(shown, cpu.garment().positions);
    assert!(apart > 10.0 * TOLERANCE, "levels move vertices by {apart} m");
    compare_fine(&model, cpu, gpu);
}

/// Compares a model with pushes on both devices, given the same without them.
fn compare_pushes(model: &Arc<Model>, without: Arc<Model>) {
    let Some((mut cpu, mut gpu)) = start(model, IntersectionMode::Off) else {
        return;
    };
    let mut without = Animator::new(without);
    without.set_intersection(IntersectionMode::Off);
    reset(&mut cpu, &mut gpu);
    let poses = common::motion(1);
    let start = common::input(&poses, 0);
    let shown = without.reset(&start, Start::MeanShape).unwrap().positions;
    let apart = largest_distance(shown, cpu.garment().positions);
    assert!(apart > 5.0 * TOLERANCE, "pushes move vertices by {apart} m");
    compare_fine(model, cpu, gpu);
}

#[test]
fn pushes_into_the_order_of_the_cloth_agree_with_the_cpu() {
    let model = folded_model(0.5);
    assert!(model.projection().unwrap().order().is_some());
    compare_pushes(&model, folded_model(0.0));
}

#[test]
fn pushes_between_layers_agree_with_the_cpu() {
    let model = pleated_model([0.5, 0.15]);
    let projection = model.projection().unwrap();
    assert!(projection.layers().is_some() && projection.order().is_some());
    compare_pushes(&model, pleated_model([0.5, 0.0]));
}

/// Folds of these garments are deep inside the body, where rounding decides for a way out, and layers on
/// both sides of it.
#[test]
fn pushes_after_the_handling_agree_with_the_cpu() {
    // Without these pushes on the device three quarters of the vertices differ.
    for (model, most) in [(folded_model(0.5), 0.1), (pleated_model([0.0, 0.15]), 0.2)] {
        let Some((mut cpu, mut gpu)) = start(&model, robust::SHOWN) else {
            return;
        };
        let poses = common::motion(8);
        reset(&mut cpu, &mut gpu);
        let mut far = 0;
        for t in 0..8 {
            if t > 0 {
                cpu.step(&common::input(&poses, t)).unwrap();
                gpu.step(&common::input(&poses, t)).unwrap();
            }
            let found = gpu.read_back().unwrap().positions;
            let pairs = found.iter().zip(cpu.garment().positions);
            far += pairs.filter(|(a, b)| a.distance(**b) >= TOLERANCE).count();
        }
        let share = far as f32 / (8 * model.vertex_count()) as f32;
        assert!(share < most, "{share}");
    }
}

#[test]
fn a_mask_on_a_fine_garment_agrees_with_the_cpu() {
    let model = masked_fine_model("second order", 0.27);
    if let Some((cpu, gpu)) = start(&model, IntersectionMode::Off) {
        compare_fine(&model, cpu, gpu);
    }
}

/// Workgroups have a third of the usual memory.
#[test]
fn a_fine_garment_within_default_limits_agrees_with_the_cpu() {
    let Some(context) = device::context_with_default_limits() else {
        return;
    };
    let model = fine_model("second order", 0.27);
    let mut cpu = Animator::new(Arc::clone(&model));
    let mut gpu = gpu_animator(&context, &model, Precision::F32);
    cpu.set_intersection(IntersectionMode::Off);
    gpu.set_intersection(IntersectionMode::Off).unwrap();
    compare_fine(&model, cpu, gpu);
}

/// The state moves to the GPU at frame 5, and to another CPU animator and back at frame 10.
#[test]
fn offsets_move_between_devices() {
    let model = model("second order", 0.27);
    let Some((mut cpu, mut gpu)) = start(&model, IntersectionMode::Off) else {
        return;
    };
    let poses = common::motion(16);
    cpu.reset(&common::input(&poses, 0), Start::MeanShape).unwrap();
    for t in 1..16 {
        if t == 5 {
            gpu.restore(cpu.state().clone()).unwrap();
            assert_eq!(gpu.state().unwrap(), *cpu.state());
            let shown = gpu.read_back().unwrap().positions;
            assert!(largest_distance(&shown, cpu.garment().positions) < 1e-5);
        }
        if t == 10 {
            let mut other = Animator::new(Arc::clone(&model));
            let restored = other.restore(gpu.state().unwrap()).unwrap();
            let shown = gpu.read_back().unwrap().positions;
            assert!(largest_distance(&shown, restored.positions) < 1e-5);
            gpu.restore(other.state().clone()).unwrap();
        }
        cpu.step(&common::input(&poses, t)).unwrap();
        if t >= 5 {
            gpu.step(&common::input(&poses, t)).unwrap();
        }
    }
    assert!(largest_offset(cpu.state()) > 0.01);
    let error = state_error(cpu.state(), &gpu.state().unwrap());
    assert!(error < TOLERANCE, "{error} m");
}

#[test]
fn given_positions_have_no_offsets() {
    let model = model("second order", 0.27);
    let Some((mut cpu, mut gpu)) = start(&model, IntersectionMode::Off) else {
        return;
    };
    let given = model.garment().rest.vertices.clone();
    let poses = common::motion(4);
    for t in 0..4 {
        let input = common::input(&poses, t);
        match t {
            0 => {
                cpu.reset(&input, Start::Positions(&given)).unwrap();
                gpu.reset(&input, Start::Positions(&given)).unwrap();
            }
            _ => {
                cpu.step(&input).unwrap();
                gpu.step(&input).unwrap();
                assert!(largest_offset(&gpu.state().unwrap()) > 0.01);
                let error = state_error(cpu.state(), &gpu.state().unwrap());
                assert!(error < 1e-4, "{error} m");
                cpu.set_garment(&given).unwrap();
                gpu.set_garment(&given).unwrap();
            }
        }
        let shown = gpu.read_back().unwrap().positions;
        assert!(largest_distance(&shown, &given) < 1e-5);
        assert_eq!(largest_offset(&gpu.state().unwrap()), 0.0);
    }
}

#[test]
fn a_start_at_the_mean_shape_has_offsets_at_rest() {
    let model = model("second order", 0.27);
    let Some((mut cpu, mut gpu)) = start(&model, IntersectionMode::Off) else {
        return;
    };
    let poses = common::motion(3);
    // A reset forgets the offsets of the steps before.
    for t in 0..3 {
        reset(&mut cpu, &mut gpu);
        let state = gpu.state().unwrap();
        assert!(state.offsets.iter().all(|o| o.value == o.previous));
        assert!(largest_offset(&state) > 0.01);
        let error = state_error(cpu.state(), &state);
        assert!(error < 1e-4, "{error} m");
        gpu.step(&common::input(&poses, t)).unwrap();
    }
}
