//! Contract: a model with a replay has the wrinkles that the motion does not determine, at no more
//! than the allowed cost on motions left out, and no motion is animated with its own wrinkles.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::{Quat, Vec3};
use unic_core::{
    features::PointFrame,
    mesh::vertex_normals,
    recurrence::RecurrenceScratch,
    replay::{Replay, ReplayScratch},
};
use unic_eval::{PreparedClip, WrinkleFilter};
use unic_io::Split;
use unic_train::*;

const LENGTH: usize = 600;

/// Angle of one of two joints, radians.
fn angle(clip: usize, t: usize, joint: usize) -> f32 {
    let rate = [0.11, 0.17][joint];
    0.2 * (rate * t as f32 + (clip + 2 * joint) as f32).sin()
}

/// Height of every third vertex above the rest shape, metres. The motion determines the first two.
/// The third drifts by itself, alike in all clips, and predictions of the motion lack it.
fn height(clip: usize, t: usize, third: usize) -> f32 {
    match third {
        0 => 0.02 * angle(clip, t, 0),
        1 => 0.01 * angle(clip, t, 1),
        _ => 0.01 * (0.02 * t as f32 + 2.0 * clip as f32).sin(),
    }
}

/// Normals of the rest shape.
fn normals() -> Vec<Vec3> {
    let rest = garment().rest;
    let mut normals = Vec::new();
    vertex_normals(&rest.vertices, &rest.faces, &mut normals);
    normals
}

fn take_of(clip: usize) -> Take {
    let mut take = take(&format!("take{clip}"), clip, LENGTH);
    let (character, garment) = (character(), garment());
    let normals = normals();
    for (t, pose) in take.clip.poses.iter_mut().enumerate() {
        *pose = character.skeleton.bind_pose();
        for joint in 0..2 {
            pose.local[1 + joint] = Quat::from_rotation_x(angle(clip, t, joint));
        }
        let (mut joints, mut transforms) = (Vec::new(), Vec::new());
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        let place = |v: usize| {
            let u = normals[v] * height(clip, t, v % 3);
            PointFrame::new(&garment, v, &transforms).position(u)
        };
        take.garment[t] = (0..garment.rest.vertices.len()).map(place).collect();
    }
    take
}

fn settings(cost: f32) -> TrainConfig {
    let mut config = small(Preset::Tiny);
    recurrence_of(&mut config).steps = 5;
    config.validation.refit = Refit::AllClips;
    config.regularisation.mirror = false;
    config.replay = ReplaySettings {
        at_inference: true,
        shapes: 4,
        deviation: 1.0,
        cost,
    };
    config
}

fn data(cost: f32) -> FieldData {
    let takes: Vec<_> = (0..4).map(|clip| (take_of(clip), Split::Train)).collect();
    dataset_of(&takes, &settings(cost))
}

/// Clip that is held out, with its motion and its number.
fn held_out(data: &FieldData) -> (&PreparedClip, MotionVectors, usize) {
    let clip = &data.validation[0];
    let number = clip.name().trim_start_matches("take").parse().unwrap();
    (clip, MotionVectors::new(clip, &data.normalisation, None), number)
}

/// Coefficients that a prior predicts in a clip without its replay, by frame from the second one on.
fn predicted(data: &FieldData, motion: &MotionVectors) -> Vec<Vec<f32>> {
    let (mut scratch, mut memory) = (RecurrenceScratch::default(), Vec::new());
    let tick = |t: usize| {
        let pair = [t - 1, t].map(|t| motion.frame(t, View::Direct)).concat();
        let mut coefficients = Vec::new();
        data.prior.coefficients(&pair, &mut coefficients);
        // The recurrence may not improve on the linear map.
        if let Some(recurrence) = &data.prior.recurrence {
            recurrence.embed(&pair, &mut scratch);
            match t {
                1 => recurrence.start(&mut scratch, &mut memory),
                _ => recurrence.advance(&mut scratch, &mut memory),
            }
            recurrence.add_to(&memory, &mut scratch, &mut coefficients);
        }
        coefficients
    };
    (1..LENGTH).map(tick).collect()
}

/// Coefficients that a replay adds in a clip, by frame from the second one on.
fn played(data: &FieldData, replay: &Replay, motion: &MotionVectors) -> Vec<Vec<f32>> {
    let (mut state, mut scratch) = (replay.start(), ReplayScratch::default());
    let tick = |t: usize| {
        let pair = [t - 1, t].map(|t| motion.frame(t, View::Direct)).concat();
        if t == 1 {
            replay.begin(&pair, 1.0 / data.config.fps, &mut state);
        }
        replay.advance(&pair, 1.0 / data.config.fps, &mut state, &mut scratch);
        let mut coefficients = vec![0.0; data.prior.len()];
        replay.add_to(&state, &mut coefficients);
        coefficients
    };
    (1..LENGTH).map(tick).collect()
}

/// Heights of the displacements of some coefficients, by frame.
fn heights(data: &FieldData, coefficients: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let normals = normals();
    let height = |a: &[f32], v: usize| normals[v].dot(data.prior.displacement(v, a) - data.prior.mean[v]);
    let of_frame = |a: &Vec<f32>| (0..VERTICES).map(|v| height(a, v)).collect();
    coefficients.iter().map(of_frame).collect()
}

