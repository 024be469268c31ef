//! Contract of masses on springs: closed forms of free swings, even motion and turns, invariance to
//! rigid motion and to the frame rate.

use super::*;
use std::f32::consts::TAU;

fn one(damping: SpringDamping) -> MotionSpec {
    let mut spec = spec(MotionLayout::Heading, VelocityScheme::Backward, 3);
    spec.springs = JointSprings {
        joints: vec![0],
        springs: vec![Spring {
            frequency_hz: 1.0,
            damping_ratio: 0.25,
            damping,
        }],
    };
    spec
}

/// Offsets of the mass in the world, metres, for a character that is moved and turned by `at`.
fn offsets(
    spec: &MotionSpec,
    fps: f32,
    seconds: f32,
    at: impl Fn(f32) -> (Vec3, Quat),
    wind: Vec3,
) -> Vec<Vec3> {
    let skeleton = skeleton(&[-1, 0, 1]);
    let pose = |t: usize| {
        let (trans, turn) = at(t as f32 / fps);
        let mut pose = skeleton.bind_pose();
        let root = skeleton.root();
        pose.local[root] = turn * pose.local[root];
        // The root joint goes round the origin, where it would turn about itself.
        pose.trans = trans - skeleton.joints()[root];
        pose
    };
    let poses: Vec<Pose> = (0..=(seconds * fps) as usize).map(pose).collect();
    let input = |t: usize| MotionInput {
        pose: &poses[t],
        next_pose: None,
        ground_height: 0.0,
        dt: 1.0 / fps,
        wind,
    };
    let mut state = MotionState::start(spec, &skeleton, &input(0));
    let mut found = Vec::new();
    for t in 1..poses.len() {
        state.advance(spec, &skeleton, &input(t));
        let c = state.pair().1;
        let local = Vec3::from_slice(&c[motion_len(3)..]) / TAU;
        found.push(state.world_from_joint()[0].rotation * local);
    }
    found
}

/// Runs along +X at 2 m/s for a second, then stands.
fn run_and_stop(t: f32) -> (Vec3, Quat) {
    (Vec3::X * 2.0 * t.min(1.0), Quat::IDENTITY)
}

#[test]
fn a_mass_swings_on_after_a_stop_at_any_frame_rate() {
    for (damping, trail) in [
        (SpringDamping::Joint, 0.0),
        (SpringDamping::Air, -2.0 * 0.25 * 2.0 / TAU),
    ] {
        let spec = one(damping);
        for fps in [10.0, 30.0, 120.0] {
            let found = offsets(&spec, fps, 2.0, run_and_stop, Vec3::ZERO);
            for (t, found) in (1..).map(|t| t as f32 / fps).zip(found) {
                // Free swing of e with e(0) = trail and a velocity of 2 m/s.
                let s = (t - 1.0).max(0.0);
                let (decay, swing) = (0.25 * TAU, TAU * (1.0f32 - 0.0625).sqrt());
                let sine = (2.0 + decay * trail) / swing;
                let expected = (-decay * s).exp() * (trail * (swing * s).cos() + sine * (swing * s).sin());
                assert!(
                    (found - Vec3::X * expected).length() < 2e-5,
                    "{fps} Hz, {t} s: {found}, {expected}"
                );
            }
        }
    }
}

#[test]
fn a_mass_in_the_wind_is_one_that_moves_against_it() {
    let spec = one(SpringDamping::Air);
    let still = |t: f32| (Vec3::X * 2.0 * (t.min(1.0) - t), Quat::IDENTITY);
    let blown = offsets(&spec, 30.0, 3.0, still, Vec3::X * -2.0);
    let moving = offsets(&spec, 30.0, 3.0, run_and_stop, Vec3::ZERO);
    for (a, b) in blown.iter().zip(&moving) {
        assert!((*a - *b).length() < 2e-5, "{a} {b}");
    }
}

#[test]
fn a_mass_flies_out_in_a_turn() {
    let spec = one(SpringDamping::Joint);
    let (radius, rate) = (0.3, 2.0f32);
    let circle = |t: f32| {
        let turn = Quat::from_rotation_y(rate * t);
        (turn * Vec3::X * radius, turn)
    };
    let fps = 240.0;
    let found = offsets(&spec, fps, 8.0, circle, Vec3::ZERO);
    let turn = Quat::from_rotation_y(rate * 8.0);
    let found = turn.conjugate() * found[found.len() - 1];
    // ë + 2 ζ ω ė + ω² e = −s̈ for s = r exp(i Ω t) has e = Ω² s / (ω² − Ω² + 2 i ζ ω Ω).
    let (real, imaginary) = (TAU * TAU - rate * rate, 0.5 * TAU * rate);
    let size = radius * rate * rate / (real * real + imaginary * imaginary);
    // A turn about +Y takes +X to −Z.
    let expected = Vec3::new(real, 0.0, imaginary) * size;
    assert!(expected.x > 0.02);
    assert!(
        (found - expected).length() < 0.01 * expected.length(),
        "{found} {expected}"
    );
}

