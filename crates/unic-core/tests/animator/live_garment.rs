//! Live garments: frames of any rate give the ticks of the animator, and every way to begin or to go
//! on is the documented one.

use super::*;
use unic_core::{
    LiveGarment, Surroundings,
    animator::{Display, TeleportLimit},
};

const TICK_S: f64 = 1.0 / FPS as f64;

/// A tick of the animator in still air.
fn still(pose: &Pose) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind: Vec3::ZERO,
    }
}

/// Passes a frame, and returns the garment of the last tick.
fn frame(garment: &mut LiveGarment, frame_s: f64, pose: &Pose) -> Vec<[u32; 3]> {
    garment.advance(frame_s, pose, &Surroundings::default()).unwrap();
    bits(garment.show(Display::Ticks).unwrap())
}

/// Garment that has followed all poses, a tick each.
fn after(model: &Arc<Model>, poses: &[Pose]) -> LiveGarment {
    let mut garment = LiveGarment::new(Arc::clone(model));
    for pose in poses {
        frame(&mut garment, TICK_S, pose);
    }
    garment
}

/// Garment of an animator that begins at the first pose and steps to the others.
fn stepped<'a>(model: &Arc<Model>, poses: impl IntoIterator<Item = &'a Pose>) -> Vec<[u32; 3]> {
    let mut animator = Animator::new(Arc::clone(model));
    for (t, pose) in poses.into_iter().enumerate() {
        match t {
            0 => animator.reset(&still(pose), Start::MeanShape).unwrap(),
            _ => animator.step(&still(pose)).unwrap(),
        };
    }
    bits(animator.garment())
}

fn moved(pose: &Pose, by: Vec3) -> Pose {
    Pose {
        trans: pose.trans + by,
        ..pose.clone()
    }
}

#[test]
fn frames_of_a_tick_are_steps_of_the_animator() {
    let poses = motion(8);
    for variant in variants() {
        let model = model(&variant);
        let garment = after(&model, &poses).show(Display::Ticks).map(bits).unwrap();
        assert!(garment == stepped(&model, &poses), "{}", variant.name);
    }
}

#[test]
fn short_frames_show_cloth_on_their_own_poses_between_ticks() {
    let model = model(&variant("projected"));
    let poses = motion(4);
    let mut garment = after(&model, &poses[..1]);
    for tick in 1..4 {
        for quarter in 1..=4 {
            let pose = poses[tick - 1].interpolate(&poses[tick], quarter as f32 / 4.0);
            let before = garment.show(Display::Interpolated).map(bits).unwrap();
            garment
                .advance(TICK_S / 4.0, &pose, &Surroundings::default())
                .unwrap();
            let shown = garment.show(Display::Interpolated).map(bits).unwrap();
            assert!(shown != before, "tick {tick}, quarter {quarter}");
        }
        let ticked = garment.show(Display::Ticks).unwrap().positions.to_vec();
        let mut animator = Animator::new(Arc::clone(&model));
        animator.reset(&still(&poses[0]), Start::MeanShape).unwrap();
        for pose in &poses[1..=tick] {
            animator.step(&still(pose)).unwrap();
        }
        // Interpolated poses are rounded.
        let far = largest_distance(&ticked, animator.garment().positions);
        assert!(far < 1e-5, "tick {tick}: {far} m");
    }
}

#[test]
fn the_ticks_of_a_long_frame_have_the_poses_of_their_moments() {
    let model = model(&variant("projected"));
    let [first, last] = [0, 7].map(|t| motion(8)[t].clone());
    for (ticks, expected) in [(2, 2), (4, 4), (50, LiveGarment::MOST_TICKS)] {
        let mut garment = after(&model, std::slice::from_ref(&first));
        let found = frame(&mut garment, f64::from(ticks) * TICK_S, &last);
        let share = |tick: u32| tick as f32 / expected as f32;
        let mut poses: Vec<Pose> = (0..expected)
            .map(|tick| first.interpolate(&last, share(tick)))
            .collect();
        poses[0].clone_from(&first);
        poses.push(last.clone());
        assert!(found == stepped(&model, &poses), "{ticks} ticks");
    }
}

#[test]
fn a_runner_with_a_hitch_keeps_moving_and_a_cut_is_a_teleport() {
    let model = model(&variant("projected"));
    let poses = motion(6);
    let never = Surroundings {
        teleports: TeleportLimit::with_speed(0.0),
        ..Surroundings::default()
    };
    // A hitch of 0.25 s at 5 m/s, and a jump of the same length within a frame of 1/60 s.
    let run = Vec3::new(0.0, 0.0, 1.25);
    for (frame_s, teleports) in [(0.25, false), (1.0 / 60.0, true)] {
        let there = moved(&poses[5], run);
        let mut limited = after(&model, &poses);
        let mut unlimited = limited.clone();
        let found = frame(&mut limited, frame_s, &there);
        unlimited.advance(frame_s, &there, &never).unwrap();
        let expected = unlimited.show(Display::Ticks).map(bits).unwrap();
        assert_eq!(found != expected, teleports, "a frame of {frame_s} s");
    }
}

