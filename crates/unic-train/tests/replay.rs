//! Contract: a model with a replay varies as slowly as its garment does, at no more than the allowed
//! cost on motions left out, and no motion is animated with its own residuals.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::{Quat, Vec3};
use unic_core::{
    features::PointFrame,
    replay::{Replay, ReplayScratch},
};
use unic_io::Split;
use unic_train::*;

const LENGTH: usize = 600;

/// Angle of one of two joints, radians.
fn angle(clip: usize, t: usize, joint: usize) -> f32 {
    let rate = [0.11, 0.17][joint];
    0.2 * (rate * t as f32 + (clip + 2 * joint) as f32).sin()
}

/// Size of the displacement of every third vertex, metres. The motion determines the first two. The
/// third drifts by itself, alike in all clips, and predictions of the motion lack it.
fn size(clip: usize, t: usize, third: usize) -> f32 {
    match third {
        0 => 0.3 * angle(clip, t, 0),
        1 => 0.15 * angle(clip, t, 1),
        _ => 0.01 * (0.02 * t as f32 + 2.0 * clip as f32).sin(),
    }
}

fn take_of(clip: usize) -> Take {
    let mut take = take(&format!("take{clip}"), clip, LENGTH);
    let (character, garment) = (character(), garment());
    for (t, pose) in take.clip.poses.iter_mut().enumerate() {
        *pose = character.skeleton.bind_pose();
        for joint in 0..2 {
            pose.local[1 + joint] = Quat::from_rotation_x(angle(clip, t, joint));
        }
        let (mut joints, mut transforms) = (Vec::new(), Vec::new());
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        let place = |v: usize| {
            let u = Vec3::Z * size(clip, t, v % 3);
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
        deviation: 0.9,
        cost,
    };
    let takes: Vec<_> = (0..4).map(|clip| (take_of(clip), Split::Train)).collect();
    dataset_of(&takes, &config)
}

/// Residuals that are added in a training clip, by frame.
fn residuals(data: &FieldData, replay: &Replay, clip: usize) -> Vec<Vec<f32>> {
    let (mut state, mut scratch) = (replay.start(), ReplayScratch::default());
    let motion = &data.motion[clip];
    let tick = |t: usize| {
        let pair = [t - 1, t].map(|t| motion.frame(t, View::Direct)).concat();
        replay.advance(&pair, 1.0 / data.config.fps, &mut state, &mut scratch);
        let mut out = vec![0.0; data.prior.len()];
        replay.add_to(&state, &mut out);
        out
    };
    (1..LENGTH).map(tick).collect()
}

fn deviation(rows: &[Vec<f32>], k: usize) -> f32 {
    let mean = rows.iter().map(|row| row[k]).sum::<f32>() / rows.len() as f32;
    let squares = rows.iter().map(|row| (row[k] - mean).powi(2)).sum::<f32>();
    (squares / rows.len() as f32).sqrt()
}

#[test]
fn what_the_motion_does_not_determine_is_replayed() {
    let data = data(1.0);
    let replay = data.prior.replay.as_ref().expect("a replay");
    let added = residuals(&data, replay, 0);
    // A component of unit length, at a third of the vertices.
    let truth = 0.01 / 2f32.sqrt() * (VERTICES as f32 / 3.0).sqrt();
    let found = deviation(&added, 2);
    assert!((0.4..1.3).contains(&(found / truth)), "{found} of {truth}");
    // The motion determines the others.
    assert_eq!((deviation(&added, 0), deviation(&added, 1)), (0.0, 0.0));
}

#[test]
fn a_cost_of_nothing_replays_nothing_that_harms() {
    let free = residuals(&data(1.0), data(1.0).prior.replay.as_ref().unwrap(), 1);
    let data = data(1e-3);
    let cheap = data
        .prior
        .replay
        .as_ref()
        .map(|replay| residuals(&data, replay, 1));
    let cheap = cheap.map_or(0.0, |rows| deviation(&rows, 2));
    assert!(
        cheap < 0.6 * deviation(&free, 2),
        "{cheap} of {}",
        deviation(&free, 2)
    );
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
