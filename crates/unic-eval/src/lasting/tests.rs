//! Contract: each measure agrees with the closed form of a model and a garment that have one.

use super::*;
use crate::lasting::{
    aliveness::Spectrum,
    drift::Window,
    random_motion::StoppingPoint,
    skinned_garment::SkinnedGarment,
    stops::{HemSwing, find},
};
use glam::{DVec3, Quat, Vec3};
use std::{f64::consts::TAU, sync::Arc};
use tempfile::TempDir;
use unic_core::{
    IntersectionMode, Model, Pose, Start, StepInput,
    clip::Clip,
    config::{
        DisplacementConfig, EncoderConfig, FieldConfig, LatentCode, ModelConfig, PointInput, StateConfig,
    },
    features::{PointFrame, RestBox, limited},
    model::{About, ModelParts},
    motion::{MotionLayout, MotionSpec, Normalisation, VelocityScheme, motion_len},
    network::Linear,
    prior::Prior,
};
use unic_testdata::{FPS, Figure, Take, VERTICES};

const SCALE_M: f32 = 0.05;
const LIMIT: f32 = 3.0;

fn linear(inputs: usize, outputs: usize) -> Linear {
    Linear {
        inputs,
        outputs,
        weight: vec![0.0; inputs * outputs],
        bias: vec![0.0; outputs],
    }
}

/// Makes an animator whose displacements obey d_t = exp(−dt / `memory_s`) d_{t−1} + `push(bias)`.
fn animator(memory_s: f32, bias: Vec3) -> Animator {
    let Figure {
        character, garment, ..
    } = Figure::tube();
    let joints = character.skeleton.len();
    let pair = 2 * motion_len(joints);
    let mut field = vec![linear(11, 8), linear(19, 8), linear(8, 3)];
    field[2].bias = bias.to_array().to_vec();
    let (layout, velocity) = (MotionLayout::Heading, VelocityScheme::Backward);
    let model = Model::new(ModelParts {
        config: ModelConfig {
            fps: FPS,
            motion: MotionSpec::new(layout, velocity, [4, 4, 5, 5], &character).unwrap(),
            encoder: EncoderConfig {
                hidden: vec![4],
                channels: 2,
                categories: 3,
                code: LatentCode::PickedLogit,
            },
            field: FieldConfig {
                width: 8,
                hidden_layers: 2,
                skip: Some(1),
            },
            state: StateConfig::Displacement(DisplacementConfig {
                memory_s,
                excursion_m: None,
                scale_m: SCALE_M,
                output_limit: LIMIT,
                inputs: vec![PointInput::Displacement, PointInput::Velocity, PointInput::Rest],
            }),
            intersection: IntersectionMode::Off,
            projection: None,
        },
        rest_box: RestBox::of(&garment.rest.vertices),
        prior: Prior::constant(vec![Vec3::ZERO; VERTICES], pair),
        normalisation: Normalisation::identity(motion_len(joints)),
        encoder: vec![linear(pair, 4), linear(4, 6)],
        field,
        character,
        garment,
        strain_limits: Vec::new(),
        about: About::default(),
    });
    Animator::new(Arc::new(model.unwrap()))
}

fn push(bias: Vec3) -> Vec3 {
    limited(bias, LIMIT) * SCALE_M
}

/// Makes a clip of the tube in which every vertex has the displacement `offset(seconds)`.
fn take(name: &str, seed: usize, frames: usize, offset: impl Fn(f32) -> Vec3) -> Take {
    of_clip(unic_testdata::clip(name, seed, frames), offset)
}

fn of_clip(clip: Clip, offset: impl Fn(f32) -> Vec3) -> Take {
    let Figure {
        character, garment, ..
    } = Figure::tube();
    let (mut joints, mut transforms) = (Vec::new(), Vec::new());
    let mut frame = |(t, pose): (usize, &Pose)| {
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        let offset = offset(t as f32 / FPS);
        let place = |vertex| PointFrame::new(&garment, vertex, &transforms).position(offset);
        (0..VERTICES).map(place).collect()
    };
    let garment = clip.poses.iter().enumerate().map(&mut frame).collect();
    Take { clip, garment }
}

fn capture(test: Vec<Take>, train: Vec<Take>) -> (TempDir, Capture) {
    let test = test.into_iter().map(|take| (take, Split::Test));
    let train = train.into_iter().map(|take| (take, Split::Train));
    unic_testdata::capture(&Figure::tube(), &test.chain(train).collect::<Vec<_>>())
}

