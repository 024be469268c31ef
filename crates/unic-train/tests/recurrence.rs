//! Contract: a prior's recurrence learns a garment that swings with a delay after the motion. It is
//! left out where the garment does not depend on the motion. Its training can be stopped.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::{Quat, Vec3};
use std::{
    path::Path,
    sync::atomic::{AtomicU64, Ordering},
};
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

/// A weight on a spring of 1.2 Hz that the angle pulls at, metres; what it was before is forgotten
/// in a second.
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
    // The recurrence alone remembers.
    config.model.springs = Vec::new();
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
        start: RecurrenceStart::Random,
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

fn data(sizes: impl Fn(usize) -> Vec<f32>, recurrence: bool) -> FieldData {
    let takes: Vec<_> = (0..5)
        .map(|clip| {
            let split = if clip < 4 { Split::Train } else { Split::Validation };
            (take_of(clip, &sizes(clip)), split)
        })
        .collect();
    dataset_of(&takes, &settings(recurrence))
}

/// RMS of what the left-out coefficients miss, metres.
fn missed(data: &FieldData, sizes: impl Fn(usize) -> Vec<f32>) -> f32 {
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
fn held_out_clip_is_predicted_by_a_recurrence_trained_without_it() {
    let takes: Vec<_> = (0..4)
        .map(|clip| (take_of(clip, &swing(clip)), Split::Train))
        .collect();
    let mut config = settings(true);
    config.validation.refit = Refit::AllClips;
    let (_, data) = data_with_the_held_out_prior(dataset_of(&takes, &config));
    assert!(data.prior.recurrence.is_some());
}

#[test]
fn swings_independent_of_the_motion_are_not_learned() {
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
fn energy(data: &FieldData) -> f32 {
    let recurrence = data.prior.recurrence.as_ref().unwrap();
    let (mut scratch, mut state, mut a) = (RecurrenceScratch::default(), Vec::new(), Vec::new());
    let of_frame = |t: usize| {
        let frame = |t| data.motion[0].frame(t, View::Direct);
        let pair = [frame(t.saturating_sub(1)), frame(t)].concat();
        data.prior.coefficients(&pair, &mut a);
        recurrence.embed(&pair, &mut scratch);
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
fn swings_are_amplified_where_half_of_them_is_unpredictable() {
    // The unpredictable part is as fast and nearly as large as the predictable one.
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

/// Clips of three takes of a swinging garment.
fn swinging(settings: &TrainConfig) -> Dataset {
    let takes: Vec<_> = (0..3)
        .map(|clip| (take_of(clip, &swing(clip)), Split::Train))
        .collect();
    let (_folder, capture) = capture(&takes);
    Dataset::load(capture, settings, Fit::AllClips).unwrap()
}

fn fit_prior(
    settings: &TrainConfig,
    folder: Option<&Path>,
    watch: &Watch,
) -> Result<FittedPrior, TrainError> {
    let trainer = PriorTrainer {
        data: &swinging(settings),
        settings,
        processor: Processor::Cpu,
        folder,
    };
    trainer.run(watch)
}

/// Steps of three folds, two thirds of the whole each, and of the training on all motions.
const ALL_STEPS: u64 = 3 * 200 + 300;

#[test]
fn callback_stops_the_fit() {
    let watch = |done: u64, all: u64| {
        assert!(done <= all && all == ALL_STEPS);
        if done < 5 {
            Control::Continue
        } else {
            Control::Stop
        }
    };
    assert!(matches!(
        fit_prior(&settings(true), None, &watch),
        Err(TrainError::Stopped)
    ));
}

#[test]
fn an_interrupted_fit_continues_where_it_stopped_and_ends_as_an_uninterrupted_one() {
    let settings = settings(true);
    let whole = fit_prior(&settings, None, &|_, _| Control::Continue).unwrap();
    assert!(whole.prior.recurrence.is_some());
    // In the middle of the folds, and in the middle of the training on all motions.
    for stop_at in [150, 700] {
        let folder = tempfile::tempdir().unwrap();
        let stop = |done: u64, _: u64| match done >= stop_at {
            true => Control::Stop,
            false => Control::Continue,
        };
        let stopped = fit_prior(&settings, Some(folder.path()), &stop);
        assert!(matches!(stopped, Err(TrainError::Stopped)), "{stop_at}");
        let calls = AtomicU64::new(0);
        let count = |done: u64, all: u64| {
            assert!(done <= all && all == ALL_STEPS, "{done} of {all}");
            calls.fetch_add(1, Ordering::Relaxed);
            Control::Continue
        };
        let resumed = fit_prior(&settings, Some(folder.path()), &count).unwrap();
        // One call for each of the four trainings, and one a step that is left. Other threads have
        // finished the step that they were in when the first one was stopped.
        let left = calls.into_inner() - 4;
        let expected = ALL_STEPS - stop_at;
        assert!(
            left <= expected && left + 3 > expected,
            "{left} of {expected} steps"
        );
        assert!(
            resumed.prior == whole.prior && resumed.left_out == whole.left_out,
            "{stop_at}"
        );
    }
}

#[test]
fn checkpoints_of_other_settings_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut settings = settings(true);
    fit_prior(&settings, Some(folder.path()), &|_, _| Control::Continue).unwrap();
    recurrence_of(&mut settings).dropout = 0.3;
    let refused = fit_prior(&settings, Some(folder.path()), &|_, _| Control::Continue);
    let refused = refused.err().unwrap().to_string();
    assert!(refused.contains("other settings"), "{refused}");
}
