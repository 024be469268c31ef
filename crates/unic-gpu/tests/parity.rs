//! Contract: the device and the CPU compute the same garment.
//!
//! Positions agree within 1 mm in one step and over 60 frames of free running. The models are those
//! of `unic-core`'s tests: every kind, small, with random weights. Without an adapter the tests
//! print that they are skipped, and pass.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

#[path = "../../unic-core/tests/common/mod.rs"]
mod common;
mod device;

use device::{context, gpu_animator};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{Animator, Model, Start, config::*, intersection::Handling};
use unic_gpu::{GpuAnimator, GpuContext, Precision, wgpu::Features};

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
fn every_kind_of_model_agrees_with_the_cpu() {
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

/// Both devices keep as much of a given garment, show as much of a replay beside it, and continue
/// from each other's states.
#[test]
fn a_given_garment_stays_like_on_the_cpu() {
    let Some(context) = context() else { return };
    let poses = common::motion(24);
    for name in ["kept garment", "kept garment, projected", "second order"] {
        let model = common::model(&common::variant(name));
        let mut cpu = Animator::new(Arc::clone(&model));
        let mut gpu = gpu_animator(&context, &model, Precision::F32);
        let raised = |positions: &[Vec3]| positions.iter().map(|p| *p + Vec3::Y * 0.03).collect();
        let first = common::input(&poses, 0);
        let given: Vec<Vec3> = raised(cpu.reset(&first, Start::MeanShape).unwrap().positions);
        cpu.reset(&first, Start::Positions(&given)).unwrap();
        gpu.reset(&first, Start::Positions(&given)).unwrap();
        let mut shares = Vec::new();
        for t in 1..poses.len() {
            let input = common::input(&poses, t);
            let expected = cpu.step(&input).unwrap().positions.to_vec();
            gpu.step(&input).unwrap();
            let found = gpu.read_back().unwrap().positions;
            let error = common::largest_distance(&found, &expected);
            assert!(error < 1e-3, "{name}, frame {t}: {error} m");
            let (state, expected) = (gpu.state().unwrap(), &cpu.state().start);
            assert!(
                (state.start.share - expected.share).abs() < 1e-3,
                "{name}, frame {t}"
            );
            shares.push(expected.share);
            match t {
                8 => {
                    let again: Vec<Vec3> = raised(&found);
                    cpu.set_garment(&again).unwrap();
                    gpu.set_garment(&again).unwrap();
                }
                12 => gpu.restore(cpu.state().clone()).unwrap(),
                15 => drop(cpu.restore(state).map(drop)),
                _ => {}
            }
        }
        let is_partial = |share: &f32| (0.02..0.98).contains(share);
        assert!(shares.iter().any(is_partial), "{name}: {shares:?}");
        assert!(shares[8] > shares[7], "{name}: given again after frame 8");
    }
}

/// Model whose garment cuts into the body.
fn tight(variant: &str) -> Arc<Model> {
    let mut parts = common::parts(&common::variant(variant));
    parts.garment = common::tube(13, 12, 0.17);
    Arc::new(Model::new(parts).unwrap())
}

/// The same model with weights of the heaviest joint alone, and its former weights as carriers.
fn carried(model: &Model) -> Arc<Model> {
    let mut parts = model.to_parts();
    let weights = parts.garment.weights.pruned(1, 0.0);
    parts.garment.carriers = Some(std::mem::replace(&mut parts.garment.weights, weights));
    Arc::new(Model::new(parts).unwrap())
}

/// Number of vertices that a mode moves on the CPU, summed over the frames of a clip.
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
fn the_papers_intersection_handling_agrees_with_the_cpu() {
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
        // Normals are not compared: the rule moves several vertices to one place, where faces
        // degenerate.
        assert!(errors[0] < 1e-3, "{name}: {errors:?}");
    }
}

/// Compares with the CPU's corrections of single vertices, since devices do not lift faces.
#[test]
fn the_robust_handling_of_each_vertex_agrees_with_the_cpu() {
    let Some(context) = context() else { return };
    let model = tight("second order");
    let carried = carried(&model);
    for model in [model, carried] {
        assert_eq!(compare_robust_handling(&context, &model), 0);
    }
    // Its layers keep their order.
    let raised = compare_robust_handling(&context, &finer("second order"));
    assert!(raised > 100, "{raised} raised");
}

