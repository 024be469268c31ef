//! Contract: a prior's recurrence learns a garment that swings after the motion, is left out where
//! the motion does not tell what the garment does, and its training can be stopped.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::{Quat, Vec3};
use unic_core::{features::PointFrame, recurrence::RecurrenceScratch};
use unic_io::Split;
use unic_train::*;

const LENGTH: usize = 240;

/// Joint angle in radians: a slow mixture that differs from clip to clip, with kicks.
fn angle(clip: usize, frame: usize) -> f32 {
    let (t, phase) = (frame as f32 / 30.0, 1.7 * clip as f32);
    let kick = if (frame + 17 * clip) % 60 < 8 { 0.05 } else { 0.0 };
    0.03 * (2.0 * t + phase).sin() + 0.02 * (5.3 * t + 2.0 * phase).sin() + kick
}

/// A weight on a spring of 1.2 Hz that the angle pulls at, metres; what it was before is forgotten in
/// a second.
fn swing(clip: usize) -> Vec<f32> {
    let (mut x, mut v) = (0.0f32, 0.0f32);
    let (dt, stiffness, damping) = (1.0 / 30.0, (std::f32::consts::TAU * 1.2).powi(2), 3.0);
    let step = |t: usize| {
        v += dt * (stiffness * (angle(clip, t) - x) - damping * v);
        x += dt * v;
        x
    };
    (0..LENGTH).map(step).collect()
}

/// Every vertex is off by `sizes` metres along one direction.
fn take_of(clip: usize, sizes: &[f32]) -> Take {
    let mut take = take(&format!("take{clip}"), clip, LENGTH);
    let (character, garment) = (character(), garment());
    for (t, pose) in take.clip.poses.iter_mut().enumerate() {
        *pose = character.skeleton.bind_pose();
        pose.local[1..].fill(Quat::from_rotation_x(angle(clip, t)));
        let (mut joints, mut transforms) = (Vec::new(), Vec::new());
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        let place = |v: usize| PointFrame::new(&garment, v, &transforms).position(Vec3::Z * sizes[t]);
        take.garment[t] = (0..garment.rest.vertices.len()).map(place).collect();
    }
    take
}

fn settings(recurrence: bool) -> TrainConfig {
    let mut config = small(Preset::Tiny);
    let StateSettings::Displacement {
        prior_shapes,
        recurrence: settings,
        ..
    } = &mut config.model.state
    else {
        unreachable!()
    };
    *prior_shapes = 1;
    *settings = recurrence.then_some(RecurrenceSettings {
        oscillators: 8,
        width: 16,
        steps: 300,
        epochs: 1000,
        learning_rate: 5e-3,
        windows: 8,
        frames: 48,
        dropout: 0.2,
        swing: 0.0,
    });
    config
}

fn data(sizes: impl Fn(usize) -> Vec<f32>, recurrence: bool) -> Dataset {
    let takes: Vec<_> = (0..5)
        .map(|clip| {
            let split = if clip < 4 { Split::Train } else { Split::Validation };
            (take_of(clip, &sizes(clip)), split)
        })
        .collect();
    dataset_of(&takes, &settings(recurrence))
}

/// RMS of what the left-out coefficients miss, metres.
fn missed(data: &Dataset, sizes: impl Fn(usize) -> Vec<f32>) -> f32 {
    let of = |clip: usize| -> f32 {
        let truth = sizes(clip);
        let predicted = data.coefficients[clip]
            .iter()
            .map(|a| data.prior.displacement(0, a));
        predicted
            .zip(truth)
            .map(|(p, x)| p.distance_squared(Vec3::Z * x))
            .sum()
    };
    ((0..4).map(of).sum::<f32>() / (4 * LENGTH) as f32).sqrt()
}

#[test]
fn a_garment_that_swings_after_the_motion_is_learned() {
    let [linear, remembering] = [false, true].map(|r| missed(&data(swing, r), swing));
    assert!(linear > 0.003, "{linear} m: the test asks for nothing");
    assert!(
        remembering < 0.75 * linear,
        "{remembering} m, without memory {linear} m"
    );
}

