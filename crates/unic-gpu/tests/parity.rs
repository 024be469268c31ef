//! The device and the CPU give the same garment.
//!
//! Every kind of model of `unic-core`'s tests, small, with random weights, in one step and over 60 frames of
//! free running: positions within 1 mm, a hundredth of it where nothing is discontinuous. Without an
//! adapter the tests say so and pass.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

#[path = "../../unic-core/tests/common/mod.rs"]
mod common;

use std::sync::{Arc, OnceLock};
use unic_core::{
    animator::{Animator, Start},
    config::IntersectionMode,
    model::Model,
};
use unic_gpu::{GpuAnimator, GpuContext, GpuError, GpuModel, Precision};

const FRAMES: usize = 61;

/// One device for all tests, if this machine has any.
fn context() -> Option<GpuContext> {
    static CONTEXT: OnceLock<Option<GpuContext>> = OnceLock::new();
    let make = || match GpuContext::new() {
        Ok(context) => Some(context),
        Err(GpuError::NoAdapter(why)) => {
            eprintln!("skipped: no adapter that computes ({why})");
            None
        }
        Err(other) => panic!("{other}"),
    };
    CONTEXT.get_or_init(make).clone()
}

fn gpu_animator(context: &GpuContext, model: &Arc<Model>, precision: Precision) -> GpuAnimator {
    let asset = GpuModel::new(context, Arc::clone(model), precision).unwrap();
    GpuAnimator::new(Arc::new(asset)).unwrap()
}

/// Largest distances of positions and normals over a clip.
fn largest_errors(cpu: &mut Animator, gpu: &mut GpuAnimator, frames: usize) -> [f32; 2] {
    let poses = common::motion(frames);
    let mut largest = [0f32; 2];
    for t in 0..frames {
        let input = common::input(&poses, t);
        if t == 0 {
            cpu.reset(&input, Start::MeanShape).unwrap();
            gpu.reset(&input, Start::MeanShape).unwrap();
        } else {
            cpu.step(&input).unwrap();
            gpu.step(&input).unwrap();
        }
        let (expected, found) = (cpu.garment(), gpu.read_back().unwrap());
        let pairs = expected.positions.iter().zip(&found.positions);
        largest[0] = pairs.map(|(a, b)| a.distance(*b)).fold(largest[0], f32::max);
        let pairs = expected.normals.iter().zip(&found.normals);
        largest[1] = pairs.map(|(a, b)| a.distance(*b)).fold(largest[1], f32::max);
    }
    largest
}

#[test]
fn every_kind_of_model_runs_as_on_the_cpu() {
    let Some(context) = context() else { return };
    for variant in common::variants() {
        let model = common::model(&variant);
        let (mut cpu, mut gpu) = (
            Animator::new(Arc::clone(&model)),
            gpu_animator(&context, &model, Precision::F32),
        );
        let errors = largest_errors(&mut cpu, &mut gpu, FRAMES);
        eprintln!("{}: {errors:?}", variant.name);
        assert!(errors[0] < 1e-3, "{}: {errors:?}", variant.name);
    }
}

#[test]
fn the_papers_intersection_handling_is_the_cpus() {
    let Some(context) = context() else { return };
    for name in ["paper", "second order"] {
        let model = common::model(&common::variant(name));
        let mode = IntersectionMode::Paper { relaxation_m: 0.005 };
        let (mut cpu, mut gpu) = (
            Animator::new(Arc::clone(&model)),
            gpu_animator(&context, &model, Precision::F32),
        );
        cpu.set_intersection(mode);
        gpu.set_intersection(mode).unwrap();
        let errors = largest_errors(&mut cpu, &mut gpu, FRAMES);
        eprintln!("{name}: {errors:?}");
        assert!(errors[0] < 1e-3, "{name}: {errors:?}");
    }
}
