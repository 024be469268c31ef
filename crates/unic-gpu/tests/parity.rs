//! The device and the CPU give the same garment.
//!
//! Every kind of model of `unic-core`'s tests, small, with random weights, in one step and over 60 frames of
//! free running: positions within 1 mm. Without an adapter the tests say so and pass.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

#[path = "../../unic-core/tests/common/mod.rs"]
mod common;
mod device;

use device::{context, gpu_animator};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{Animator, Model, Start, config::*, intersection::Handling};
use unic_gpu::{GpuAnimator, Precision, wgpu::Features};

const FRAMES: usize = 61;

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
        assert!(
            errors[0] < 1e-3 && errors[1] < 5e-3,
            "{}: {errors:?}",
            variant.name
        );
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
    let differ =
        |(a, b): (&Vec<Vec3>, &Vec<Vec3>)| a.iter().zip(b).filter(|(a, b)| a.distance(**b) > 1e-3).count();
    off.iter().zip(&on).map(differ).sum()
}

#[test]
fn the_papers_intersection_handling_is_the_cpus() {
    let Some(context) = context() else { return };
    for name in [
        "paper",
        "one-hot code",
        "paper, motion relative to the root",
        "second order",
        "pose only",
    ] {
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
        // Vertices that the rule puts at one place have no normal to speak of.
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
            let mut seed = Handling::NO_SEED;
            let corrected = handling.correct(vertex, p, &mut seed);
            moved += usize::from(corrected.is_some());
            largest = largest.max(corrected.unwrap_or(p).distance(found));
        }
    }
    assert!(moved > 100 && largest < 1e-3, "{moved} moved, {largest} m");
}

/// The field of the paper's size: several tiles, chunks of weights and columns of invocations.
fn of_published_size(state: StateConfig) -> Arc<Model> {
    let mut parts = common::parts(&common::variant("second order"));
    let config = ModelConfig {
        encoder: EncoderConfig {
            hidden: vec![70, 33],
            channels: 128,
            categories: 8,
            code: LatentCode::PickedLogit,
        },
        field: FieldConfig {
            width: 256,
            hidden_layers: 8,
            skip: Some(5),
        },
        state,
        ..parts.config
    };
    parts = common::with_networks(config, parts.garment, parts.prior, Some(5.0));
    Arc::new(Model::new(parts).unwrap())
}

#[test]
fn a_field_of_the_published_size_runs_as_on_the_cpu() {
    let Some(context) = context() else { return };
    let displacement = common::variant("short limit").state;
    for state in [StateConfig::RootRelative, displacement] {
        let model = of_published_size(state);
        let mut cpu = Animator::new(Arc::clone(&model));
        let mut gpu = gpu_animator(&context, &model, Precision::F32);
        let errors = largest_errors(&mut cpu, &mut gpu, 5);
        assert!(errors[0] < 1e-4, "{errors:?}");
    }
}

/// Halves have 11 bits: outputs of a few centimetres are wrong by some hundredths of a millimetre.
#[test]
fn half_precision_stays_close() {
    let Some(context) = context() else { return };
    if !context.has(Features::SHADER_F16) {
        eprintln!("skipped: {} does not compute in f16", context.adapter_name());
        return;
    }
    for model in [
        of_published_size(common::variant("short limit").state),
        common::model(&common::variant("pose only")),
    ] {
        let mut cpu = Animator::new(Arc::clone(&model));
        let mut gpu = gpu_animator(&context, &model, Precision::F16);
        let errors = largest_errors(&mut cpu, &mut gpu, 5);
        // Not as close as f32, or halves would not be in use.
        assert!(errors[0] > 1e-5 && errors[0] < 5e-4, "{errors:?}");
    }
}

/// Closer than halves without matrix units: sums are in single precision.
#[test]
fn matrix_units_stay_closer() {
    let Some(context) = device::context_with_matrix_units() else {
        return;
    };
    // Two as wide as whole matrices, and two whose width of 18 is padded.
    for model in [
        of_published_size(common::variant("short limit").state),
        of_published_size(StateConfig::RootRelative),
        common::model(&common::variant("pose only")),
        common::model(&common::variant("second order")),
    ] {
        let [halves, matrices] = [Precision::F16, Precision::F16Matrix].map(|precision| {
            let mut cpu = Animator::new(Arc::clone(&model));
            let mut gpu = gpu_animator(&context, &model, precision);
            largest_errors(&mut cpu, &mut gpu, 5)[0]
        });
        assert!(matrices > 1e-5 && matrices < halves, "{matrices} {halves}");
    }
}