#[test]
fn a_clip_that_is_held_out_and_comes_back_is_told_by_a_recurrence_that_has_not_seen_it() {
    let takes: Vec<_> = (0..4)
        .map(|clip| (take_of(clip, &swing(clip)), Split::Train))
        .collect();
    let mut config = settings(true);
    config.validation.refit = Refit::AllClips;
    let (_, data) = told_by_the_held_out_prior(dataset_of(&takes, &config));
    assert!(data.prior.recurrence.is_some());
}

#[test]
fn what_the_motion_does_not_tell_is_not_learned() {
    // A rhythm of its own in every clip.
    let foreign = |clip: usize| {
        let rate = 0.11 + 0.05 * clip as f32;
        (0..LENGTH)
            .map(|t| 0.02 * (rate * t as f32).sin())
            .collect::<Vec<f32>>()
    };
    assert!(data(foreign, true).prior.recurrence.is_none());
}

/// Energy of the finished prior about its mean in the motion of the first clip, m².
fn energy(data: &Dataset) -> f32 {
    let recurrence = data.prior.recurrence.as_ref().unwrap();
    let (mut scratch, mut state, mut a) = (RecurrenceScratch::default(), Vec::new(), Vec::new());
    let of_frame = |t: usize| {
        let frame = |t| data.motion[0].frame(t, View::Direct);
        let pair = [frame(t.saturating_sub(1)), frame(t)].concat();
        data.prior.coefficients(&pair, &mut a);
        recurrence.read(&pair, &mut scratch);
        match t {
            0 => recurrence.start(&mut scratch, &mut state),
            _ => recurrence.advance(&mut scratch, &mut state),
        }
        recurrence.add_to(&state, &mut scratch, &mut a);
        a[0]
    };
    let values: Vec<f32> = (0..LENGTH).map(of_frame).collect();
    let mean = values.iter().sum::<f32>() / LENGTH as f32;
    values.iter().map(|x| (x - mean).powi(2)).sum()
}

#[test]
fn a_garment_that_is_half_unknown_swings_more_where_that_is_wanted() {
    // What the motion does not tell is as fast and nearly as large as what it tells.
    let sizes = |clip: usize| -> Vec<f32> {
        let rate = 0.25 + 0.03 * clip as f32;
        let own = |t: usize| 0.02 * (rate * t as f32 + clip as f32).sin();
        swing(clip)
            .into_iter()
            .enumerate()
            .map(|(t, x)| x + own(t))
            .collect()
    };
    let takes: Vec<_> = (0..4)
        .map(|clip| (take_of(clip, &sizes(clip)), Split::Train))
        .collect();
    let [calm, lively] = [0.0, 1.0].map(|swing| {
        let mut config = settings(true);
        recurrence_of(&mut config).swing = swing;
        energy(&dataset_of(&takes, &config))
    });
    assert!(lively > 1.2 * calm, "{lively} m² beside {calm} m²");
}

#[test]
fn short_clips_are_trained_on_beside_a_long_one() {
    // Windows as long as the longest clip would leave the others out: all but one of them swing.
    let mut takes: Vec<_> = (0..5)
        .map(|clip| (take_of(clip, &swing(clip)), Split::Train))
        .collect();
    for (take, _) in &mut takes[1..] {
        take.clip.poses.truncate(LENGTH - 1);
        take.garment.truncate(LENGTH - 1);
    }
    let mut config = settings(true);
    recurrence_of(&mut config).frames = LENGTH;
    assert!(dataset_of(&takes, &config).prior.recurrence.is_some());
}

#[test]
fn the_same_seed_gives_the_same_recurrence() {
    let priors = [(); 2].map(|()| data(swing, true).prior);
    assert!(priors[0].recurrence.is_some());
    assert_eq!(priors[0], priors[1]);
}

#[test]
fn a_watch_can_stop_the_fit() {
    let takes: Vec<_> = (0..3)
        .map(|clip| (take_of(clip, &swing(clip)), Split::Train))
        .collect();
    let (_folder, capture) = capture(&takes);
    let watch = |done: u64, all: u64| {
        assert!(done <= all && all == 600);
        if done < 5 {
            Control::Continue
        } else {
            Control::Stop
        }
    };
    let stopped = Dataset::watched(capture, &settings(true), Fit::HeldOut, Processor::Cpu, &watch);
    assert!(matches!(stopped, Err(TrainError::Stopped)));
}
