//! Contract: the prior recovers a displacement that is linear in the motion. Its training
//! coefficients are predicted without the clip itself. Without principal components it is the mean.
//! Evaluated alone it depends neither on the field nor on the garment's earlier positions.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::{Quat, Vec3};
use std::f32::consts::TAU;
use unic_core::Animator;
use unic_core::features::PointFrame;
use unic_eval::{Mode, Predictor, PriorPredictor};
use unic_io::Split;
use unic_train::*;

const LENGTH: usize = 60;

/// Joint angle in radians that drives the garment; small, so that the motion vector is linear in
/// it, and over whole periods, so that its mean is zero.
fn angle(clip: usize, frame: usize) -> f32 {
    0.05 * (TAU * 4.0 * frame as f32 / LENGTH as f32 + 1.7 * clip as f32).sin()
}

/// Every vertex is off by ±1 m a radian along the rest shape's height, and by 3 cm always.
fn shape(rest: Vec3) -> Vec3 {
    Vec3::new(0.0, 0.3, 1.0) * (rest.y - 1.0)
}
const OFFSET: Vec3 = Vec3::new(0.0, 0.0, 0.03);

/// u = offset + relation · angle · shape in every vertex's own frame.
fn linear_take(clip: usize, relation: f32) -> Take {
    let mut take = take(&format!("take{clip}"), clip, LENGTH);
    for (t, pose) in take.clip.poses.iter_mut().enumerate() {
        *pose = character().skeleton.bind_pose();
        // All joints but the root, so that many elements of the motion vector contain the angle.
        pose.local[1..].fill(Quat::from_rotation_x(angle(clip, t)));
    }
    let (character, garment) = (character(), garment());
    for (t, pose) in take.clip.poses.iter().enumerate() {
        let (mut joints, mut transforms) = (Vec::new(), Vec::new());
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        let position = |(vertex, rest): (usize, &Vec3)| {
            let u = OFFSET + shape(*rest) * relation * angle(clip, t);
            PointFrame::new(&garment, vertex, &transforms).position(u)
        };
        take.garment[t] = garment.rest.vertices.iter().enumerate().map(position).collect();
    }
    take
}

fn prior_of(config: &mut TrainConfig) -> (&mut usize, &mut Option<RecurrenceSettings>) {
    match &mut config.model.state {
        StateSettings::Displacement {
            prior_shapes,
            recurrence,
            ..
        } => (prior_shapes, recurrence),
        other => panic!("a state without prior: {other:?}"),
    }
}

/// Training clips with these relations, and one to validate.
fn linear_data(relations: &[f32], shapes: usize) -> FieldData {
    let mut config = small(Preset::Tiny);
    let (prior_shapes, recurrence) = prior_of(&mut config);
    (*prior_shapes, *recurrence) = (shapes, None);
    let train = relations
        .iter()
        .enumerate()
        .map(|(i, &r)| (linear_take(i, r), Split::Train));
    let takes: Vec<_> = train.chain([(linear_take(9, 1.0), Split::Validation)]).collect();
    dataset_of(&takes, &config)
}

/// Share that the prior takes of the true displacement in a clip, by least squares: 1 is all.
fn share(data: &FieldData, clip: usize, coefficients: &[Vec<f32>]) -> f32 {
    let (mut products, mut squares) = (0.0, 0.0);
    for (t, coefficients) in coefficients.iter().enumerate() {
        for (vertex, rest) in data.capture.garment.rest.vertices.iter().enumerate() {
            let predicted = data.prior.displacement(vertex, coefficients) - OFFSET;
            let expected = shape(*rest) * angle(clip, t);
            products += predicted.dot(expected);
            squares += expected.length_squared();
        }
    }
    products / squares
}

#[test]
fn a_linear_relation_is_recovered() {
    let data = linear_data(&[1.0, 1.0, 1.0], 2);
    for clip in 0..3 {
        // Ridge regression falls short by its strength.
        for coefficients in [&final_coefficients(&data, clip), &data.coefficients[clip]] {
            let share = share(&data, clip, coefficients);
            assert!((0.9..1.02).contains(&share), "clip {clip}: {share}");
        }
    }
}