#[test]
fn offsets_are_invariant_to_where_the_character_is_and_faces() {
    let skeleton = skeleton(&SMPL_PARENTS);
    let mut spec = spec(MotionLayout::Heading, VelocityScheme::Backward, 24);
    spec.springs = springs(24);
    let motion = motion(24);
    let turned = |trans: Vec3, turn: Quat| -> Vec<Pose> {
        let poses = motion.poses();
        let root = skeleton.joints()[0];
        let moved = |pose: &Pose| {
            let mut local = pose.local.clone();
            local[0] = turn * local[0];
            let trans = turn * (pose.trans + root) - root + trans;
            Pose { trans, local }
        };
        poses.iter().map(moved).collect()
    };
    let vectors = |poses: &[Pose]| -> Vec<Vec<f32>> {
        let all = streamed(&spec, &skeleton, poses, Source::Live);
        all.iter().map(|c| c[motion_len(24)..].to_vec()).collect()
    };
    let here = vectors(&turned(Vec3::ZERO, Quat::IDENTITY));
    let there = vectors(&turned(Vec3::new(3.0, 0.5, -4.0), Quat::from_rotation_y(2.0)));
    assert_close(&here, &there, 1e-3);
    assert!(here[60].iter().any(|x| x.abs() > 0.1));
    // The masses of frame 0 trail as those of an even motion do.
    assert_eq!(here[0].len(), spec.springs.numbers());
    assert!(here[0].iter().any(|x| x.abs() > 0.01));
}

#[test]
fn every_joint_and_spring_has_its_place() {
    let (skeleton, poses) = (skeleton(&[-1, 0, 1]), motion(3).poses());
    let of = |joints: Vec<usize>, springs: Vec<Spring>| -> Vec<Vec<f32>> {
        let mut spec = spec(MotionLayout::Heading, VelocityScheme::Backward, 3);
        spec.springs = JointSprings { joints, springs };
        let all = streamed(&spec, &skeleton, &poses, Source::Live);
        all.iter().map(|c| c[motion_len(3)..].to_vec()).collect()
    };
    let both = springs(3).springs;
    let all = of(vec![2, 0], both.clone());
    for (place, (joint, spring)) in [(2, 0), (2, 1), (0, 0), (0, 1)].into_iter().enumerate() {
        let alone = of(vec![joint], vec![both[spring]]);
        for (all, alone) in all.iter().zip(&alone) {
            assert_eq!(all[3 * place..3 * place + 3], alone[..]);
        }
    }
    assert_ne!(all[50][..3], all[50][3..6]);
}

#[test]
fn masses_of_frame_0_trail_in_both_schemes() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    let first = |velocity, source| {
        let mut spec = spec(MotionLayout::Heading, velocity, 24);
        spec.springs = springs(24);
        let state = MotionState::start(&spec, &skeleton, &input(&poses, 0, source));
        let at_start = state.pair().1[motion_len(24)..].to_vec();
        let streamed = streamed(&spec, &skeleton, &poses[..3], source);
        (at_start, [0, 1].map(|t| streamed[t][motion_len(24)..].to_vec()))
    };
    let (known, forward) = first(VelocityScheme::Forward, Source::Clip);
    let (awaited, backward) = first(VelocityScheme::Backward, Source::Live);
    assert_eq!(known, forward[0]);
    assert!(awaited.iter().all(|x| *x == 0.0));
    assert_eq!(forward, backward);
}

#[test]
fn a_joint_that_is_suddenly_elsewhere_takes_its_masses_along() {
    let spec = one(SpringDamping::Air);
    let jump = |t: f32| {
        let (at, turn) = run_and_stop(t);
        (at + Vec3::Z * if t > 1.5 { 30.0 } else { 0.0 }, turn)
    };
    let found = offsets(&spec, 30.0, 3.0, jump, Vec3::ZERO);
    assert!(found.iter().all(|e| e.z.abs() < 1e-3 && e.length() < 0.5));
}
