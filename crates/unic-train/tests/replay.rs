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
use unic_eval::WrinkleFilter;
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

fn data(cost: f32) -> FieldData {
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
    let takes: Vec<_> = (0..4).map(|clip| (take_of(clip), Split::Train)).collect();
    dataset_of(&takes, &config)
}

/// Heights that a replay adds to the vertices in a training clip, by frame.
fn added(data: &FieldData, replay: &Replay, clip: usize) -> Vec<Vec<f32>> {
    let (mut state, mut scratch) = (replay.start(), ReplayScratch::default());
    let (motion, normals) = (&data.motion[clip], normals());
    let tick = |t: usize| {
        let pair = [t - 1, t].map(|t| motion.frame(t, View::Direct)).concat();
        replay.advance(&pair, 1.0 / data.config.fps, &mut state, &mut scratch);
        let mut coefficients = vec![0.0; data.prior.len()];
        replay.add_to(&state, &mut coefficients);
        let height = |v: usize| {
            let u = data.prior.displacement(v, &coefficients) - data.prior.mean[v];
            normals[v].dot(u)
        };
        (0..VERTICES).map(height).collect()
    };
    (1..LENGTH).map(tick).collect()
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
fn what_the_motion_does_not_determine_is_replayed() {
    let data = data(1.0);
    let replay = data.prior.replay.as_ref().expect("a replay");
    let added = added(&data, replay, 0);
    let truth = deviation(&true_wrinkles(0), 2);
    let found = deviation(&added, 2);
    assert!((0.6..1.3).contains(&(found / truth)), "{found} of {truth}");
}

#[test]
fn a_small_cost_replays_less() {
    let deviation_of = |data: &FieldData| {
        let replay = data.prior.replay.as_ref();
        replay.map_or(0.0, |replay| deviation(&added(data, replay, 1), 2))
    };
    let [free, cheap] = [1.0, 1e-3].map(|cost| deviation_of(&data(cost)));
    assert!(cheap < 0.6 * free, "{cheap} of {free}");
}

#[test]
fn the_motion_does_not_move_the_shapes_of_wrinkles() {
    let data = data(1.0);
    let replayed = data.prior.replay.as_ref().unwrap().library().coefficients();
    let pair = [3, 4].map(|t| data.motion[0].frame(t, View::Direct)).concat();
    let mut coefficients = Vec::new();
    data.prior.coefficients(&pair, &mut coefficients);
    // The recurrence may not improve on the linear map.
    if let Some(recurrence) = &data.prior.recurrence {
        let (mut scratch, mut memory) = (RecurrenceScratch::default(), Vec::new());
        recurrence.embed(&pair, &mut scratch);
        recurrence.start(&mut scratch, &mut memory);
        recurrence.add_to(&memory, &mut scratch, &mut coefficients);
    }
    assert_eq!(coefficients.len(), data.prior.len());
    assert!((1..=4).contains(&replayed));
    let (moved, still) = coefficients.split_at(data.prior.len() - replayed);
    assert!(moved[0] != 0.0 && still.iter().all(|a| *a == 0.0));
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