fn with<T>(capture: &Capture, animator: Animator, act: impl FnOnce(&mut Runner) -> T) -> T {
    let mut watch = |_: &Progress| Ok(());
    act(&mut Runner::new(capture, animator, &mut watch))
}

#[track_caller]
fn near(found: f64, expected: f64, share: f64) {
    assert!(
        (found - expected).abs() <= share * expected.abs(),
        "{found}, not {expected}"
    );
}

const SHORT: Window = Window {
    least: 1.5,
    restart: 0.5,
    compared: 0.8..1.2,
};

#[test]
fn a_model_without_state_does_not_drift() {
    let takes = vec![
        take("a", 0, 50, |_| Vec3::X * 0.1),
        take("b", 1, 20, |_| Vec3::ZERO),
    ];
    let (_folder, capture) = capture(takes, vec![take("c", 2, 45, |_| Vec3::Y * 0.1)]);
    let drift = with(&capture, animator(0.0, Vec3::ZERO), |s| drift::measure(s, &SHORT)).unwrap();
    let clips: Vec<_> = drift.iter().map(|d| (d.clip.as_str(), d.split)).collect();
    assert_eq!(clips, [("c", "train"), ("a", "test")], "b is too short");
    for drift in drift {
        assert_eq!(drift.ratio, 1.0);
        near(drift.from_start_mm, 100.0, 1e-4);
    }
}

#[test]
fn an_integrator_drifts_in_proportion_to_time() {
    let (_folder, capture) = capture(vec![take("a", 0, 50, |_| Vec3::ZERO)], vec![]);
    let runner = animator(1e6, Vec3::Z * 0.01);
    let drift = with(&capture, runner, |s| drift::measure(s, &SHORT)).unwrap();
    // The error grows by one push a frame, from frame 0 and from frame 15.
    let squares = |from: usize| (25..=36).map(|t| ((t - from) as f64).powi(2)).sum::<f64>();
    near(drift[0].ratio, (squares(0) / squares(15)).sqrt(), 1e-3);
    let push = 1e3 * f64::from(push(Vec3::Z * 0.01).length());
    near(drift[0].restarted_mm, push * (squares(15) / 12.0).sqrt(), 1e-3);
}

fn settings(seed: u64) -> Settings {
    Settings {
        seed,
        random_frames: 300,
    }
}

#[test]
fn random_motion_is_measured_against_the_largest_displacement_of_training() {
    let train = vec![take("a", 0, 40, |s| Vec3::X * 0.1 * s.min(1.0))];
    let (_folder, capture) = capture(vec![take("b", 1, 40, |_| Vec3::X)], train);
    let bias = Vec3::new(0.0, -1.0, 0.5);
    let runner = animator(0.0, bias);
    let (random, stopping_points) =
        with(&capture, runner, |s| random_motion::measure(s, &settings(1))).unwrap();
    near(random.training_largest_mm, 100.0, 1e-4);
    near(random.largest_mm, 1e3 * f64::from(push(bias).length()), 1e-4);
    near(random.ratio, random.largest_mm / 100.0, 1e-4);
    assert_eq!(
        (random.frames, random.frames_not_finite, stopping_points.len()),
        (300, 0, 10)
    );
}

#[test]
fn random_motion_is_smooth_and_depends_only_on_its_seed() {
    let takes = vec![take("a", 0, 40, |_| Vec3::ZERO), take("b", 1, 40, |_| Vec3::ZERO)];
    let (_folder, capture) = capture(takes, vec![]);
    let clip = |seed| random_motion::clip(&capture, FPS, &settings(seed)).unwrap();
    let one = clip(1);
    assert_eq!(one, clip(1));
    assert_ne!(one, clip(2));
    assert!(one.poses.iter().all(Pose::is_valid));
    let steps = one.poses.windows(2);
    let fastest = steps.map(|p| (p[1].trans - p[0].trans).with_y(0.0).length() * FPS);
    let fastest = fastest.fold(0.0, f32::max);
    assert!((1.0..=4.001).contains(&fastest), "{fastest} m/s");
    for pair in one.poses.windows(2) {
        for (a, b) in pair[0].local.iter().zip(&pair[1].local) {
            // Half a turn eased over 0.3 s peaks at 1.875 times its mean rate; the root turns by 9°
            // more.
            assert!(a.angle_between(*b) < 0.9);
        }
    }
}