#[test]
fn a_teleport_carries_the_shape_and_leaves_it_at_rest() {
    for mode in MODES {
        let model = tight("projected");
        let poses = motion(6);
        let mut garment = LiveGarment::new(Arc::clone(&model));
        garment.set_intersection(mode);
        for pose in &poses {
            frame(&mut garment, TICK_S, pose);
        }
        let mut asked = garment.clone();
        let jump = Vec3::new(3.0, 0.0, -1.0);
        let expected: Vec<Vec3> = (garment.animator().garment().positions.iter())
            .map(|p| *p + jump)
            .collect();
        let there = moved(&poses[5], jump);
        let by_limit = frame(&mut garment, TICK_S, &there);
        let shown = garment.show(Display::Interpolated).unwrap().positions.to_vec();
        assert!(largest_distance(&shown, &expected) < 1e-5, "{mode:?}");
        assert_eq!(garment.intersection(), mode);
        asked.teleport();
        assert!(frame(&mut asked, TICK_S, &there) == by_limit, "{mode:?}");
        let vertices = &garment.state().unwrap().vertices;
        assert!(vertices.iter().all(|v| v.previous == v.value), "at rest");
    }
}

#[test]
fn a_garment_that_has_not_begun_has_nothing_to_carry() {
    let model = model(&variant("projected"));
    let poses = motion(3);
    let mut garment = after(&model, &poses[..2]);
    garment.restart();
    garment.teleport();
    let found = frame(&mut garment, TICK_S, &poses[2]);
    assert!(found == stepped(&model, &poses[2..]));
}

#[test]
fn a_restored_state_goes_on_whatever_the_garment_did_before() {
    let model = model(&variant("projected"));
    let poses = motion(8);
    let mut original = after(&model, &poses[..6]);
    let state = original.state().unwrap().clone();
    let expected: Vec<_> = poses[6..]
        .iter()
        .map(|pose| frame(&mut original, TICK_S, pose))
        .collect();
    let far = moved(&poses[0], Vec3::X * 50.0);
    let mut halfway = after(&model, std::slice::from_ref(&far));
    frame(&mut halfway, TICK_S / 2.0, &far);
    let mut paused = halfway.clone();
    paused.interrupt();
    for mut garment in [LiveGarment::new(Arc::clone(&model)), halfway, paused] {
        garment.restore(state.clone()).unwrap();
        // Neither a pause nor a teleport loses it.
        garment.interrupt();
        garment.teleport();
        assert!(garment.state() == Some(&state));
        let found: Vec<_> = poses[6..]
            .iter()
            .map(|pose| frame(&mut garment, TICK_S, pose))
            .collect();
        assert!(found == expected);
    }
}

#[test]
fn a_state_of_another_model_is_refused_and_the_garment_goes_on() {
    let poses = motion(4);
    let other = after(&model(&variant("paper")), &poses[..2]);
    let model = model(&variant("projected"));
    let mut garment = after(&model, &poses[..3]);
    garment.restore(other.state().unwrap().clone()).unwrap_err();
    assert!(frame(&mut garment, TICK_S, &poses[3]) == stepped(&model, &poses));
}

#[test]
fn interrupted_and_failed_garments_begin_anew() {
    let model = model(&variant("projected"));
    let poses = motion(4);
    let expected = stepped(&model, &poses[3..]);
    let mut garment = LiveGarment::new(Arc::clone(&model));
    assert!(garment.state().is_none());
    assert!(garment.show(Display::Interpolated).is_err(), "no frame yet");
    frame(&mut garment, TICK_S, &poses[0]);
    garment.interrupt();
    assert!(frame(&mut garment, TICK_S, &poses[3]) == expected);
    let broken = moved(&poses[1], Vec3::NAN);
    let around = Surroundings::default();
    let found = garment.advance(TICK_S, &broken, &around);
    assert_eq!(found, Err(AnimatorError::Pose));
    assert!(garment.state().is_none());
    assert!(frame(&mut garment, TICK_S, &poses[3]) == expected);
}

#[test]
fn wind_ground_and_teleports_have_the_size_of_the_character() {
    let model = model(&variant("projected"));
    let poses = motion(5);
    let around = |size: f32| Surroundings {
        size,
        wind: size * Vec3::new(2.0, 0.0, 1.0),
        ground_height: size * 0.1,
        ..Surroundings::default()
    };
    let run = |size: f32| {
        let mut garment = LiveGarment::new(Arc::clone(&model));
        for pose in &poses {
            garment.advance(TICK_S, pose, &around(size)).unwrap();
        }
        garment
    };
    let (mut plain, mut giant) = (run(1.0), run(2.0));
    assert!(plain.state() == giant.state());
    // 0.8 m of the model are 1.6 m for the giant, more than 30 m/s.
    let there = moved(&poses[4], Vec3::X * 0.8);
    for (garment, size) in [(&mut plain, 1.0), (&mut giant, 2.0)] {
        garment.advance(TICK_S, &there, &around(size)).unwrap();
    }
    assert!(plain.state() != giant.state());
}
