//! Contract: what training rolls out is what the animator plays, over a whole clip, for both
//! states, trained or not. Intersections are not handled: training knows none.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::Vec3;
use std::sync::Arc;
use unic_core::{Animator, Model, Start, StepInput, config::StateConfig, features::PointFrame};
use unic_train::*;

/// Largest distance between the two, metres.
const TOLERANCE_M: f32 = 1e-4;

/// World positions of every frame after the first, from the tensors of training.
fn by_tensors(trainer: &Trainer, clip: usize) -> Vec<Vec<Vec3>> {
    let (data, config) = (trainer.data(), trainer.config());
    let points: Vec<u32> = (0..VERTICES as u32).collect();
    let window = Window {
        clip,
        start: 0,
        view: View::Direct,
        points,
    };
    let batch = Batch::of_windows(data, vec![window], data.clips[clip].len() - 1);
    let rollout = Rollout {
        shape: &NetworkShape::new(&data.config, data.capture.character.skeleton.len()),
        config: &data.config,
        loss: &config.loss,
        products: Products::F32,
    };
    let states = rollout
        .states(trainer.network(), &batch, None, &device())
        .unwrap();
    let values = states
        .into_iter()
        .map(|s| s.inner().try_into_vec_as::<f32>().unwrap());
    values
        .enumerate()
        .map(|(k, values)| world(data, clip, k + 1, &values))
        .collect()
}

fn world(data: &FieldData, clip: usize, frame: usize, states: &[f32]) -> Vec<Vec3> {
    let kinematics = &data.clips[clip].kinematics;
    let position = |(vertex, state): (usize, &[f32])| {
        let state = Vec3::from_slice(state);
        match &data.config.state {
            StateConfig::RootRelative => kinematics.world_from_state(frame).point(state),
            StateConfig::Displacement(_) => {
                let own = PointFrame::new(&data.capture.garment, vertex, kinematics.world_from_rest(frame));
                own.position(data.prior.displacement(vertex, &data.coefficients[clip][frame]) + state)
            }
        }
    };
    states.chunks_exact(3).enumerate().map(position).collect()
}

/// The same by the animator that users run.
fn by_animator(model: Model, trainer: &Trainer, clip: usize) -> Vec<Vec<Vec3>> {
    let captured = &trainer.data().clips[clip].captured;
    let motion = &captured.clip;
    let input = |t: usize| StepInput {
        pose: &motion.poses[t],
        next_pose: motion.poses.get(t + 1),
        ground_height: motion.ground_height,
        wind: motion.wind_at(t),
    };
    let model = Arc::new(model);
    let mut animator = Animator::new(model);
    animator
        .reset(&input(0), Start::Positions(captured.garment.frame(0)))
        .unwrap();
    (1..motion.len())
        .map(|t| animator.step(&input(t)).unwrap().positions.to_vec())
        .collect()
}

fn largest_difference(a: &[Vec<Vec3>], b: &[Vec<Vec3>]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .flatten()
        .zip(b.iter().flatten())
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f32::max)
}

/// The coefficients of the finished model in place of those that leave each clip out, since the
/// animator has the finished prior. What a recurrence adds is compared where it is trained.
fn with_final_prior(mut data: FieldData) -> FieldData {
    data.prior.recurrence = None;
    for (motion, coefficients) in data.motion.iter().zip(&mut data.coefficients) {
        for (t, out) in coefficients.iter_mut().enumerate() {
            let pair = [t.saturating_sub(1), t]
                .map(|t| motion.frame(t, View::Direct))
                .concat();
            data.prior.coefficients(&pair, out);
        }
    }
    data
}

fn assert_parity(preset: Preset, shapes: usize, steps: u64) {
    assert_parity_of(&Figure::tube(), small(preset), shapes, steps);
}

fn assert_parity_of(figure: &Figure, mut config: TrainConfig, shapes: usize, steps: u64) {
    let data = |config: &TrainConfig| with_final_prior(dataset_for(figure, config));
    config.optimiser.steps = steps.max(1);
    // Large enough that the head, where it starts at zero, is random after a step.
    config.optimiser.learning_rate = 0.03;
    config.optimiser.warmup = 0.0;
    config.optimiser.final_learning_rate = 1e-3;
    config.regularisation.average = 0.0;
    config.intersection.at_inference = false;
    // Training rolls the prediction out, which the projection changes on screen alone.
    config.projection.at_inference = false;
    if let StateSettings::Displacement { prior_shapes, .. } = &mut config.model.state {
        *prior_shapes = shapes;
    }
    let mut trainer = Trainer::new(data(&config), config).unwrap();
    if steps > 0 {
        run(&mut trainer);
    }
    for clip in 0..2 {
        let tensors = by_tensors(&trainer, clip);
        let animator = by_animator(trainer.model().unwrap(), &trainer, clip);
        let difference = largest_difference(&tensors, &animator);
        let case = format!(
            "{:?}, {shapes} principal components, {steps} steps",
            trainer.config().model.layout
        );
        assert!(difference < TOLERANCE_M, "{case}: {difference} m");
        let start = trainer.data().clips[clip].captured.garment.frame(0);
        let moved = animator[FRAMES - 2]
            .iter()
            .zip(start)
            .map(|(a, b)| a.distance(*b))
            .fold(0.0, f32::max);
        assert!(moved > 0.05, "{case}: the garment stands still");
    }
}

#[test]
fn the_animator_plays_what_a_random_network_rolls_out() {
    assert_parity(Preset::Paper, 0, 0);
    assert_parity(Preset::Tiny, 0, 1);
    assert_parity(Preset::Tiny, 4, 1);
}

#[test]
fn the_animator_plays_what_a_trained_network_rolls_out() {
    assert_parity(Preset::Paper, 0, 50);
    assert_parity(Preset::Tiny, 0, 50);
    assert_parity(Preset::Tiny, 4, 50);
}

#[test]
fn the_animator_plays_other_frames_and_codes_of_the_paper() {
    use unic_core::{config::LatentCode, motion::MotionLayout};
    for layout in [MotionLayout::PaperRootRelative, MotionLayout::Heading] {
        let mut config = small(Preset::Paper);
        config.model.layout = layout;
        config.model.encoder.code = LatentCode::OneHot;
        assert_parity_of(&Figure::tube(), config.clone(), 0, 50);
    }
}

#[test]
fn the_animator_plays_a_masked_garment_as_training_rolls_it_out() {
    let mut figure = Figure::tube();
    figure.garment.mask = Some((0..VERTICES).map(|v| [1.0, 0.0, 0.3][v % 3]).collect());
    assert_parity_of(&figure, small(Preset::Tiny), 4, 50);
}