#[test]
fn displacements_decay_while_standing_as_the_state_does() {
    let (_folder, capture) = capture(vec![], vec![take("a", 0, 40, |_| Vec3::ZERO)]);
    let mut runner = animator(1.0, Vec3::ZERO);
    let pose = capture.load_clip("a").unwrap().clip.poses[20].clone();
    let input = StepInput {
        pose: &pose,
        next_pose: None,
        ground_height: 0.0,
        wind: Vec3::ZERO,
    };
    let hung = runner.reset(&input, Start::MeanShape).unwrap().positions.to_vec();
    let moved: Vec<Vec3> = hung.iter().map(|x| *x + Vec3::X * 0.1).collect();
    runner.reset(&input, Start::Positions(&moved)).unwrap();
    let state = runner.state().clone();
    let stopping_points = [StoppingPoint { pose, state }];
    let standing = with(&capture, runner, |s| standing::measure(s, &stopping_points)).unwrap();
    near(standing.worst_mm, 100.0 * (-3.5_f64).exp(), 1e-3);
}

#[test]
fn a_sine_in_the_band_has_half_its_squared_amplitude() {
    let spectrum = Spectrum::new(30.0);
    let energy = |hertz: f64, amplitude: f64, phase: f64| {
        let at = |t: usize| 7.0 + amplitude * (TAU * hertz * t as f64 / 30.0 + phase).sin();
        spectrum.energy(&(0..310).map(at).collect::<Vec<_>>()).unwrap()
    };
    for (hertz, phase) in [(1.0, 0.0), (2.0, 1.0), (2.1, 0.3), (4.0, 2.0)] {
        near(energy(hertz, 0.3, phase), 0.045, 1e-3);
    }
    for hertz in [0.0, 0.05, 6.0, 9.0] {
        assert!(energy(hertz, 0.3, 0.5) < 0.045 * 2e-3, "{hertz} Hz");
    }
    assert_eq!(spectrum.energy(&[1.0; 119]), None);
}

#[test]
fn a_still_model_of_a_swinging_garment_has_no_band_energy() {
    let mut clip = unic_testdata::clip("a", 0, 150);
    let still = clip.poses[0].clone();
    clip.poses.fill(still);
    let swing = |s: f32| Vec3::new(0.0, 0.02 * (1.5 * std::f32::consts::TAU * s).sin(), 0.1);
    let (_folder, capture) = capture(vec![of_clip(clip, swing)], vec![]);
    let (alive, _) = with(&capture, animator(0.0, Vec3::ZERO), test_clips).unwrap();
    near(alive[0].true_band_energy_mm2, 200.0, 1e-3);
    assert!(
        alive[0].band_energy_ratio < 1e-6 && alive[0].jitter_ratio < 1e-3,
        "{alive:?}"
    );
    // A model whose memory never fades keeps the true displacement of frame 0, and is as still.
    let (alive, _) = with(&capture, animator(1e6, Vec3::ZERO), test_clips).unwrap();
    assert!(alive[0].band_energy_ratio < 1e-6);
}

/// Makes a clip that walks at 1.5 m/s, brakes within `braking` seconds and stands for `quiet`
/// seconds.
fn walk_and_stop(braking: f32, quiet: f32) -> Clip {
    let skeleton = Figure::tube().character.skeleton;
    let mut place = 0.0;
    let pose = |t: usize| {
        let s = t as f32 / FPS;
        let speed = 1.5 * (1.0 - (s - 3.0) / braking).clamp(0.0, 1.0);
        let speed = if s > 3.0 + braking + quiet { 1.5 } else { speed };
        place += speed / FPS;
        Pose {
            trans: Vec3::new(place, 0.02 * (9.0 * s).sin(), 0.0),
            ..skeleton.bind_pose()
        }
    };
    Clip {
        poses: (0..240).map(pose).collect(),
        ..unic_testdata::clip("stop", 0, 1)
    }
}

#[test]
fn only_sudden_and_lasting_stops_are_found() {
    let skeleton = Figure::tube().character.skeleton;
    let stops = |braking, quiet| find(&skeleton, &walk_and_stop(braking, quiet));
    let found = stops(0.5, 3.0);
    assert_eq!(found.len(), 1);
    // The speed is below 0.2 m/s after 0.43 s of braking. Speeds are measured over 0.2 s.
    assert!((102..=106).contains(&found[0]), "{found:?}");
    assert!(stops(2.5, 2.0).is_empty(), "slow");
    assert!(stops(0.5, 1.0).is_empty(), "short");
}