#[test]
fn training_coefficients_come_from_the_other_clips() {
    let data = linear_data(&[1.0, -1.0], 2);
    // Each clip gets the relation of the other one; both together have none.
    let shares = [0, 1].map(|clip| share(&data, clip, &data.coefficients[clip]));
    assert!(shares[0] < 0.0 && shares[1] > 0.0, "{shares:?}");
    for clip in 0..2 {
        let both = share(&data, clip, &final_coefficients(&data, clip)).abs();
        assert!(
            both < 0.5 * shares[clip].abs(),
            "{both} of both clips, {shares:?} without one"
        );
    }
}

#[test]
fn held_out_clip_is_predicted_by_a_map_fitted_to_the_other_clip() {
    let takes: Vec<_> = [1.0, -1.0]
        .into_iter()
        .enumerate()
        .map(|(i, relation)| (linear_take(i, relation), Split::Train))
        .collect();
    let mut config = small(Preset::Tiny);
    config.validation.refit = Refit::AllClips;
    let (shapes, recurrence) = prior_of(&mut config);
    (*shapes, *recurrence) = (2, None);
    let (drawn, data) = data_with_the_held_out_prior(dataset_of(&takes, &config));
    let share = share(&data, drawn, &final_coefficients(&data, drawn));
    assert!(if drawn == 0 { share < 0.0 } else { share > 0.0 }, "{share}");
}

#[test]
fn prior_without_components_is_the_mean() {
    let data = linear_data(&[1.0, 1.0], 0);
    assert!(data.prior.is_empty());
    assert!(data.coefficients.iter().flatten().all(Vec::is_empty));
    let frames: Vec<_> = (0..2)
        .flat_map(|clip| (0..LENGTH).map(move |t| angle(clip, t)))
        .collect();
    let mean_angle = frames.iter().sum::<f32>() / frames.len() as f32;
    for (vertex, rest) in data.capture.garment.rest.vertices.iter().enumerate() {
        let expected = OFFSET + shape(*rest) * mean_angle;
        assert!((data.prior.displacement(vertex, &[]) - expected).length() < 1e-5);
    }
}

#[test]
fn a_lone_clip_is_cut_into_pieces_so_that_its_coefficients_agree_with_the_models() {
    let data = linear_data(&[1.0], 4);
    let left_out = share(&data, 0, &data.coefficients[0]);
    let fitted = share(&data, 0, &final_coefficients(&data, 0));
    assert!(
        left_out > 0.7 && (left_out - fitted).abs() < 0.3,
        "{left_out} {fitted}"
    );
}

/// Sideways displacement, in metres, that grows with the height above 1 m and with the angle.
fn sideways(rest: Vec3, angle: f32) -> Vec3 {
    Vec3::X * (rest.y - 1.0) * angle
}

/// Take in which one arm alone moves, and the garment moves to that side. `bias` is a constant
/// angle that is added in every frame.
fn one_sided(clip: usize, bias: f32) -> Take {
    let mut take = take(&format!("take{clip}"), clip, LENGTH);
    let (character, garment) = (character(), garment());
    for (t, pose) in take.clip.poses.iter_mut().enumerate() {
        *pose = character.skeleton.bind_pose();
        let angle = 4.0 * angle(clip, t);
        pose.local[4] = Quat::from_rotation_x(angle);
        let (mut joints, mut transforms) = (Vec::new(), Vec::new());
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        let position = |(vertex, rest): (usize, &Vec3)| {
            PointFrame::new(&garment, vertex, &transforms).position(sideways(*rest, angle + bias))
        };
        take.garment[t] = garment.rest.vertices.iter().enumerate().map(position).collect();
    }
    take
}

