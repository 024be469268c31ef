//! The device and the CPU give the same garment.
//!
//! Every kind of model of `unic-core`'s tests, small, with random weights, in one step and over 60 frames of
//! free running: positions within 1 mm, a hundredth of it where nothing is discontinuous. Without an
//! adapter the tests say so and pass.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

#[path = "../../unic-core/tests/common/mod.rs"]
mod common;

use glam::Vec3;
use std::sync::{Arc, OnceLock};
use unic_core::{
    animator::{Animator, Start},
    config::{Corrects, IntersectionMode},
    intersection::Handling,
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

/// A model whose garment cuts into the body.
fn tight(variant: &str) -> Arc<Model> {
    let mut parts = common::parts(&common::variant(variant));
    parts.garment = common::tube(13, 12, 0.17);
    Arc::new(Model::new(parts).unwrap())
}

/// How many vertices a mode of the CPU's moves at all over a clip.
fn moved(model: &Arc<Model>, mode: IntersectionMode, frames: usize) -> usize {
    let poses = common::motion(frames);
    let [mut off, mut on] = [IntersectionMode::Off, mode].map(|mode| {
        let mut animator = Animator::new(Arc::clone(model));
        animator.set_intersection(mode);
        animator
    });
    let (off, on) = (common::run(&mut off, &poses), common::run(&mut on, &poses));
    let differ = |(a, b): (&Vec<Vec3>, &Vec<Vec3>)| a.iter().zip(b).filter(|(a, b)| a.distance(**b) > 1e-3).count();
    off.iter().zip(&on).map(differ).sum()
}

#[test]
fn the_papers_intersection_handling_is_the_cpus() {
    let Some(context) = context() else { return };
    for name in ["paper", "second order", "pose only"] {
        let model = tight(name);
        let mode = IntersectionMode::Paper { relaxation_m: 0.005 };
        assert!(moved(&model, mode, FRAMES) > 100, "{name} must cut into the body");
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

/// What is shown is corrected vertex by vertex: the CPU's rule, without what it does to faces.
#[test]
fn the_robust_handling_moves_each_vertex_as_the_cpu_does() {
    let Some(context) = context() else { return };
    let model = tight("second order");
    let (character, garment) = (model.character(), model.garment());
    let mode = IntersectionMode::Robust {
        margin_m: 0.003,
        corrects: Corrects::Display,
    };
    let mut handling = Handling::new(mode, character, garment);
    let mut cpu = Animator::new(Arc::clone(&model));
    let mut gpu = gpu_animator(&context, &model, Precision::F32);
    gpu.set_intersection(mode).unwrap();
    let poses = common::motion(FRAMES);
    let (mut body, mut largest, mut moved) = (Vec::new(), 0f32, 0);
    for t in 0..FRAMES {
        let input = common::input(&poses, t);
        if t == 0 {
            cpu.reset(&input, Start::MeanShape).unwrap();
            gpu.reset(&input, Start::MeanShape).unwrap();
        } else {
            cpu.step(&input).unwrap();
            gpu.step(&input).unwrap();
        }
        cpu.body(&mut body);
        handling.pose(character, &body);
        let found = gpu.read_back().unwrap().positions;
        for (vertex, (&p, found)) in cpu.garment().positions.iter().zip(found).enumerate() {
            let corrected = handling.correct(vertex, p, &mut Handling::no_seed());
            moved += usize::from(corrected.is_some());
            largest = largest.max(corrected.unwrap_or(p).distance(found));
        }
    }
    eprintln!("{moved} moved, {largest} m");
    assert!(moved > 100 && largest < 1e-3, "{moved} moved, {largest} m");
}