/// Makes two vertices of a hem that circle around their place at rest, so that their RMS is the
/// envelope.
fn ringing(decay_s: f64, hertz: f64, fps: f64) -> Vec<Vec<DVec3>> {
    let at = |t: usize| {
        let s = t as f64 / fps;
        let (sin, cos) = (TAU * hertz * s).sin_cos();
        let size = 0.03 * (-s / decay_s).exp();
        let rest = DVec3::new(0.2, 0.1, -0.3);
        vec![rest + DVec3::X * size * cos, rest + DVec3::Z * size * sin]
    };
    (0..(6.0 * fps) as usize).map(at).collect()
}

#[test]
fn a_damped_oscillation_has_its_decay_time_and_overshoot() {
    for (decay_s, hertz) in [(0.3, 2.0), (0.5, 1.0), (0.2, 1.5)] {
        let swing = HemSwing::measure(&ringing(decay_s, hertz, 240.0), 240.0);
        near(swing.decay_s.unwrap(), decay_s, 1e-2);
        // The least of exp(−t/τ) cos ωt is at tan ωt = −1 / (ω τ).
        let slope = (1.0 / (TAU * hertz * decay_s)).atan();
        let least = (-(TAU / 2.0 - slope) / (TAU * hertz * decay_s)).exp() * slope.cos();
        near(swing.overshoot, least * 0.03 / 2.0_f64.sqrt(), 1e-2);
    }
    // Without oscillation there is no overshoot. A hem at rest has neither.
    let creeping = HemSwing::measure(&ringing(0.3, 0.0, 240.0), 240.0);
    near(creeping.decay_s.unwrap(), 0.3, 1e-2);
    assert!(creeping.overshoot < 1e-6);
    let still = HemSwing::measure(&vec![vec![DVec3::ONE]; 45], 30.0);
    assert_eq!((still.decay_s, still.overshoot), (Some(0.0), 0.0));
    // A hem that never rests has no decay time.
    assert_eq!(HemSwing::measure(&ringing(1e3, 1.0, 30.0), 30.0).decay_s, None);
}

#[test]
fn a_model_without_state_recovers_at_once() {
    let takes = vec![
        take("a", 0, 200, |s| Vec3::X * 0.1 * s.sin()),
        take("b", 3, 170, |_| Vec3::Y * 0.1),
    ];
    let (_folder, capture) = capture(takes, vec![]);
    let (_, recovery) = with(&capture, animator(0.0, Vec3::Z), test_clips).unwrap();
    let kinds: Vec<_> = recovery.iter().map(|r| r.disturbance).collect();
    assert_eq!(kinds, Disturbance::ALL);
    for recovery in recovery {
        assert!(recovery.events >= 2);
        near(recovery.ratio, 1.0, 1e-4);
        near(recovery.worst_ratio, 1.0, 1e-4);
    }
}

#[test]
fn a_bad_start_decays_as_the_state_does() {
    // One moment, at frame 59 of 148: halfway between one second after the start and three before
    // the end.
    let (_folder, capture) = capture(vec![take("a", 0, 180, |_| Vec3::X * 0.1)], vec![]);
    let (_, recovery) = with(&capture, animator(2.0, Vec3::ZERO), test_clips).unwrap();
    let events = recovery[0].events;
    assert_eq!(events, 1);
    let event = 30 + (180 - 91 - 30) / 2;
    // The undisturbed run leaves the truth as exp(−t/τ) falls. The run from the rest shape starts
    // away from it.
    let left = |frame: usize| (1.0 - (-(frame as f64) / 60.0).exp()).powi(2);
    let undisturbed: f64 = (event + 31..=event + 60).map(left).sum();
    for recovery in &recovery {
        let expected = match recovery.disturbance {
            Disturbance::MeanShape | Disturbance::RestShape => (30.0 / undisturbed).sqrt(),
            // The other moment is this one, so that its garment is the true one.
            Disturbance::OtherGarment => ((31..=60).map(left).sum::<f64>() / undisturbed).sqrt(),
            Disturbance::Teleport | Disturbance::Cut => 1.0,
            // The run has so many frames less or more in which to leave the truth.
            Disturbance::Dropped => {
                let frames = event + 31..=event + 60;
                (frames.clone().map(left).sum::<f64>() / frames.map(|t| left(t + 15)).sum::<f64>()).sqrt()
            }
            Disturbance::Cartwheel => {
                let later = (event + 31..=event + 60).map(|t| left(t + 45));
                (later.sum::<f64>() / undisturbed).sqrt()
            }
        };
        near(recovery.ratio, expected, 1e-3);
    }
}

