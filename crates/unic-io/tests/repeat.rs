//! Contract: each round of a repeated motion starts at the place and heading where the one before
//! it ended, without a jump in pose or velocity. Frames away from the seams do not change.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{data, humanoid};
use glam::{Quat, Vec3};
use std::f32::consts::TAU;
use unic_core::{Pose, clip::Clip, skeleton::Skeleton};
use unic_io::{Cycle, MotionOptions, Repeat, import_motion, read_character, repeat_cycle};

const FPS: f32 = 30.0;

/// A walk on a circle with limbs that swing once in `period` frames. The width of the swings grows
/// by `drift` per second, so that the ends of a cycle do not quite meet.
fn walk(frames: usize, period: f32, drift: f32) -> Clip {
    let pose = |t: usize| {
        let seconds = t as f32 / FPS;
        let phase = TAU * t as f32 / period;
        let yaw = 0.5 * seconds;
        let swing = (0.5 + drift * seconds) * phase.sin();
        let mut turns = vec![Vec3::ZERO; 24];
        turns[0] = Vec3::Y * yaw;
        for (joint, sign) in [(1, 1.0), (2, -1.0), (16, -1.0), (17, 1.0)] {
            turns[joint] = Vec3::X * sign * swing;
        }
        turns[9] = Vec3::Y * 0.2 * phase.cos();
        // A circle of radius 2 m.
        let place = Vec3::new(
            2.0 * (1.0 - yaw.cos()),
            0.02 * (2.0 * phase).sin(),
            2.0 * yaw.sin(),
        );
        Pose::from_axis_angles(place, &turns)
    };
    Clip {
        name: "walk".into(),
        fps: FPS,
        poses: (0..frames).map(pose).collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    }
}

/// Largest acceleration of any joint at each frame, by second differences, m/s².
fn accelerations(skeleton: &Skeleton, clip: &Clip) -> Vec<f32> {
    let mut world = Vec::new();
    let positions: Vec<Vec<Vec3>> = (clip.poses.iter())
        .map(|pose| {
            skeleton.forward_kinematics(pose, &mut world);
            world.iter().map(|w| w.translation).collect()
        })
        .collect();
    let second = |w: &[Vec<Vec3>]| {
        let joints = (0..w[0].len()).map(|j| (w[0][j] + w[2][j] - 2.0 * w[1][j]).length());
        joints.fold(0.0, f32::max) * clip.fps * clip.fps
    };
    positions.windows(3).map(second).collect()
}

fn largest(values: &[f32]) -> f32 {
    values.iter().copied().fold(0.0, f32::max)
}

#[test]
fn rounds_accumulate_displacement_and_heading() {
    let (skeleton, clip) = (humanoid().skeleton, walk(61, 30.0, 0.0));
    let options = Repeat {
        cycle: Cycle::Whole,
        times: 4,
        ..Repeat::default()
    };
    let repeated = repeat_cycle(&clip, &skeleton, &options);
    assert_eq!((repeated.source_frames, repeated.clip.len()), (0..=60, 241));
    // The clip has two whole swings, so that the repetition equals a longer walk.
    let expected = walk(241, 30.0, 0.0);
    for (t, (a, b)) in repeated.clip.poses.iter().zip(&expected.poses).enumerate() {
        assert!(a.trans.distance(b.trans) < 2e-3, "{t}: {} {}", a.trans, b.trans);
        let turned = a.local.iter().zip(&b.local).map(|(p, q)| p.dot(*q).abs());
        assert!(turned.fold(1.0, f32::min) > 1.0 - 1e-4, "{t}");
    }
}

#[test]
fn seams_are_smooth_and_other_frames_unchanged() {
    let skeleton = humanoid().skeleton;
    // The ends differ: 2.2 swings whose width grows.
    let clip = walk(67, 30.0, 0.05);
    let blend = |blend_seconds: f32| {
        let options = Repeat {
            cycle: Cycle::Whole,
            times: 3,
            blend_seconds,
        };
        repeat_cycle(&clip, &skeleton, &options).clip
    };
    let own = largest(&accelerations(&skeleton, &clip));
    let hard = largest(&accelerations(&skeleton, &blend(0.0)));
    let soft = accelerations(&skeleton, &blend(0.3));
    assert!(
        hard > 10.0 * own,
        "the ends of this clip do not differ enough: {hard} {own}"
    );
    assert!(largest(&soft) < 6.0 * own, "{} {own}", largest(&soft));
    // A jump in velocity would show as one large acceleration at the seam.
    for seam in [66, 132] {
        let around = largest(&soft[seam - 8..seam + 6]);
        assert!(soft[seam - 1] <= around * 1.01 && soft[seam - 1] < 6.0 * own);
    }
    let long = blend(0.3);
    for t in 9..=57 {
        let (found, expected) = (&long.poses[t], &clip.poses[t]);
        assert!(found.trans.distance(expected.trans) < 1e-6, "{t}");
        let turned = found.local.iter().zip(&expected.local);
        assert!(
            turned.map(|(p, q)| (*p - *q).length()).fold(0.0, f32::max) < 1e-6,
            "{t}"
        );
    }
}

#[test]
fn best_cycle_is_a_whole_number_of_swings() {
    let skeleton = humanoid().skeleton;
    for period in [24.0, 31.0] {
        let clip = walk(100, period, 0.0);
        let range = repeat_cycle(&clip, &skeleton, &Repeat::default()).source_frames;
        let swings = (range.end() - range.start()) as f32 / period;
        assert!(
            (swings - swings.round()).abs() < 0.05 && swings > 0.9,
            "{range:?}"
        );
    }
}

#[test]
fn recorded_walk_repeats_smoothly() {
    let Some(body) = data("body/character.npz") else {
        return;
    };
    let Some(path) = data("motion/locomotion/Walk1.npz") else {
        return;
    };
    let character = read_character(&body).unwrap();
    let mut clip = import_motion(&path, &character, &MotionOptions::default())
        .unwrap()
        .clip;
    clip.poses = clip.poses[300..480].to_vec();
    let own = largest(&accelerations(&character.skeleton, &clip));
    let repeated = repeat_cycle(
        &clip,
        &character.skeleton,
        &Repeat {
            times: 5,
            ..Repeat::default()
        },
    );
    let (long, range) = (repeated.clip, repeated.source_frames);
    let found = largest(&accelerations(&character.skeleton, &long));
    eprintln!("frames {range:?}: largest acceleration {found:.1} m/s², recorded {own:.1}");
    assert!(found < 1.3 * own, "{found} {own}");
    assert!(long.poses.iter().all(Pose::is_valid));
}

#[test]
fn short_clips_and_zero_rounds_are_unchanged() {
    let skeleton = humanoid().skeleton;
    for frames in [0, 1, 2, 3] {
        let clip = walk(frames, 30.0, 0.0);
        let again = repeat_cycle(&clip, &skeleton, &Repeat::default()).clip;
        assert!(again.len() >= frames);
        assert!(
            again
                .poses
                .iter()
                .flat_map(|p| &p.local)
                .all(|q: &Quat| q.is_finite())
        );
    }
    let clip = walk(50, 20.0, 0.0);
    let none = Repeat {
        times: 0,
        ..Repeat::default()
    };
    assert_eq!(repeat_cycle(&clip, &skeleton, &none).clip, clip);
}