#[test]
fn mirrored_motion_teaches_the_other_side() {
    let error = |mirror: bool| {
        let mut config = small(Preset::Tiny);
        config.regularisation.mirror = mirror;
        *prior_of(&mut config).1 = None;
        let train = (0..3).map(|i| (one_sided(i, 0.0), Split::Train));
        let other = mirror_image(&one_sided(9, 0.0), "other");
        let takes: Vec<_> = train.chain([(other, Split::Validation)]).collect();
        let trainer = Trainer::new(dataset_of(&takes, &config), config).unwrap();
        let animator = Animator::new(std::sync::Arc::new(trainer.model().unwrap()));
        let mut row = PriorPredictor::new(&animator).unwrap().unwrap();
        let clip = &trainer.data().validation[0];
        row.start(clip, Mode::FreeRunning).unwrap();
        let (mut positions, mut missed, mut moved) = (Vec::new(), 0.0, 0.0);
        for t in 1..clip.len() {
            row.predict(clip, t, &mut positions).unwrap();
            let garment = &trainer.data().capture.garment;
            for (vertex, (found, truth)) in positions.iter().zip(clip.captured.garment.frame(t)).enumerate() {
                let frame = PointFrame::new(garment, vertex, clip.kinematics.world_from_rest(t));
                missed += found.distance_squared(*truth);
                moved += truth.distance_squared(frame.position(Vec3::ZERO));
            }
        }
        missed / moved
    };
    let [with, without] = [true, false].map(error);
    assert!(
        with < 0.1 && without > 0.8,
        "{with} of the squares missed, {without} without mirrored motion"
    );
}

#[test]
fn constant_bias_to_one_side_survives_mirroring() {
    const BIAS: f32 = 0.3;
    let mut config = small(Preset::Tiny);
    *prior_of(&mut config).1 = None;
    let takes: Vec<_> = (0..3)
        .map(|i| (one_sided(i, BIAS), Split::Train))
        .chain([(one_sided(9, BIAS), Split::Validation)])
        .collect();
    let data = dataset_of(&takes, &config);
    assert!(data.mirrors());
    // The mean motion.
    let mut coefficients = Vec::new();
    data.prior
        .coefficients(&vec![0.0; 2 * data.normalisation.mean.len()], &mut coefficients);
    for (vertex, rest) in data.capture.garment.rest.vertices.iter().enumerate() {
        let (found, expected) = (
            data.prior.displacement(vertex, &coefficients),
            sideways(*rest, BIAS),
        );
        let error = found.distance(expected);
        assert!(
            error < 0.05 * expected.length() + 1e-4,
            "found {found}, expected {expected}"
        );
    }
}

fn trained(preset: Preset) -> (Trainer, Animator) {
    let mut config = small(preset);
    config.optimiser.learning_rate = 1e-2;
    let mut trainer = Trainer::new(dataset(&config), config).unwrap();
    run(&mut trainer);
    let animator = Animator::new(std::sync::Arc::new(trainer.model().unwrap()));
    (trainer, animator)
}

#[test]
fn prior_alone_depends_on_the_motion_alone() {
    let (trainer, animator) = trained(Preset::Tiny);
    let mut row = PriorPredictor::new(&animator).unwrap().unwrap();
    assert_eq!(row.modes(), [Mode::FreeRunning]);
    let data = trainer.data();
    let (clip, coefficients) = (&data.clips[1], final_coefficients(data, 1));
    row.start(clip, Mode::FreeRunning).unwrap();
    let mut positions = Vec::new();
    for (t, coefficients) in coefficients.iter().enumerate().skip(1) {
        row.predict(clip, t, &mut positions).unwrap();
        for (vertex, found) in positions.iter().enumerate() {
            let frame = PointFrame::new(&data.capture.garment, vertex, clip.kinematics.world_from_rest(t));
            let expected = frame.position(data.prior.displacement(vertex, coefficients));
            assert!(
                found.distance(expected) < 1e-5,
                "frame {t}, vertex {vertex}: {found} {expected}"
            );
        }
    }
}

#[test]
fn a_model_of_positions_has_no_prior() {
    let (_, animator) = trained(Preset::Paper);
    assert!(PriorPredictor::new(&animator).unwrap().is_none());
}