#[test]
fn a_teleport_does_not_rotate_vertex_frames() {
    let (_folder, capture) = capture(vec![take("a", 0, 40, |_| Vec3::ZERO)], vec![]);
    let mut skinned = SkinnedGarment::new(&capture);
    let pose = capture.load_clip("a").unwrap().clip.poses[7].clone();
    skinned.pose(&pose);
    let here = skinned.frame(9);
    skinned.pose(&Pose {
        trans: pose.trans + Vec3::X * 5.0,
        ..pose
    });
    let there = skinned.frame(9);
    assert!((there.skinned - here.skinned).distance(Vec3::X * 5.0) < 1e-5);
    assert!(there.rotation.angle_between(here.rotation) < 1e-3);
    let displaced = there.skinned + Quat::from_rotation_y(1.0) * Vec3::X * 0.2;
    assert!((skinned.largest_displacement(&vec![displaced; VERTICES]) - 0.2) >= -1e-5);
    assert!(skinned.largest_displacement(&[Vec3::NAN]).is_nan());
}

fn whole(capture: &Capture, threads: usize) -> LastingReport {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| measure(capture, animator(0.5, Vec3::Y), &settings(3), &mut |_| Ok(())).unwrap())
}

#[test]
fn verdicts_are_the_same_for_any_number_of_threads() {
    let stop = of_clip(walk_and_stop(0.5, 3.0), |s| Vec3::X * 0.02 * (8.0 * s).cos());
    let (_folder, capture) = capture(vec![take("a", 0, 150, |_| Vec3::X * 0.1)], vec![stop]);
    let lasting = whole(&capture, 1);
    assert_eq!(whole(&capture, 3), lasting);
    let json = serde_json::to_value(&lasting).unwrap();
    assert_eq!(
        json["verdicts"][0]["value"],
        serde_json::Value::Null,
        "no clip is long"
    );
    assert_eq!(json["verdicts"][1]["target"]["at_most"], 1.5);
    // A push of 5 cm per frame that decays within half a second adds up to far more than any
    // displacement in training.
    assert_eq!(json["verdicts"][1]["met"], false);
    assert_eq!(json["stops"].as_array().unwrap().len(), 1);
    let text = lasting.to_string();
    for line in [
        "| jitter, by the truth's |",
        "| second 1–2 after |",
        "| stop at 3.",
        "| ≤ 1.05 |",
    ] {
        assert!(text.contains(line), "{line} is not in\n{text}");
    }
}

#[test]
fn a_hem_that_never_rests_misses_the_target_where_the_true_one_rests() {
    let stop = |predicted, truth| Stop {
        clip: "a".into(),
        split: "test",
        at_s: 1.0,
        decay_s: Comparison { predicted, truth },
        overshoot_mm: Comparison {
            predicted: 1.0,
            truth: 1.0,
        },
    };
    let restless = stop(None, Some(0.5)).decay().unwrap();
    assert!(!Target::Within([0.75, 1.25]).is_met(restless.predicted / restless.truth));
    assert_eq!(stop(Some(0.5), None).decay(), None);
}

#[test]
fn nan_meets_no_target() {
    assert!(!Target::AtMost(1.0).is_met(f64::NAN) && !Target::Within([0.0, 2.0]).is_met(f64::NAN));
    assert!(Target::AtMost(1.0).is_met(1.0) && !Target::Within([0.8, 1.2]).is_met(0.7));
}

#[test]
fn an_observer_can_stop_the_measures() {
    let (_folder, capture) = capture(vec![], vec![take("a", 0, 40, |_| Vec3::ZERO)]);
    let mut watch = |tick: &Progress| match tick.done {
        5 => Err("enough".into()),
        _ => Ok(()),
    };
    let stopped = measure(&capture, animator(0.0, Vec3::ZERO), &settings(1), &mut watch);
    assert_eq!(stopped.unwrap_err().to_string(), "enough");
}