/// Root mean square error of the displacements of some coefficients in a clip, metres.
fn rmse(data: &FieldData, clip: &PreparedClip, coefficients: &[Vec<f32>]) -> f32 {
    let garment = garment();
    let of_frame = |(t, a): (usize, &Vec<f32>)| -> f32 {
        let truth = displacements(&garment, clip, t);
        let error = |(v, u): (usize, &Vec3)| u.distance_squared(data.prior.displacement(v, a));
        truth.iter().enumerate().map(error).sum()
    };
    let squares: f32 = (1..).zip(coefficients).map(of_frame).sum();
    (squares / (VERTICES * coefficients.len()) as f32).sqrt()
}

/// Wrinkles of the vertices that drift by themselves, by frame.
fn true_wrinkles(clip: usize) -> Vec<Vec<f32>> {
    let filter = WrinkleFilter::new(&garment(), 0.24).unwrap();
    let normals = normals();
    let drift = |t: usize, v: usize| match v % 3 {
        2 => normals[v] * height(clip, t, 2),
        _ => Vec3::ZERO,
    };
    let field = |t: usize| (0..VERTICES).map(|v| drift(t, v)).collect::<Vec<_>>();
    let wrinkles = filter.wrinkles(&(0..LENGTH).map(field).collect::<Vec<_>>());
    wrinkles.chunks(VERTICES).map(<[f32]>::to_vec).collect()
}

/// Standard deviation of the heights of every third vertex, metres.
fn deviation(rows: &[Vec<f32>], third: usize) -> f32 {
    let vertices = || (third..VERTICES).step_by(3);
    let variance = |v: usize| {
        let mean = rows.iter().map(|row| row[v]).sum::<f32>() / rows.len() as f32;
        rows.iter().map(|row| (row[v] - mean).powi(2)).sum::<f32>() / rows.len() as f32
    };
    (vertices().map(variance).sum::<f32>() / vertices().count() as f32).sqrt()
}

#[test]
fn an_unseen_motion_gets_the_wrinkles_that_it_does_not_determine() {
    let data = data(1.0);
    let replay = data.prior.replay.as_ref().expect("a replay");
    let (_, motion, number) = held_out(&data);
    let played = heights(&data, &played(&data, replay, &motion));
    let truth = deviation(&true_wrinkles(number), 2);
    let found = deviation(&played, 2);
    assert!((0.6..1.3).contains(&(found / truth)), "{found} of {truth}");
}

#[test]
fn a_replay_costs_what_is_allowed() {
    for cost in [0.01, 0.1] {
        let data = data(cost);
        let replay = data.prior.replay.as_ref().expect("a replay");
        let (clip, motion, _) = held_out(&data);
        let without = predicted(&data, &motion);
        let mut with = without.clone();
        for (a, added) in with.iter_mut().zip(played(&data, replay, &motion)) {
            a.iter_mut().zip(added).for_each(|(a, x)| *a += x);
        }
        let growth = rmse(&data, clip, &with) / rmse(&data, clip, &without) - 1.0;
        // Another motion than those that the gain is measured on.
        assert!((0.1 * cost..2.5 * cost).contains(&growth), "{growth} of {cost}");
    }
}

#[test]
fn the_motion_does_not_move_the_shapes_of_wrinkles() {
    let data = data(1.0);
    let replayed = data.prior.replay.as_ref().unwrap().library().coefficients();
    assert!((1..=4).contains(&replayed));
    for coefficients in predicted(&data, &data.motion[0]) {
        assert_eq!(coefficients.len(), data.prior.len());
        let (moved, still) = coefficients.split_at(data.prior.len() - replayed);
        assert!(moved[0] != 0.0 && still.iter().all(|a| *a == 0.0));
    }
}

#[test]
fn pieces_of_a_lone_clip_replay_each_other() {
    let lone = dataset_of(&[(take_of(0), Split::Train)], &settings(1.0));
    let library = lone.prior.replay.as_ref().expect("a replay").library();
    assert_eq!(library.clips(), [LENGTH as u32 / 4; 4]);
}

#[test]
fn a_fit_that_holds_a_clip_out_does_not_replay_it() {
    let data = data(1.0);
    assert_eq!(data.validation.len(), 1);
    let held_out = data.prior.replay.as_ref().unwrap().library().len();
    assert_eq!(held_out, 3 * LENGTH);
    let all = data.on_all_clips().unwrap();
    assert_eq!(all.prior.replay.as_ref().unwrap().library().len(), 4 * LENGTH);
}

#[test]
fn a_model_with_a_replay_is_written_and_read() {
    let mut config = small(Preset::Tiny);
    config.replay.at_inference = true;
    let trainer = Trainer::new(data(1.0), config).unwrap();
    let model = trainer.model().unwrap();
    let read = unic_core::Model::from_bytes(&model.to_bytes().unwrap()).unwrap();
    assert!(model.prior().replay.is_some());
    assert_eq!(read.prior(), model.prior());
}