/// Tight model with edges shorter than half of the body's.
fn finer(variant: &str) -> Arc<Model> {
    let variant = common::variant(variant);
    let mut parts = common::parts(&variant);
    parts.garment = common::tube(26, 36, 0.17);
    parts.prior = common::prior(parts.garment.rest.vertices.len(), variant.components);
    Arc::new(Model::new(parts).unwrap())
}

/// Compares a clip with the CPU's corrections of single vertices. Returns the number of vertices that
/// are raised over others.
fn compare_robust_handling(context: &GpuContext, model: &Arc<Model>) -> usize {
    let (character, garment) = (model.character(), model.garment());
    let mode = IntersectionMode::Robust {
        margin_m: 0.003,
        corrects: Corrects::Display,
    };
    let mut handling = Handling::new(mode, character, garment);
    let mut cpu = Animator::new(Arc::clone(model));
    let mut gpu = gpu_animator(context, model, Precision::F32);
    gpu.set_intersection(mode).unwrap();
    let poses = common::motion(FRAMES);
    let mut body = Vec::new();
    let (mut moved, mut retracted, mut raised, mut apart) = (0, 0, 0, 0);
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
        let Handling::Robust(rule, posed) = &handling else {
            unreachable!("the mode above");
        };
        let found = gpu.read_back().unwrap().positions;
        let skinned = common::skinned_garment(model, input.pose);
        let predicted = cpu.garment().positions.to_vec();
        let mut expected = predicted.clone();
        common::correct_each(model, input.pose, (*rule, posed), &mut expected);
        for (vertex, (&p, &corrected)) in predicted.iter().zip(&expected).enumerate() {
            let (mut seed, mut seed_of_shown) = (Handling::NO_SEED, Handling::NO_SEED);
            let nearest = rule.correct(posed, vertex, p, &mut seed).unwrap_or(p);
            let alone = rule.correct_shown(posed, vertex, p, skinned[vertex], &mut seed_of_shown);
            let alone = alone.unwrap_or(p);
            moved += usize::from(corrected != p);
            retracted += usize::from(alone.distance(nearest) > 2.0 * MAX_PUSH_ERROR_M);
            raised += usize::from(alone.distance(corrected) > 2.0 * MAX_PUSH_ERROR_M);
            apart += usize::from(corrected.distance(found[vertex]) >= MAX_PUSH_ERROR_M);
            assert!(found[vertex].is_finite(), "vertex {vertex}");
        }
    }
    // Rounding decides between two faces that are equally near.
    assert!(
        moved > 100 && retracted > 10 && 1000 * apart <= moved,
        "{moved} moved, {retracted} of them retracted, {apart} apart"
    );
    raised
}

/// Largest difference between the pushes of devices, metres.
const MAX_PUSH_ERROR_M: f32 = 1e-3;

/// Model with a field of the paper's size, which has several tiles, chunks of weights and columns
/// of invocations.
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
fn a_field_of_the_published_size_agrees_with_the_cpu() {
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

/// An f16 has 11 bits, so outputs of a few centimetres err by some hundredths of a millimetre.
#[test]
fn half_precision_is_close_to_the_cpu() {
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
        // An error as small as that of f32 would mean that f16 is not in use.
        assert!(errors[0] > 1e-5 && errors[0] < 5e-4, "{errors:?}");
    }
}

/// Sums are in f32, unlike those of f16 without matrix units. Most of the error is the rounding of the
/// factors, which both share: on an NVIDIA H200 one model errs by 0.099 mm in place of 0.088.
#[test]
fn matrix_units_are_as_close_to_the_cpu_as_half_precision() {
    let Some(context) = device::context_with_matrix_units() else {
        return;
    };
    // The width of two models is a multiple of a matrix; the width of the others, 18, is padded.
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
        assert!(matrices > 1e-5 && matrices < 1.3 * halves, "{matrices} {halves}");
    }
}
